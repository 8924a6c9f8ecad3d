"""A log that must not be kept: deleted for good from everything that was measured, with a receipt, and never let in."""

from __future__ import annotations

from pathlib import Path
from shutil import copytree

import polars as pl
import pytest

from kempf.flows.jobs.corrections import purge_logs
from kempf.flows.jobs.corrections.purge_logs import purge, what_goes
from kempf.flows.jobs.corrections.remove_logs import move, remove, restore
from kempf.flows.jobs.identify.identify_vessel import identify_vessel
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.repair.repair_warehouse import repair
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.rerun_all import verify_all
from kempf.flows.jobs.reprocess.rerun_set import rerun
from kempf.schemas.errors import DataRejected
from kempf.warehouse.queries.standing import standing_ids
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import vessel_key
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import diagnoses, logs, parameter_sets, purges, raw, readings
from kempf.warehouse.tables.logs import LogRow
from kempf.warehouse.upkeep import compaction
from kempf.warehouse.upkeep.verify import verify
from tests.conftest import Ship
from tests.flows.content import fresh
from tests.workbench.driving import kempf, refused


@pytest.fixture(scope="module")
def _filled(mariner: Ship, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = mariner.write(tmp_path_factory.mktemp("purge"))
    warehouse = fresh(folder / "w")
    given = read_profiles([folder / "profile.yaml"])
    paths = [folder / "mariner.mcap", folder / "mariner.nmea.gz"]
    ingest(warehouse, paths, given=given)
    # read once more, with another profile: earlier versions of the tables hold what was read before
    ingest(warehouse, paths, given=given.model_copy(update={"length_m": 170.0}))
    identify_vessel(warehouse, "mariner")
    row = logs.current(warehouse)[0]
    inputs = {"segments": [{"log_id": row.log_id, "start_utc_ns": 0, "end_utc_ns": 1}]}
    diagnoses.insert(
        warehouse, diagnoses.StoredDiagnosis("dx-1", "mariner", "ps-1", 0, "no known effect", (), {}, inputs, "f" * 16)
    )
    shown = {"vessel_key": vessel_key("mariner"), "vessel": "mariner", "diagnosis_id": "dx-1", "evidence_json": "{}"}
    with delta.ensured(warehouse, "diagnosis_evidence") as table:
        delta.replace(table, "diagnosis_evidence", [shown], "diagnosis_id = 'dx-1'")
    return folder


@pytest.fixture
def warehouse(_filled: Path, tmp_path: Path) -> Warehouse:
    return Warehouse(str(copytree(_filled / "w", tmp_path / "w")))


def held(warehouse: Warehouse, ingest_ids: set[str]) -> list[str]:
    """Files of any version of any table of measurements that hold a row of some ingests."""
    found = []
    assert warehouse.folder is not None
    for table in ("readings", "rejected", "lost", "examinations"):
        for path in sorted((warehouse.folder / table).rglob("*.parquet")):
            if "_delta_log" not in path.parts and ingest_ids & set(pl.read_parquet(path)["ingest_id"]):
                found.append(path.name)
    return found


def ingests_of(warehouse: Warehouse, row: LogRow) -> set[str]:
    return {one.ingest_id for one in logs.all_ingests(warehouse) if one.log_id == row.log_id}


def test_nothing_that_was_measured_is_left_in_any_version(warehouse: Warehouse) -> None:
    row, other = logs.current(warehouse)
    mine = ingests_of(warehouse, row)
    kept = readings.read(warehouse, other.ingest_id)
    # of both ingests: one superseded stays in the table, too
    rows = 2 * readings.read(warehouse, row.ingest_id).height
    assert len(mine) == 2 and len(held(warehouse, mine)) >= 4
    receipt = purge(warehouse, row.log_id[:12], "the charterer's contract")
    assert (receipt.log_id, receipt.readings, receipt.evidence) == (row.log_id, rows, 1)
    assert purges.of_logs(warehouse) == {row.log_id: receipt}
    assert held(warehouse, mine) == [] and raw.kept(warehouse) == [other.log_id]
    assert warehouse.folder is not None
    # the receipt alone is kept where the log was
    assert [path.name for path in warehouse.folder.rglob(f"{row.log_id}*")] == [f"{row.log_id}{purges.NOTE}"]
    assert delta.read(warehouse, "diagnosis_evidence").height == 0 and diagnoses.find(warehouse, "dx-1") is not None
    # the other log is whole, and so is what was made of it
    assert readings.read(warehouse, other.ingest_id).equals(kept)
    assert [one for one in verify(warehouse) if one.table not in {"diagnoses", "aliases"}] == []
    (gone,) = logs.removed(warehouse)
    assert gone.removed == "purged: the charterer's contract"
    of_log = [one for one in parameter_sets.get_all(warehouse, "mariner") if one.log_ids == (other.log_id,)]
    assert of_log and {rerun(warehouse, one.parameter_set_id).verdict for one in of_log} == {"bit-identical"}
    assert not reprocess_vessel(warehouse, "mariner").failures
    standing = parameter_sets.get_all(warehouse, "mariner", standing_ids(warehouse, "mariner"))
    assert standing and all(one.log_ids == (other.log_id,) for one in standing)
    counted = verify_all(warehouse)
    every = parameter_sets.get_all(warehouse, "mariner")
    rest_on_it = {one.parameter_set_id for one in every if row.log_id in one.log_ids}
    assert rest_on_it and set(counted.of_purged_logs) == rest_on_it and counted.counts()["failed"] == 0
    # what looks after the tables goes on
    compaction.compact(warehouse, 1)
    compaction.vacuum(warehouse)
    assert repair(warehouse).gone == []


def test_it_is_never_let_in_again(warehouse: Warehouse, _filled: Path) -> None:
    row = logs.current(warehouse)[0]
    name = row.file_name
    purge(warehouse, row.log_id, "by law")
    (again,) = ingest(warehouse, [_filled / name], "mariner")
    assert again.error is not None and again.error.code == "log_purged" and name in again.error.message
    sets = [one for one in parameter_sets.get_all(warehouse, "mariner") if one.log_ids == (row.log_id,)]
    for attempt in (
        lambda: restore(warehouse, row.log_id),
        lambda: move(warehouse, row.log_id, "mariner", "hers"),
        lambda: rerun(warehouse, sets[0].parameter_set_id),
    ):
        with pytest.raises(DataRejected) as caught:
            attempt()
        assert caught.value.code == "log_purged"
    assert raw.kept(warehouse) == [one.log_id for one in logs.current(warehouse)]


@pytest.mark.parametrize("table", ["readings", "examinations"])
def test_one_that_was_cut_off_is_named_and_goes_on(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch, table: str
) -> None:
    row = logs.current(warehouse)[0]
    mine, whole = ingests_of(warehouse, row), purge_logs.erase

    def cut_off(warehouse: Warehouse, name: str, *rest: object) -> None:
        if name == table:
            raise KeyboardInterrupt
        whole(warehouse, name, *rest)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr(purge_logs, "erase", cut_off)
        with pytest.raises(KeyboardInterrupt):
            purge(warehouse, row.log_id, "by law")
    named = [one for one in verify(warehouse) if one.table == "purges"]
    assert [one.where for one in named] == [row.log_id]
    assert f"kempf purge {row.log_id[:12]} --reason" in str(named[0].next_step)
    first = purges.of_logs(warehouse)[row.log_id]
    assert purge(warehouse, row.log_id, "once more") == first
    assert held(warehouse, mine) == [] and not [one for one in verify(warehouse) if one.table == "purges"]
    assert purges.of_logs(warehouse) == {row.log_id: first}


def test_one_that_was_removed_before_can_be_purged(warehouse: Warehouse) -> None:
    row = logs.current(warehouse)[0]
    remove(warehouse, [row], "another ship")
    purge(warehouse, row.file_name, "by law")
    (gone,) = logs.removed(warehouse)
    assert gone.removed == "another ship" and held(warehouse, ingests_of(warehouse, row)) == []


def test_the_command_says_first_what_goes(warehouse: Warehouse) -> None:
    row = logs.current(warehouse)[0]
    at = ("--warehouse", warehouse.uri)
    asked = kempf("purge", row.log_id, "--reason", "by law", *at)
    assert asked.code == 2 and "is deleted for good" in asked.err and "--yes" in asked.err
    assert purges.of_logs(warehouse) == {} and what_goes(warehouse, row.log_id, "by law").readings > 0
    done = kempf("purge", row.log_id, "--reason", "by law", "--yes", "--json", *at)
    assert done.code == 0 and done.json == purges.of_logs(warehouse)[row.log_id].as_json()
    refused(kempf("purge", "nothing", "--reason", "by law", "--yes", "--json", *at), 4, "no_log")
    blank = kempf("purge", row.log_id, "--reason", " ", "--yes", "--json", *at)
    refused(blank, 2, "no_reason")


def test_a_second_purge_says_that_it_is_done_and_deletes_nothing(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    row, other = logs.current(warehouse)
    receipt = purge(warehouse, row.log_id, "by law")
    monkeypatch.setattr(purge_logs, "erase", lambda *_: pytest.fail("it deletes again"))
    at = ("--warehouse", warehouse.uri)
    again = kempf("purge", row.log_id, "--reason", "once more", *at)
    assert again.code == 0 and "deleted for good already (by law); nothing more was deleted" in again.out
    assert kempf("purge", row.log_id, "--reason", "once more", "--json", *at).json == receipt.as_json()
    assert logs.current(warehouse) == [other]


def test_what_a_repair_kept_aside_goes_too(warehouse: Warehouse) -> None:
    assert warehouse.folder is not None
    first, second = logs.current(warehouse)
    (mine,) = readings_files(warehouse, first)
    data = bytearray(mine.read_bytes())
    data[len(data) // 2] ^= 1
    mine.write_bytes(data)
    repair(warehouse)
    assert list((warehouse.folder / "damaged" / "readings").iterdir())
    purge(warehouse, first.log_id, "end of the charter")
    assert not list((warehouse.folder / "damaged").rglob("*.parquet"))
    assert logs.current(warehouse) == [second]


def test_a_file_that_a_writer_left_half_written_stops_no_purge(warehouse: Warehouse) -> None:
    first, second = logs.current(warehouse)
    (mine,) = readings_files(warehouse, first)
    # as where the power failed before the commit: no version of the table has it
    torn = mine.with_name(f"part-00000-{'0' * 8}.parquet")
    torn.write_bytes(mine.read_bytes()[: mine.stat().st_size // 2])
    # and as a killed writer leaves it: a table file, and a raw log that has no name yet
    unnamed = mine.with_name(f"part-00000-{'0' * 8}.parquet#1")
    unnamed.write_bytes(torn.read_bytes())
    assert warehouse.folder is not None
    passing = warehouse.folder / "raw" / first.log_id[:2] / f".{first.log_id}.{'0' * 16}"
    passing.write_bytes(b"the first lines of the log")
    purge(warehouse, first.log_id, "end of the charter")
    assert not torn.exists() and not unnamed.exists() and not passing.exists()
    assert held(warehouse, ingests_of(warehouse, first)) == []
    assert logs.current(warehouse) == [second]


def readings_files(warehouse: Warehouse, row: LogRow) -> list[Path]:
    """Files of the newest version of the readings that hold a log."""
    table = delta.open_table(warehouse, "readings")
    assert table is not None
    paths = [Path(uri.removeprefix("file://")) for uri in table.file_uris()]
    return [path for path in paths if row.ingest_id in set(pl.read_parquet(path)["ingest_id"])]
