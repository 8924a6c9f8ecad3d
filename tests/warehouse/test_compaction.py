"""Compacting and vacuuming: the past that counts stays, what nobody refers to goes."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from datetime import UTC, datetime, tzinfo
from pathlib import Path

import polars as pl
import pytest

from kempf.pipeline.ingest.decoded import LostStretch
from kempf.schemas.errors import KempfError, NotFound
from kempf.schemas.tables import TABLES, arrow_schema
from kempf.warehouse.queries import history
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import vessel_key
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, examinations, logs, parameter_sets, readings, runs, segments
from kempf.warehouse.tables.deposit import deposit
from kempf.warehouse.tables.provenance import collect
from kempf.warehouse.upkeep import compaction
from tests.warehouse.samples import START_NS, delivery, examination, inputs, parameter_set, segment
from tests.warehouse.samples import readings as readings_of


def content(warehouse: Warehouse, versions: dict[str, int] | None = None) -> dict[str, list[str]]:
    """What tables say, at versions or now, whatever the order."""
    at: dict[str, int | None] = dict(versions) if versions is not None else dict.fromkeys(delta.versions(warehouse))
    return {n: sorted(map(repr, delta.read(warehouse, n, version=v).rows())) for n, v in at.items()}


def lived_in(warehouse: Warehouse) -> list[dict[str, int]]:
    """Four rounds of a log, its segment, a set, an alias, a run; return the versions that the sets were made from."""
    pins = []
    for i in range(4):
        (stored,) = deposit(warehouse, [delivery("aurora", f"log {i}".encode())])
        for start in (START_NS, START_NS + 10**9):  # found, then found otherwise: rows of no version that counts
            found = [segment("aurora", stored.log_id, stored.ingest_id, start)]
            segments.replace(warehouse, {("aurora", stored.ingest_id): found})
            examinations.replace(warehouse, [examination("aurora", stored.log_id, stored.ingest_id, f"{start}")])
        asked = inputs(stored.log_id, START_NS + i)
        collected = collect(warehouse, asked, [stored.ingest_id])
        made = parameter_set("aurora", asked, provenance=collected)
        parameter_sets.insert(warehouse, [made])
        aliases.point(warehouse, "aurora", made.parameter_set_id)
        runs.record_all(warehouse, [runs.FlowRun("run-1", "reprocess", "aurora", f"round {i}")])
        pins.append(collected["table_versions"])
    return pins


def aged(warehouse: Warehouse) -> None:
    """Let every file look a year old, so that only what the log of commits says can save it."""
    assert warehouse.folder is not None
    then = time.time() - 365 * 86400
    for path in warehouse.folder.rglob("*"):
        if path.is_file():
            os.utime(path, (then, then))


def test_what_a_parameter_set_refers_to_survives(warehouse: Warehouse) -> None:
    pins = lived_in(warehouse)
    now = content(warehouse)
    then = [content(warehouse, at) for at in pins]
    orphan = Path(str(warehouse.folder)) / "readings" / "part-of-nothing.parquet"
    orphan.write_bytes(b"written, never committed")
    half = Path(str(warehouse.folder)) / "raw" / "ab" / ".abcd.0123456789abcdef"
    half.parent.mkdir(exist_ok=True)
    half.write_bytes(b"half of a log")
    compacted = compaction.compact(warehouse, more_files_than=1)
    assert {"logs", "segments", "parameter_sets"} <= set(compacted)
    time.sleep(0.05)
    aged(warehouse)
    said = {one.table: one for one in compaction.vacuum(warehouse, 0.0, dry_run=True)}
    assert orphan.exists() and half.exists()
    done = {one.table: one for one in compaction.vacuum(warehouse, 0.0)}
    assert {n: one.files for n, one in done.items()} == {n: one.files for n, one in said.items()}
    assert done["readings"].files == 1 and done["raw"].files == 1 and done["examinations"].files >= 4
    assert not any(done[name].files for name in compaction.ALWAYS), "any version of these may be asked for"
    assert all(one.size_bytes > 0 for one in done.values() if one.files)
    assert not orphan.exists() and not half.exists()
    assert content(warehouse) == now
    assert [content(warehouse, at) for at in pins] == then
    assert compaction.pinned(warehouse) == {
        name: tuple(sorted({at[name] for at in pins if name in at})) for name in sorted(set().union(*pins))
    }
    again = compaction.vacuum(warehouse, 0.0)
    assert sum(one.files for one in again) == 0, "what was to go has gone"


def test_every_moment_of_the_history_survives(warehouse: Warehouse) -> None:
    moments = [datetime.now(UTC)]
    for i in range(5):
        parameter_sets.insert(warehouse, [parameter_set("aurora", inputs(start_utc_ns=START_NS + i))])
        time.sleep(0.01)
        moments.append(datetime.now(UTC))
    compaction.compact(warehouse, more_files_than=1)
    aged(warehouse)
    compaction.vacuum(warehouse, 0.0)
    known = [
        history.of_vessel(warehouse, "aurora", as_of=moment).frame["parameter_set_id"].n_unique()
        for moment in moments[1:]
    ]
    assert known == [1, 2, 3, 4, 5]


def test_work_that_began_before_keeps_the_versions_it_began_with(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A set names versions that were taken when its work began; compaction and vacuum came before it was stored."""
    for i in range(3):
        (stored,) = deposit(warehouse, [delivery("aurora", f"log {i}".encode())])
        found = [segment("aurora", stored.log_id, stored.ingest_id)]
        segments.replace(warehouse, {("aurora", stored.ingest_id): found})
    time.sleep(0.02)
    began, began_with = datetime.now(UTC), delta.versions(warehouse)
    then = content(warehouse, began_with)
    time.sleep(0.02)
    assert "segments" in compaction.compact(warehouse, more_files_than=1)
    aged(warehouse)

    class AtThatTime(datetime):
        @classmethod
        def now(cls, tz: tzinfo | None = None) -> datetime:
            return began

    monkeypatch.setattr(compaction, "datetime", AtThatTime)  # so that what is kept goes back to when the work began
    compaction.vacuum(warehouse, 0.0)
    asked = inputs(stored.log_id)
    collected = collect(warehouse, asked, [stored.ingest_id], table_versions=began_with)
    parameter_sets.insert(warehouse, [parameter_set("aurora", asked, provenance=collected)])
    assert content(warehouse, began_with) == then


