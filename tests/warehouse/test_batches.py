"""Rows on their way into a table: in small batches, all of them, in their order."""

from __future__ import annotations

import os
from pathlib import Path

import polars as pl
import pyarrow as pa
import pytest

from kempf.flows.process.release_memory import give_back
from kempf.schemas.tables import TABLES, arrow_schema
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse

ROWS = 40_000


def rows(first: int) -> pl.DataFrame:
    """Rows of `rejected` with running numbers."""
    empty = {c.name: pl.Series(["x"] * ROWS) for c in TABLES["rejected"].columns if c.kind == "text"}
    number = pl.Series(range(first, first + ROWS))
    return pl.DataFrame({**empty, "record": number, "time_utc_ns": number})


def test_a_large_frame_is_handed_on_in_small_batches() -> None:
    schema = arrow_schema(TABLES["rejected"])
    batches = list(delta.batches(iter([rows(0), rows(ROWS)]), schema))
    assert max(batch.num_rows for batch in batches) <= 16_384
    assert [n for batch in batches for n in batch.column("record").to_pylist()] == list(range(2 * ROWS))
    assert all(batch.schema.equals(schema) for batch in batches)


def test_every_row_arrives_in_one_commit(tmp_path: Path) -> None:
    warehouse = Warehouse(str(tmp_path / "w"))
    with delta.ensured(warehouse, "rejected") as table:
        before = table.version()
        delta.replace(table, "rejected", iter([rows(0), rows(ROWS)]), "vessel_key = 'x' AND ingest_id = 'x'")
        assert table.version() == before + 1
    found = delta.read(warehouse, "rejected", columns=["record"])["record"].sort()
    assert found.to_list() == list(range(2 * ROWS))


def test_one_thread_moves_rows_on() -> None:
    assert os.environ["TOKIO_WORKER_THREADS"]


def test_memory_is_given_back_behind_long_logs_only(monkeypatch: pytest.MonkeyPatch) -> None:
    pool, asked = pa.default_memory_pool(), []

    def stated() -> pa.MemoryPool:
        asked.append(True)
        return pool

    monkeypatch.setattr(pa, "default_memory_pool", stated)
    give_back(10_000)
    assert not asked
    give_back(1 << 20)
    assert asked
