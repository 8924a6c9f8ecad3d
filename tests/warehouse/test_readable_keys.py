"""Keys that read as the vessel's name, and tables of layout 3 that are brought to them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from shutil import copytree
from typing import Any

import polars as pl
import pytest
from deltalake import DeltaTable, write_deltalake
from deltalake.exceptions import CommitFailedError

from kempf.schemas.errors import KempfError, UsageError
from kempf.schemas.profile import VesselProfile
from kempf.schemas.tables import TABLES
from kempf.warehouse.storage import delta, keys, table_cache
from kempf.warehouse.storage.keys import earlier_key, vessel_key
from kempf.warehouse.storage.marker import LAYOUT, Marker
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, diagnoses, examinations, notes, parameter_sets, purges, readings, vessels
from kempf.warehouse.tables import segments as segment_table
from kempf.warehouse.tables.deposit import deposit
from kempf.warehouse.upkeep.migrations import by_name, chain, commits
from kempf.warehouse.upkeep.verify import verify
from tests.flows.content import seen
from tests.warehouse.earlier import look, write_earlier_keys
from tests.warehouse.samples import delivery, examination, parameter_set, segment


@pytest.mark.parametrize(
    ("name", "reads"),
    [
        ("Ferry One", "ferry-one"),
        ("ferry one", "ferry-one"),
        ("../../etc", "etc"),
        ("CON", "con"),
        ("Åland II", "aland-ii"),
        ("--Ms.  Éclair_7--", "ms-eclair-7"),
        ("東方", "vessel"),
        ("x" * 300, "x" * 24),
        ("twenty-three letters - and more", "twenty-three-letters-and"),
    ],
)
def test_a_key_reads_as_the_name(name: str, reads: str) -> None:
    key = vessel_key(name)
    assert key == f"{reads}-{earlier_key(name)[:8]}" and re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*-[0-9a-f]{8}", key)


@pytest.mark.parametrize("name", ["", " \t", "\ud800"])
def test_what_is_no_name_has_no_key(name: str) -> None:
    for key in (vessel_key, earlier_key):
        with pytest.raises(UsageError) as caught:
            key(name)
        assert caught.value.code == "vessel_name"


def test_no_two_vessels_share_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    warehouse = Warehouse(str(tmp_path / "w"))
    monkeypatch.setattr(keys, "_hash", lambda vessel: "0" * 64)
    profile = VesselProfile(length_m=58.0)
    vessels.register(warehouse, "Ferry One", profile)
    with pytest.raises(UsageError) as caught:
        vessels.register(warehouse, "ferry one", profile)
    assert caught.value.code == "vessel_key_taken" and vessels.names(warehouse) == ["Ferry One"]


@pytest.fixture(scope="module")
def _layout_3(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two vessels with rows in every table that has their key."""
    folder = tmp_path_factory.mktemp("layout_3") / "w"
    warehouse = Warehouse(str(folder))
    with pytest.MonkeyPatch.context() as patched:
        write_earlier_keys(patched)
        for vessel in ("aurora", "Åland"):
            (held,) = deposit(warehouse, [delivery(vessel, vessel.encode())])
            examinations.replace(warehouse, [examination(vessel, held.log_id, held.ingest_id, "all is well")])
            found = segment(vessel, held.log_id, held.ingest_id)
            segment_table.replace(warehouse, {(vessel, held.ingest_id): [found]})
            made = parameter_set(vessel)
            parameter_sets.insert(warehouse, [made])
            aliases.point(warehouse, vessel, made.parameter_set_id)
            notes.add(warehouse, vessel, "vessel", vessel, "docked")
            fields: tuple[Any, ...] = ("adequate", (), {}, {}, "f" * 16)
            diagnoses.insert(warehouse, diagnoses.StoredDiagnosis("dx-1", vessel, made.parameter_set_id, 0, *fields))
            rows = {"vessel_key": earlier_key(vessel), "vessel": vessel}
            with delta.ensured(warehouse, "diagnosis_evidence") as table:
                one = {**rows, "diagnosis_id": "dx-1", "evidence_json": "{}"}
                delta.replace(table, "diagnosis_evidence", [one], f"vessel = '{vessel}'")
            with delta.ensured(warehouse, "lost") as table:
                one = {**rows, "ingest_id": held.ingest_id, "number": 0, "messages": 3, "why": "torn"}
                delta.replace(table, "lost", [one], f"vessel = '{vessel}'")
        purges.add(warehouse, purges.Purge("aurora", "e" * 64, "gone.csv", 1, 2, 3, 4, "end of the charter"))
    warehouse.mark(Marker(3))
    table_cache._kept.clear()
    return folder


