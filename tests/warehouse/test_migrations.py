"""A warehouse of layout 2 is brought forward, table by table; nothing that another process writes meanwhile is lost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from shutil import copytree
from typing import Any

import polars as pl
import pytest
from deltalake import DeltaTable, write_deltalake
from deltalake.exceptions import CommitFailedError

from kempf.schemas.errors import KempfError
from kempf.schemas.tables import TABLES
from kempf.warehouse.storage import delta, seals, table_cache
from kempf.warehouse.storage.keys import earlier_key
from kempf.warehouse.storage.marker import LAYOUT, Marker
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets, readings
from kempf.warehouse.tables.deposit import deposit
from kempf.warehouse.upkeep.migrations import by_month, chain, commits, to_3
from kempf.warehouse.upkeep.verify import Problem, verify
from tests.flows.content import seen
from tests.warehouse.earlier import look, write_earlier_keys
from tests.warehouse.samples import delivery, inputs, parameter_set
from tests.warehouse.samples import readings as readings_of

TABLE = "readings"


@pytest.fixture(scope="module")
def _earlier(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three logs of May and one of June, a folder a log, as versions of layout 2 laid their tables out at first."""
    folder = tmp_path_factory.mktemp("earlier") / "w"
    warehouse = Warehouse(str(folder))
    with pytest.MonkeyPatch.context() as earlier:
        for name in to_3.BY_MONTH:
            now = TABLES[name]
            columns = tuple(column for column in now.columns if column.name != "month")
            then = replace(now, columns=columns, partition_by=("vessel_key", "ingest_id"))
            earlier.setitem(TABLES, name, then)
            earlier.setattr(readings, "_write", _write_by_log)
        write_earlier_keys(earlier)
        june = readings_of()
        june = replace(june, frame=june.frame.with_columns(pl.col("time_utc_ns") + 30 * 86_400_000_000_000))
        given = [delivery("aurora", f"log {i}".encode()) for i in range(3)]
        for one in (*given, delivery("boreas", b"june", readings=june)):
            deposit(warehouse, [one])
    warehouse.mark(Marker(2))
    table_cache._kept.clear()
    return folder


def _write_by_log(warehouse: Warehouse, name: str, batch: Any) -> None:
    """Write as versions did that had a folder a log."""
    for row, frames in batch:
        constants = {"vessel_key": earlier_key(row.vessel), "vessel": row.vessel, "ingest_id": row.ingest_id}
        with delta.ensured(warehouse, name) as table:
            parts = [f.with_columns(pl.lit(v).alias(c) for c, v in constants.items()) for f in frames()]
            predicate = f"vessel_key = '{constants['vessel_key']}' AND ingest_id = '{row.ingest_id}'"
            delta.replace(table, name, iter(parts), predicate)


