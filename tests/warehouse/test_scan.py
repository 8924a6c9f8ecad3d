"""Files that are left out by their statistics hold no row that was asked for, whatever the text."""

from __future__ import annotations

from typing import Any

import pytest
from deltalake import DeltaTable

from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import runs
from kempf.warehouse.upkeep import compaction

ODD = (
    *("o'brien", 'a"b', "ø", "100%", "%41", "a/b", "a\\b", "", " lead", "a\nb", "'; --", "$1", "{x}", "a\x00", "\x00a"),
    *("x" * n for n in (63, 64, 65, 100)),  # statistics hold 64 bytes
    *("é" * 33, "ÿ" * 70, "\U0010ffff" * 30, "null", "NULL", "2021-01-01", "12", "1e5", "true"),
)


def test_every_text_is_found_by_itself(warehouse: Warehouse) -> None:
    every = [runs.FlowRun(f"run-{i}", text, None if i % 2 else text, "done") for i, text in enumerate(ODD)]
    runs.record_all(warehouse, every[::3])  # some share a file, some have one alone
    for one in (*every[1::3], *every[2::3]):
        runs.record_all(warehouse, [one])
    for _ in range(2):
        for one in every:
            assert runs.all_runs(warehouse, one.flow) == [one]
            ships = delta.read(warehouse, "runs", {"vessel": one.flow})["run_id"].to_list()
            assert ships == ([one.run_id] if one.vessel is not None else [])
        compaction.compact(warehouse, more_files_than=1)


def test_which_files_answer_is_asked_once_a_version(warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    real = DeltaTable.file_uris

    def counted(table: DeltaTable, *given: Any, **named: Any) -> list[str]:
        asked.append(table.version())
        return real(table, *given, **named)

    monkeypatch.setattr(DeltaTable, "file_uris", counted)
    runs.record_all(warehouse, [runs.FlowRun("run-1", "ingest", None, "done")])
    for _ in range(3):
        assert [run.run_id for run in runs.all_runs(warehouse, "ingest")] == ["run-1"]
    once = len(asked)
    assert once == len(set(asked))
    runs.record_all(warehouse, [runs.FlowRun("run-2", "ingest", None, "done")])
    assert [run.run_id for run in runs.all_runs(warehouse, "ingest")] == ["run-1", "run-2"]
    assert len(asked) > once
