from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest

from kempf.pipeline.ingest.log_file import LogFile
from kempf.schemas.errors import KempfError, NotFound, UsageError
from kempf.schemas.tables import TABLES
from kempf.warehouse.queries import history
from kempf.warehouse.storage import delta, table_cache
from kempf.warehouse.storage.marker import MARKER
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, logs, parameter_sets, raw, readings, runs, segments, vessels
from kempf.warehouse.tables.deposit import deposit
from kempf.warehouse.upkeep import compaction
from kempf.warehouse.upkeep.migrations.chain import repair_marker
from tests.warehouse.samples import delivery, raw_bytes

READERS = {
    "vessels": vessels.names,
    "logs": logs.current,
    "segments": segments.current,
    "sets": parameter_sets.summaries,
    "set": lambda w: parameter_sets.get(w, "ps-1"),
    "history": lambda w: history.of_vessel(w, "aurora"),
    "aliases": lambda w: aliases.of_vessel(w, "aurora"),
    "runs": runs.all_runs,
    "raw": lambda w: raw_bytes(w, "a" * 64),
    "ingest": lambda w: logs.of_ingest(w, "x"),
    "compact": compaction.compact,
}


@pytest.mark.parametrize("reader", READERS.values(), ids=READERS)
@pytest.mark.parametrize("there", ["nothing", "empty folder", "other folder", "file"])
def test_no_warehouse_is_one_clear_error(tmp_path: Path, reader, there: str) -> None:
    place = tmp_path / "data"
    if there == "file":
        place.write_text("x")
    elif there != "nothing":
        place.mkdir()
        if there == "other folder":
            (place / "letter.txt").write_text("x")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(NotFound) as caught:
        reader(Warehouse(str(place)))
    assert caught.value.code == "no_warehouse"
    assert "kempf ingest" in caught.value.next_step
    assert sorted(tmp_path.rglob("*")) == before  # reading makes nothing


def test_an_empty_warehouse_has_no_rows(warehouse: Warehouse) -> None:
    warehouse.create()
    assert vessels.names(warehouse) == []
    assert logs.current(warehouse) == []
    assert runs.all_runs(warehouse) == []
    assert parameter_sets.summaries(warehouse).height == 0
    assert delta.versions(warehouse) == {}
    with pytest.raises(NotFound) as caught:
        history.of_vessel(warehouse, "aurora")
    assert caught.value.code == "no_vessel"


@pytest.mark.parametrize("there", ["other folder", "file"])
def test_a_place_with_other_things_is_not_taken(tmp_path: Path, there: str) -> None:
    place = tmp_path / "data"
    if there == "file":
        place.write_text("x")
    else:
        place.mkdir()
        (place / "letter.txt").write_text("x")
    with pytest.raises(UsageError) as caught:
        raw.put(Warehouse(str(place)), LogFile(b"log"))
    assert caught.value.code == "not_a_warehouse"
    assert not (place / MARKER).exists()


def test_creating_twice_changes_nothing(warehouse: Warehouse) -> None:
    warehouse.create()
    assert warehouse.folder is not None
    marker = warehouse.folder / MARKER
    stamp = marker.stat().st_mtime_ns
    (warehouse.folder / "added by someone.txt").write_text("x")
    warehouse.create()
    assert marker.stat().st_mtime_ns == stamp
    assert [p.name for p in warehouse.folder.iterdir() if p.name.startswith(".")] == []


@pytest.mark.parametrize("content", ["{", "[]", "null", json.dumps({"layout": 4, "check": "of another number"})])
def test_a_marker_that_is_damaged_is_refused_and_written_anew(warehouse: Warehouse, content: str) -> None:
    warehouse.create()
    assert warehouse.folder is not None
    marker = warehouse.folder / MARKER
    whole = marker.read_bytes()
    marker.write_text(content)
    with pytest.raises(KempfError) as caught:
        logs.current(warehouse)
    assert caught.value.code == "warehouse_marker_damaged"
    assert repair_marker(warehouse) and marker.read_bytes() == whole
    assert not repair_marker(warehouse)