@pytest.fixture
def warehouse(_earlier: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Warehouse:
    monkeypatch.setattr(by_month, "MOST_LOGS", 1)  # a commit a log
    return Warehouse(str(copytree(_earlier, tmp_path / "w")))


def wrong(warehouse: Warehouse) -> list[Problem]:
    """What is wrong with it; nobody has examined these logs."""
    return [one for one in verify(warehouse) if one.table != "examinations"]


def passing(warehouse: Warehouse) -> Warehouse:
    return chain.forward(warehouse)


def folders(warehouse: Warehouse, name: str = TABLE) -> set[str]:
    table = delta.open_table(warehouse, name)
    assert table is not None
    return {uri.split("/")[-2].partition("=")[0] for uri in table.file_uris()}


class Another:
    """Another process, which opened a table when it was made and commits to it later."""

    def __init__(self, warehouse: Warehouse) -> None:
        self._table = DeltaTable(warehouse.address(TABLE))
        self._schema = self._table.to_pyarrow_table().schema
        self.rows = pl.from_arrow(self._table.to_pyarrow_table()).filter(pl.col("vessel") == "boreas")  # type: ignore[union-attr]
        self.rows = self.rows.with_columns(pl.lit("0123456789abcdef").alias("ingest_id"))

    def commit(self) -> None:
        data = self.rows.to_arrow().cast(self._schema)
        key = earlier_key("boreas")
        predicate = f"vessel_key = '{key}' AND ingest_id = '0123456789abcdef'"
        write_deltalake(self._table, data, mode="overwrite", predicate=predicate)


def before_commit(monkeypatch: pytest.MonkeyPatch, number: int, action: Callable[[], None]) -> None:
    """Let something happen right before the so-many-th commit of the migration, after it read the table."""
    left, commit = [number], commits.append_alone

    def meanwhile(*arguments: Any, **named: Any) -> None:
        left[0] -= 1
        if left[0] == 0:
            action()
        commit(*arguments, **named)

    monkeypatch.setattr(commits, "append_alone", meanwhile)


def test_it_is_brought_forward_and_says_the_same(warehouse: Warehouse) -> None:
    then = seen(passing(warehouse))
    words = chain.to_do(warehouse)
    assert words[0] == "readings of 4 ingests (20 rows) are laid out by vessel and month"
    assert folders(warehouse) == {"ingest_id"}
    said = chain.migrate(warehouse, look)
    assert said[:2] == [f"{name}: 4 ingests have the same rows as before." for name in to_3.BY_MONTH]
    assert "readings: 2 vessels have the same rows as before." in said[2:]
    now = seen(warehouse)
    months = {row.pop("month") for row in now["readings"]}
    assert months == {"2025-05", "2025-06"}
    for rows in (then["readings"], then["rejected"], now["rejected"]):
        for row in rows:
            row.pop("month", None)
    for row in (row for found in (then, now) for rows in found.values() for row in rows):
        row.pop("vessel_key", None)
    assert now == then and wrong(warehouse) == []
    assert folders(warehouse) == {"month"} and warehouse.marker() == Marker(LAYOUT)
    for ingest in {row["ingest_id"] for row in now["logs"]}:
        assert readings.read(warehouse, ingest).height == 5
    table = delta.open_table(warehouse, TABLE)
    assert table is not None and table.metadata().configuration["delta.enableExpiredLogCleanup"] == "false"
    assert {f.name: f.metadata.get("unit") for f in table.schema().fields}["heading_rad"] == "rad"
    assert chain.to_do(warehouse) == [] and chain.migrate(warehouse, look) == []


def test_logs_that_come_after_go_where_the_others_are(warehouse: Warehouse) -> None:
    chain.migrate(warehouse, look)
    (added,) = deposit(warehouse, [delivery("aurora", b"after")])
    assert readings.read(warehouse, added.ingest_id).height == 5
    assert folders(warehouse) == {"month"} and wrong(warehouse) == []


def test_what_another_process_commits_before_the_folders_change_is_not_passed_over(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    another = Another(warehouse)
    with monkeypatch.context() as patched:
        before_commit(patched, 1, another.commit)
        with pytest.raises(KempfError) as caught:
            chain.migrate(warehouse, look)
    assert caught.value.code == "warehouse_busy" and "kempf migrate" in caught.value.next_step
    assert warehouse.marker() == Marker(LAYOUT, migrating=2)
    with pytest.raises(KempfError, match="not finished"):
        warehouse.require()
    assert chain.migrate(warehouse, look)[0] == "readings: 5 ingests have the same rows as before."
    held = delta.read(warehouse, TABLE, {"ingest_id": "0123456789abcdef"})
    assert held.height == another.rows.height == 5 and held["month"].unique().to_list() == ["2025-06"]


def test_another_process_cannot_commit_after_the_folders_changed(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    another, refused = Another(warehouse), []

    def late() -> None:
        with pytest.raises(CommitFailedError):
            another.commit()
        refused.append(True)

    before_commit(monkeypatch, 3, late)
    chain.migrate(warehouse, look)
    assert refused == [True] and wrong(warehouse) == []


def test_what_another_process_commits_between_is_kept(warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch) -> None:
    # one that opens the table in between finds the new folders and writes into them
    another = Another(warehouse)

    def between() -> None:
        rows = another.rows.with_columns(pl.lit("2025-06").alias("month"))
        table = delta.open_table(passing(warehouse), TABLE)
        assert table is not None
        delta.replace(table, TABLE, iter([rows]), "ingest_id = '0123456789abcdef' AND month = '2025-06'")

    with monkeypatch.context() as patched:
        before_commit(patched, 3, between)
        with pytest.raises(KempfError) as caught:
            chain.migrate(warehouse, look)
    assert caught.value.code == "warehouse_busy"
    assert chain.migrate(warehouse, look)[0] == "readings: 4 ingests have the same rows as before."
    assert delta.read(warehouse, TABLE, {"ingest_id": "0123456789abcdef"}).height == 5
    assert delta.read(warehouse, TABLE).height == 25 and wrong(warehouse) == []


def test_rows_that_differ_in_the_end_stop_it(warehouse: Warehouse) -> None:
    place = passing(warehouse)
    for _ in by_month.carry_out(place, TABLE):
        pass
    assert by_month.require_same(place, TABLE) == 4
    table = delta.open_table(place, TABLE)
    assert table is not None
    rows = delta.rows(table, TABLE, {"vessel_key": earlier_key("boreas")})
    for other in (rows.with_columns(pl.col("heading_rad") + 1e-9), rows.head(4), rows.vstack(rows.head(1))):
        delta.replace(table, TABLE, iter([other]), f"vessel_key = '{earlier_key('boreas')}'")
        with pytest.raises(KempfError) as caught:
            chain.migrate(warehouse, look)
        assert caught.value.code == "migration_differs" and f"{other.height} now" in caught.value.message
        assert warehouse.marker() == Marker(LAYOUT, migrating=2)
    delta.replace(table, TABLE, iter([rows.reverse()]), f"vessel_key = '{earlier_key('boreas')}'")
    chain.migrate(warehouse, look)
    assert wrong(warehouse) == []


def test_a_damaged_warehouse_is_left_to_the_version_that_can_repair_it(warehouse: Warehouse) -> None:
    assert warehouse.folder is not None
    path = next((warehouse.folder / TABLE).rglob("part-*.parquet"))
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 16
    path.write_bytes(bytes(data))
    with pytest.raises(KempfError) as caught:
        chain.migrate(warehouse, look)
    assert caught.value.code == "warehouse_damaged" and path.name in caught.value.message
    assert warehouse.marker() == Marker(2) and folders_on_disk(warehouse) == {"ingest_id"}


def folders_on_disk(warehouse: Warehouse) -> set[str]:
    assert warehouse.folder is not None
    return {path.parent.name.partition("=")[0] for path in (warehouse.folder / TABLE).rglob("part-*.parquet")}


def test_a_damaged_marker_does_not_bring_it_forward(warehouse: Warehouse) -> None:
    assert warehouse.folder is not None
    (warehouse.folder / "kempf-warehouse.json").write_text("{")
    assert chain.repair_marker(warehouse) and warehouse.marker() == Marker(LAYOUT, migrating=2)
    assert not chain.repair_marker(warehouse)
    chain.migrate(warehouse, look)
    (warehouse.folder / "kempf-warehouse.json").unlink()
    assert chain.repair_marker(warehouse) and warehouse.marker() == Marker(LAYOUT)


def test_every_commit_is_sealed(warehouse: Warehouse) -> None:
    assert warehouse.folder is not None
    place = warehouse.folder / "logs"
    for version in (0, 2):
        (place / "_seals" / "log" / f"{version:020d}.json").unlink()
    assert seals.unsealed(place) == [0, 2]
    assert "2 commits of tables are sealed" in chain.to_do(warehouse)
    chain.migrate(warehouse, look)
    assert all(seals.unsealed(warehouse.folder / name) == [] for name in delta.versions(warehouse))


def test_the_aliases_of_before_become_current(warehouse: Warehouse) -> None:
    place = passing(warehouse)
    first, second = parameter_set(), parameter_set(made_of=inputs("d" * 64))
    parameter_sets.insert(place, [first, second])
    with delta.ensured(place, "aliases") as table:
        row = {"vessel_key": earlier_key("aurora"), "vessel": "aurora"}
        named = {"current": first, "pooled": first, "model": second, "as-built": first}
        rows = [{**row, "alias": a, "parameter_set_id": one.parameter_set_id} for a, one in named.items()]
        delta.replace(table, "aliases", rows, "vessel = 'aurora'")
    chain.migrate(warehouse, look)
    wanted = {"as-built": first.parameter_set_id, "current": second.parameter_set_id}
    assert aliases.of_vessel(warehouse, "aurora") == wanted