def test_young_files_are_left_to_their_writers(warehouse: Warehouse) -> None:
    lived_in(warehouse)
    young = Path(str(warehouse.folder)) / "logs" / "part-of-a-writer-at-work.parquet"
    young.write_bytes(b"not yet committed")
    done = compaction.vacuum(warehouse)
    assert sum(one.files for one in done) == 0
    assert young.exists()


def test_compaction_keeps_units_rows_and_readers(warehouse: Warehouse) -> None:
    lived_in(warehouse)
    before = content(warehouse)
    assert compaction.compact(warehouse, more_files_than=1)
    assert content(warehouse) == before
    table = delta.open_table(warehouse, "parameter_sets")
    assert table is not None
    (uri,) = table.file_uris()
    import pyarrow.parquet as pq

    wanted = arrow_schema(TABLES["parameter_sets"])
    for field in table.schema().fields:
        assert {k.encode(): v.encode() for k, v in field.metadata.items()} == wanted.field(field.name).metadata
    assert pl.read_parquet(uri).height == 4
    assert pq.read_metadata(uri).row_group(0).column(0).compression == "ZSTD"
    assert len(logs.current(warehouse)) == 4
    assert all(readings.read(warehouse, row.ingest_id).height == 5 for row in logs.current(warehouse))
    assert compaction.compact(warehouse, more_files_than=1) == (), "nothing is left to do"


def test_sets_newer_than_their_tables_stop_it(warehouse: Warehouse) -> None:
    lived_in(warehouse)
    stated = parameter_set(
        "aurora", inputs(settings={"of": "another"}), provenance={"table_versions": {"segments": 99}}
    )
    parameter_sets.insert(warehouse, [stated])
    aged(warehouse)
    before = sorted(p.name for p in Path(str(warehouse.folder)).rglob("*.parquet"))
    with pytest.raises(KempfError) as caught:
        compaction.vacuum(warehouse, 0.0)
    assert caught.value.code == "version_lost"
    after = sorted(p.name for p in Path(str(warehouse.folder)).rglob("*.parquet"))
    assert after == before


def test_nothing_to_compact(warehouse: Warehouse) -> None:
    with pytest.raises(NotFound):
        compaction.vacuum(warehouse)
    warehouse.create()
    assert compaction.compact(warehouse) == ()
    assert [one.table for one in compaction.vacuum(warehouse)] == ["raw"]


def test_lost_stretches_are_put_together_too(warehouse: Warehouse) -> None:
    for i in range(3):
        damaged = replace(readings_of(), lost=(LostStretch(None, START_NS + i, None, "a rotten chunk"),))
        deposit(warehouse, [delivery("aurora", f"log {i}".encode(), readings=damaged)])
    before = content(warehouse)
    assert "lost" in compaction.compact(warehouse, more_files_than=1)
    assert content(warehouse) == before
    table = delta.open_table(warehouse, "lost")
    assert table is not None and len(table.file_uris()) == 1


def folders(warehouse: Warehouse, name: str) -> list[str]:
    """Of the files of a table's newest version, below the table."""
    table = delta.open_table(warehouse, name)
    assert table is not None
    return sorted("/".join(uri.split("/")[-3:-1]) for uri in table.file_uris())


def months_of_logs(warehouse: Warehouse) -> list[str]:
    """Take three logs of May and one of June in; return their ingests."""
    june = readings_of()
    june = replace(june, frame=june.frame.with_columns(pl.col("time_utc_ns") + 30 * 86_400_000_000_000))
    given = [delivery("aurora", f"log {i}".encode()) for i in range(3)]
    return [deposit(warehouse, [one])[0].ingest_id for one in (*given, delivery("aurora", b"june", readings=june))]


def test_readings_become_one_file_a_vessel_and_month(warehouse: Warehouse) -> None:
    ingests = months_of_logs(warehouse)
    before, key = content(warehouse), vessel_key("aurora")
    may, june = f"vessel_key={key}/month=2025-05", f"vessel_key={key}/month=2025-06"
    assert folders(warehouse, "readings") == [may, may, may, june]
    assert "readings" in compaction.compact(warehouse, more_files_than=1)
    assert folders(warehouse, "readings") == [may, june]
    assert content(warehouse) == before
    assert [readings.read(warehouse, name).height for name in ingests] == [5] * 4
    # the next log of the month is a file of its own beside it, until the next compaction
    (again,) = deposit(warehouse, [delivery("aurora", b"one more")])
    assert folders(warehouse, "readings") == [may, may, june]
    assert readings.read(warehouse, again.ingest_id).height == 5
    assert [readings.read(warehouse, name).height for name in ingests] == [5] * 4