def test_a_marker_of_another_layout_is_refused_and_left(warehouse: Warehouse) -> None:
    warehouse.create()
    assert warehouse.folder is not None
    marker = warehouse.folder / MARKER
    marker.write_text(json.dumps({"layout": 99}))
    with pytest.raises(KempfError) as caught:
        logs.current(warehouse)
    assert caught.value.code == "warehouse_layout"
    assert not repair_marker(warehouse)


@pytest.mark.parametrize("address", ["", "  ", "/data/50%20/x", "/data/a[1]/x", "/data/a=b/x", "s3://bucket/50%"])
def test_an_address_that_cannot_be_used_is_refused(address: str) -> None:
    with pytest.raises(UsageError) as caught:
        Warehouse(address)
    assert caught.value.code == "warehouse_path"


@pytest.mark.parametrize("name", ["a b ø", "a#b", "O'Brien", "a+b,c", "a:b", "readings/logs", "a&b", "ä~(1)"])
def test_folders_with_odd_names_hold_a_warehouse(tmp_path: Path, name: str) -> None:
    from kempf.warehouse.tables import readings
    from kempf.warehouse.tables.deposit import deposit
    from tests.warehouse.samples import delivery

    warehouse = Warehouse(str(tmp_path / name))
    (done,) = deposit(warehouse, [delivery()])
    assert done.outcome == "new"
    assert readings.read(warehouse, done.ingest_id).height == 5
    assert [p.name for p in tmp_path.iterdir()] == [name.split("/", maxsplit=1)[0]]


def test_a_file_address_is_the_folder(tmp_path: Path) -> None:
    assert Warehouse(f"file://{tmp_path}/x").folder == Warehouse(f"{tmp_path}/x").folder
    assert Warehouse("s3://bucket/x").folder is None
    assert Warehouse("s3://bucket/x/").address("logs") == "s3://bucket/x/logs"


def test_credentials_are_not_shown() -> None:
    assert "secret" not in repr(Warehouse("s3://b/x", {"AWS_SECRET_ACCESS_KEY": "secret"}))


def test_a_version_that_is_not_there_is_named(warehouse: Warehouse) -> None:
    runs.record_all(warehouse, [runs.FlowRun("run-1", "ingest", None, "completed")])
    newest = delta.versions(warehouse)["runs"]
    assert delta.read(warehouse, "runs", version=newest).height == 1
    assert delta.read(warehouse, "runs", version=0).height == 0
    for version in (newest + 1, 99):
        with pytest.raises(NotFound) as caught:
            delta.read(warehouse, "runs", version=version)
        assert caught.value.code == "no_table_version"
        assert caught.value.details["newest"] == newest


def test_a_damaged_table_log_is_one_clear_error(warehouse: Warehouse) -> None:
    runs.record_all(warehouse, [runs.FlowRun("run-1", "ingest", None, "completed")])
    assert warehouse.folder is not None
    for commit in (warehouse.folder / "runs" / "_delta_log").glob("*.json"):
        commit.write_bytes(b"{garbage")
    with pytest.raises(KempfError) as caught:
        runs.all_runs(warehouse)
    assert caught.value.code == "table_damaged"
    assert caught.value.details["table"] == "runs"


def test_a_folder_that_cannot_be_written_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(KempfError) as caught:
        Warehouse(str(tmp_path / "file" / "below")).create()
    assert caught.value.code == "warehouse_not_writable"


def test_a_missing_table_file_is_one_clear_error(warehouse: Warehouse) -> None:
    runs.record_all(warehouse, [runs.FlowRun("run-1", "ingest", None, "completed")])
    assert warehouse.folder is not None
    for path in (warehouse.folder / "runs").glob("*.parquet"):
        path.unlink()
    with pytest.raises(KempfError) as caught:
        runs.all_runs(warehouse)
    assert caught.value.code == "table_damaged"


