from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import polars as pl
import pyarrow.parquet as pq
import pytest
from polars.testing import assert_frame_equal

from kempf.pipeline.ingest.readings import READING_SCHEMA, REJECTED_SCHEMA
from kempf.schemas.channels import CHANNELS
from kempf.schemas.errors import DataRejected, NotFound
from kempf.schemas.tables import TABLES
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import ingest_id
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, raw, readings, vessels
from kempf.warehouse.tables.deposit import deposit, held
from tests.warehouse.samples import CODE, delivery, raw_bytes
from tests.warehouse.samples import readings as some_readings


def everything(warehouse: Warehouse) -> dict[str, int]:
    """Size and change time of every file, to show that nothing was touched."""
    assert warehouse.folder is not None
    return {str(p): p.stat().st_mtime_ns for p in sorted(warehouse.folder.rglob("*")) if p.is_file()}


def test_what_went_in_comes_out(warehouse: Warehouse) -> None:
    given = delivery()
    (done,) = deposit(warehouse, [given])
    assert done.outcome == "new"
    assert done.ingest_id == ingest_id(done.log_id, given.profile.sha256, CODE)
    assert_frame_equal(readings.read(warehouse, done.ingest_id), given.readings.frame)
    assert math.copysign(1.0, readings.read(warehouse, done.ingest_id)["yaw_rate_rad_s"][0]) == -1.0
    assert_frame_equal(readings.read_rejected(warehouse, done.ingest_id), given.readings.rejected.sort("record"))
    (row,) = logs.current(warehouse)
    assert (row.vessel, row.file_name, row.format, row.size_bytes) == ("aurora", "day1.nmea.gz", "nmea", 7)
    assert row.tally == given.readings.tally
    assert row.notes == ("one note",)
    assert row.end_utc_ns - row.start_utc_ns == 2_000_000_000
    assert raw_bytes(warehouse, row.log_id) == b"log one"
    assert vessels.current(warehouse, "aurora") == given.profile


def test_the_same_again_changes_nothing_anywhere(warehouse: Warehouse) -> None:
    deposit(warehouse, [delivery()])
    before = everything(warehouse)
    (again,) = deposit(warehouse, [delivery()])
    assert again.outcome == "unchanged"
    assert everything(warehouse) == before


def test_asking_first_saves_the_reading(warehouse: Warehouse) -> None:
    given = delivery()
    asked = ("aurora", "day1.nmea.gz", given.log)
    key = {"profile_sha256": given.profile.sha256, "code_version": CODE}
    assert held(warehouse, *asked, None, **key) is None  # not even a warehouse
    (done,) = deposit(warehouse, [given])
    row = logs.find(warehouse, [done.log_id])[done.log_id]
    found = held(warehouse, *asked, row, **key)
    assert found is not None
    assert (found.ingest_id, found.outcome) == (done.ingest_id, "unchanged")
    assert held(warehouse, *asked, row, profile_sha256="other", code_version=CODE) is None


def test_a_changed_profile_is_a_new_ingest_and_back_again(warehouse: Warehouse) -> None:
    (first,) = deposit(warehouse, [delivery()])
    (second,) = deposit(warehouse, [delivery(length_m=60.0, readings=some_readings(shift=1.0))])
    assert second.outcome == "reread"
    assert second.log_id == first.log_id
    assert [row.ingest_id for row in logs.current(warehouse)] == [second.ingest_id]
    assert [row.revision for row in logs.all_ingests(warehouse)] == [1, 2]
    assert readings.read(warehouse, first.ingest_id)["heading_rad"][0] == 0.0  # the old one stays readable
    assert readings.read(warehouse, second.ingest_id)["heading_rad"][0] == 1.0
    (third,) = deposit(warehouse, [delivery()])
    assert third.outcome == "reread"
    assert [row.ingest_id for row in logs.current(warehouse)] == [first.ingest_id]
    assert readings.read(warehouse, first.ingest_id).height == 5


def test_the_bytes_of_another_vessel_are_refused(warehouse: Warehouse) -> None:
    deposit(warehouse, [delivery("aurora")])
    before = everything(warehouse)
    with pytest.raises(DataRejected) as caught:
        deposit(warehouse, [delivery("O'Brien", file_name="copy.nmea")])
    assert caught.value.code == "log_of_another_vessel"
    assert "aurora" in caught.value.next_step
    assert caught.value.details["claimed_for"] == "O'Brien"
    assert everything(warehouse) == before
    with pytest.raises(DataRejected):
        deposit(warehouse, [delivery("a", b"two"), delivery("b", b"two")])
    assert everything(warehouse) == before


def test_a_batch_is_one_commit_a_table(warehouse: Warehouse) -> None:
    batch = [delivery(f"v{i % 2}", f"log {i}".encode()) for i in range(6)]
    done = deposit(warehouse, [*batch, batch[0]])
    assert [one.outcome for one in done] == ["new"] * 6 + ["unchanged"]
    assert delta.versions(warehouse) == {"vessels": 1, "logs": 1, "readings": 1, "rejected": 1}
    assert len(logs.current(warehouse)) == 6
    for one in done:
        assert readings.read(warehouse, one.ingest_id).height == 5
    assert deposit(warehouse, []) == []