@pytest.fixture
def warehouse(_layout_3: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Warehouse:
    monkeypatch.setattr(by_name, "MOST_FOLDERS", 1)  # a commit a folder
    return Warehouse(str(copytree(_layout_3, tmp_path / "w")))


def said(warehouse: Warehouse) -> dict[str, list[str]]:
    """Return what the tables say, without keys, as texts: what is no number is not equal to itself."""
    found = seen(warehouse)
    for row in (row for rows in found.values() for row in rows):
        row.pop("vessel_key", None)
    return {name: sorted(map(repr, rows)) for name, rows in found.items()}


def test_every_table_says_the_same_under_readable_keys(warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch) -> None:
    passing = chain.forward(warehouse)
    then, lacking = said(passing), verify(passing)
    with monkeypatch.context() as patched:
        write_earlier_keys(patched)
        written = [one.written for one in notes.of_vessel(passing, "Åland")]
    held = {name: delta.read(passing, name) for name in by_name.tables()}
    assert all(rows.height for rows in held.values()), "every table that has the column is looked at"
    first = delta.versions(passing)
    compared = chain.migrate(warehouse, look)
    assert [one.partition(":")[0] for one in compared] == by_name.tables()
    assert said(warehouse) == then
    for name in by_name.tables():
        pairs = delta.read(warehouse, name).select("vessel_key", "vessel").unique().rows()
        assert all(key == vessel_key(vessel) for key, vessel in pairs), name
        # at any moment every row was there once
        contents = [
            commits.contents(warehouse, name, v, by="vessel", without="vessel_key")
            for v in range(first[name], delta.versions(warehouse)[name])
        ]
        assert all(one == contents[0] for one in contents), name
        table = delta.open_table(warehouse, name)
        assert table is not None
        words = next(field.metadata["description"] for field in table.schema().fields if field.name == "vessel_key")
        assert words == TABLES[name].columns[[c.name for c in TABLES[name].columns].index("vessel_key")].words
    assert verify(warehouse) == lacking
    # numbers and times of what was only ever added stay those of the commits that added it
    assert [one.written for one in notes.of_vessel(warehouse, "Åland")] == written != []
    notes.add(warehouse, "Åland", "vessel", "Åland", "undocked")
    assert [one.number for one in notes.of_vessel(warehouse, "Åland")] == [2, 3]
    assert chain.to_do(warehouse) == [] and chain.migrate(warehouse, look) == []


class Another:
    """Another process, which opened the readings when it was made and commits to them later."""

    def __init__(self, warehouse: Warehouse, ingest: str = "0123456789abcdef") -> None:
        self._table = DeltaTable(warehouse.address("readings"))
        self._ingest = ingest
        rows = pl.DataFrame(self._table.to_pyarrow_table()).filter(pl.col("vessel") == "aurora")
        self._rows = rows.with_columns(pl.lit(ingest).alias("ingest_id"))

    def commit(self) -> None:
        data = self._rows.to_arrow().cast(self._table.to_pyarrow_table().schema)
        predicate = f"vessel_key = '{earlier_key('aurora')}' AND ingest_id = '{self._ingest}'"
        write_deltalake(self._table, data, mode="overwrite", predicate=predicate)


def before_exchange(patched: pytest.MonkeyPatch, table: str, action: Callable[[], None]) -> None:
    """Let something happen right before rows of a table are exchanged the first time."""
    commit, left = commits.exchange_alone, [True]

    def meanwhile(handle: DeltaTable, name: str, *arguments: Any) -> None:
        if name == table and left.pop() is True:
            left.append(False)
            action()
        elif name == table:
            left.append(False)
        commit(handle, name, *arguments)

    patched.setattr(commits, "exchange_alone", meanwhile)


def test_who_opened_a_table_before_cannot_commit_to_it_any_more(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    another, refused = Another(warehouse), []

    def late() -> None:
        with pytest.raises(CommitFailedError):
            another.commit()
        refused.append(True)

    before_exchange(monkeypatch, "readings", late)
    chain.migrate(warehouse, look)
    assert refused == [True] and delta.read(warehouse, "readings").height == 10


def test_what_another_process_commits_between_is_not_passed_over(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        before_exchange(patched, "readings", lambda: Another(warehouse).commit())
        with pytest.raises(KempfError) as caught:
            chain.migrate(warehouse, look)
    assert caught.value.code == "warehouse_busy" and warehouse.marker() == Marker(LAYOUT, migrating=3)
    with pytest.raises(KempfError, match="not finished"):
        warehouse.require()
    chain.migrate(warehouse, look)
    added = delta.read(warehouse, "readings", {"ingest_id": "0123456789abcdef"})
    assert added.height == 5 and set(added["vessel_key"]) == {vessel_key("aurora")}
    assert delta.read(warehouse, "readings").height == 15


@pytest.mark.parametrize("name", ["readings", "parameter_sets", "logs"])
def test_rows_that_differ_in_the_end_stop_it(warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    frames = by_name._frames
    changed = {"readings": "heading_rad", "parameter_sets": "covariance", "logs": "size_bytes"}[name]

    def other(*arguments: Any, **named: Any) -> Any:
        for frame in frames(*arguments, **named):
            yield frame.with_columns(_more(frame, changed)) if changed in frame.columns else frame

    monkeypatch.setattr(by_name, "_frames", other)
    with pytest.raises(KempfError) as caught:
        chain.migrate(warehouse, look)
    assert caught.value.code == "migration_differs" and caught.value.details["table"] == name
    assert warehouse.marker() == Marker(LAYOUT, migrating=3)


def _more(frame: pl.DataFrame, column: str) -> pl.Expr:
    if frame[column].dtype.is_nested():
        return pl.col(column).list.eval(pl.element().list.eval(pl.element() * 1.0000001))
    return (pl.col(column) * 2 + 1).alias(column)


def test_rows_that_are_nobodys_are_refused_before_anything_changes(warehouse: Warehouse) -> None:
    passing = chain.forward(warehouse)
    with delta.ensured(passing, "lost") as table:
        rows = delta.rows(table, "lost", {"vessel": "aurora"}).with_columns(pl.lit("f" * 16).alias("vessel_key"))
        delta.replace(table, "lost", iter([rows]), f"vessel_key = '{'f' * 16}'")
    before = delta.versions(passing)
    with pytest.raises(KempfError) as caught:
        chain.migrate(warehouse, look)
    assert caught.value.code == "vessel_key_unknown" and "'aurora' under the key ffff" in caught.value.message
    assert warehouse.marker() == Marker(3) and delta.versions(passing) == before


def test_a_damaged_marker_does_not_bring_it_forward(warehouse: Warehouse) -> None:
    assert warehouse.folder is not None
    (warehouse.folder / "kempf-warehouse.json").write_text("{")
    assert chain.repair_marker(warehouse) and warehouse.marker() == Marker(LAYOUT, migrating=3)
    chain.migrate(warehouse, look)
    (warehouse.folder / "kempf-warehouse.json").unlink()
    assert chain.repair_marker(warehouse) and warehouse.marker() == Marker(LAYOUT)
    assert {row["vessel_key"] for row in delta.read(warehouse, "aliases").rows(named=True)} == {
        vessel_key("aurora"),
        vessel_key("Åland"),
    }
    (held,) = deposit(warehouse, [delivery("aurora", b"after")])
    assert readings.read(warehouse, held.ingest_id).height == 5