def test_readings_that_are_lent_and_missing_are_one_clear_error(warehouse: Warehouse) -> None:
    (stored,) = deposit(warehouse, [delivery()])
    for path in Path(str(warehouse.folder)).glob("readings/*/*/*.parquet"):
        path.unlink()
    with pytest.raises(KempfError) as caught, readings.lent(warehouse, stored.ingest_id) as rows:
        rows.collect()
    assert caught.value.code == "table_damaged"


def test_a_full_disk_is_reported(warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*arguments, **options):
        raise OSError("no space left on device")

    monkeypatch.setattr("deltalake.write_deltalake", full)
    with pytest.raises(KempfError) as caught:
        runs.record_all(warehouse, [runs.FlowRun("run-1", "ingest", None, "completed")])
    assert caught.value.code == "disk_full"


def test_an_address_of_an_unknown_kind_is_refused() -> None:
    with pytest.raises(UsageError) as caught:
        Warehouse("foo://bar").exists()
    assert caught.value.code == "warehouse_path"


def test_a_table_from_before_a_column_was_known_gets_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place, whole = Warehouse(str(tmp_path / "w")), TABLES["readings"]
    monkeypatch.setitem(TABLES, "readings", dataclasses.replace(whole, columns=whole.columns[:-2]))
    before = delta.ensure_table(place, "readings").schema().fields
    monkeypatch.setitem(TABLES, "readings", whole)
    assert delta.read(place, "readings").columns[-2:] == [column.name for column in whole.columns[-2:]]
    for _ in range(2):
        with delta.ensured(place, "readings") as table:
            after = table.schema().fields
        assert [field.name for field in after] == [column.name for column in whole.columns]
    with delta.reading(place, "readings") as held:
        assert held is not None and held.version() == 1, "they are added once"
    assert len(after) == len(before) + 2
    assert after[-1].metadata["unit"] == "m/s"


@pytest.mark.parametrize("words", ["Read-only file system (os error 30)", "Input/output error (os error 5)"])
def test_a_disk_that_takes_nothing_is_one_clear_error(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch, words: str
) -> None:
    from deltalake.exceptions import DeltaError

    def refusing(*arguments, **options):
        raise DeltaError(f"Generic LocalFileSystem error: Unable to open file: {words}\n   0: <unknown>\n   1: clone3")

    monkeypatch.setattr("deltalake.write_deltalake", refusing)
    with pytest.raises(KempfError) as caught:
        runs.record_all(warehouse, [runs.FlowRun("run-1", "ingest", None, "completed")])
    assert caught.value.code == "warehouse_not_writable"
    assert words in caught.value.message and "clone3" not in caught.value.message


def test_a_table_log_that_is_no_log_is_named_without_what_the_library_adds(warehouse: Warehouse) -> None:
    from shutil import rmtree

    runs.record_all(warehouse, [runs.FlowRun("run-1", "ingest", None, "completed")])
    assert warehouse.folder is not None
    rmtree(warehouse.folder / "runs" / "_seals")
    (warehouse.folder / "runs" / "_delta_log" / f"{1:020d}.json").write_text('{"commitInfo": {')
    table_cache._kept.clear()
    with pytest.raises(KempfError) as caught:
        runs.all_runs(warehouse)
    assert caught.value.code == "table_unreadable"
    assert "\n" not in caught.value.message and "unknown" not in caught.value.message


def test_a_full_disk_in_compaction_is_reported(warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch) -> None:
    from deltalake import DeltaTable
    from deltalake.exceptions import DeltaError

    for k in range(3):
        runs.record_all(warehouse, [runs.FlowRun(f"run-{k}", "ingest", None, "completed")])

    def full(*arguments, **options):
        raise DeltaError("Generic LocalFileSystem error: No space left on device (os error 28)")

    monkeypatch.setattr(DeltaTable, "create_checkpoint", full)
    with pytest.raises(KempfError) as caught:
        compaction.compact(warehouse, more_files_than=1)
    assert caught.value.code == "disk_full"
    assert len(runs.all_runs(warehouse)) == 3