def test_one_log_read_in_two_ways_is_no_batch(warehouse: Warehouse) -> None:
    with pytest.raises(ValueError, match="two profiles"):
        deposit(warehouse, [delivery(), delivery(length_m=1.0)])
    with pytest.raises(ValueError, match="no reading"):
        deposit(warehouse, [delivery(readings=some_readings(n=0))])
    assert not warehouse.exists()


STEPS = ["raw.put", "vessels.register_all", "readings.write", "readings.write_rejected", "logs.record"]


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("when", ["before", "after"])
def test_a_crash_between_the_steps_leaves_one_copy(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch, step: str, when: str
) -> None:
    module, _, name = step.partition(".")
    target = {"raw": raw, "vessels": vessels, "readings": readings, "logs": logs}[module]
    real = getattr(target, name)

    def crash(*arguments):
        if when == "after":
            real(*arguments)
        raise KeyboardInterrupt

    given = [delivery(data=b"one"), delivery(data=b"two")]
    with monkeypatch.context() as patch:
        patch.setattr(target, name, crash)
        with pytest.raises(KeyboardInterrupt):
            deposit(warehouse, given)
    if warehouse.exists():
        whole = step == "logs.record" and when == "after"
        assert len(logs.current(warehouse)) == (2 if whole else 0)  # never half in
    done = deposit(warehouse, given)
    assert len(logs.all_ingests(warehouse)) == 2
    assert [v.revision for v in vessels.versions(warehouse, "aurora")] == [1]
    assert delta.read(warehouse, "readings").height == 10
    assert delta.read(warehouse, "rejected").height == 4
    for one in done:
        assert_frame_equal(readings.read(warehouse, one.ingest_id), given[0].readings.frame)


def test_a_damaged_raw_copy_is_mended_by_the_same_deposit(warehouse: Warehouse) -> None:
    (done,) = deposit(warehouse, [delivery()])
    assert warehouse.folder is not None
    (warehouse.folder / "raw" / done.log_id[:2] / done.log_id).write_bytes(b"rot")
    assert deposit(warehouse, [delivery()])[0].outcome == "unchanged"
    assert raw_bytes(warehouse, done.log_id) == b"log one"


def test_readings_that_no_row_stands_for_are_not_found(warehouse: Warehouse) -> None:
    other = Warehouse(f"{warehouse.uri} of another")
    (done,) = deposit(other, [delivery()])
    readings.write(warehouse, [(replace(logs.of_ingest(other, done.ingest_id), ingest_id="abc"), some_readings())])
    for read in (readings.read, readings.read_rejected):
        with pytest.raises(NotFound) as caught:
            read(warehouse, "abc' OR '1'='1")
        assert caught.value.code == "no_ingest"


def test_units_stand_in_plain_parquet(warehouse: Warehouse) -> None:
    deposit(warehouse, [delivery()])
    deposit(warehouse, [delivery(length_m=60.0)])
    assert warehouse.folder is not None
    for table in ("readings", "rejected", "logs", "vessels"):
        files = sorted((warehouse.folder / table).rglob("*.parquet"))
        assert len(files) == 2
        for path in files:
            schema = pq.ParquetFile(path).schema_arrow
            for column in TABLES[table].columns:
                if column.name in TABLES[table].partition_by:
                    continue
                metadata = schema.field(column.name).metadata
                assert metadata.get(b"unit", b"").decode() == column.unit
                assert metadata[b"description"].decode() == column.words


def test_the_tables_have_the_columns_of_the_readers() -> None:
    names = [column.name for column in TABLES["readings"].columns]
    assert names == ["vessel_key", "vessel", "ingest_id", "month", *READING_SCHEMA]
    assert [c.unit for c in TABLES["readings"].columns][-len(CHANNELS) :] == [c.unit for c in CHANNELS.values()]
    assert [c.name for c in TABLES["rejected"].columns] == [
        "vessel_key",
        "vessel",
        "ingest_id",
        "month",
        *REJECTED_SCHEMA,
    ]


def test_a_large_log_keeps_its_order(warehouse: Warehouse) -> None:
    n = 200_000
    frame = some_readings(1).frame
    large = frame[[0] * n].with_columns(
        pl.int_range(n).alias("record"), (pl.int_range(n) * 100_000_000).alias("time_utc_ns")
    )
    given = some_readings()
    (done,) = deposit(warehouse, [delivery(readings=type(given)(large, given.rejected, given.tally))])
    assert_frame_equal(readings.read(warehouse, done.ingest_id), large)


def test_a_file_name_that_is_no_text_is_kept_readable(warehouse: Warehouse, tmp_path: Path) -> None:
    deposit(warehouse, [delivery(file_name="day\udcff1.csv")])
    assert logs.current(warehouse)[0].file_name == "day?1.csv"
