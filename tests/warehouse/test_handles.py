"""Open tables that are lent: the newest version, one thread at a time, and never those of a table that is gone."""

from __future__ import annotations

from pathlib import Path
from shutil import rmtree
from threading import Barrier, Thread
from typing import Any

import pytest

from warehouse import delta, runs
from warehouse.store import Warehouse


def record(warehouse: Warehouse, name: str, status: str = "done") -> None:
    runs.record(warehouse, runs.Run(name, "test", None, status))


def names(warehouse: Warehouse) -> list[str]:
    return [run.run_id for run in runs.all_runs(warehouse)]


def test_a_read_sees_what_others_committed_and_opens_once(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    record(warehouse, "a")
    assert names(warehouse) == ["a"]
    other = Warehouse(warehouse.uri)
    with monkeypatch.context() as patched:
        patched.setattr(delta, "open_table", lambda *_: pytest.fail("opened anew"))
        for name in "bcd":
            record(other, name)
            assert names(warehouse)[-1] == name
    assert delta.versions(warehouse) == {"runs": 4}


def test_a_table_made_anew_at_the_same_place_is_another(warehouse: Warehouse) -> None:
    record(warehouse, "old")
    record(warehouse, "older")
    assert names(warehouse) == ["old", "older"]
    assert warehouse.folder is not None
    rmtree(warehouse.folder)
    record(Warehouse(warehouse.uri), "new")
    assert names(warehouse) == ["new"] and delta.versions(warehouse) == {"runs": 1}


def test_two_threads_never_share_one(warehouse: Warehouse) -> None:
    record(warehouse, "a")
    seen: list[Any] = []
    both = Barrier(2)

    def hold() -> None:
        with delta.writing(warehouse, "runs") as table:
            seen.append(table)
            both.wait(timeout=60)

    threads = [Thread(target=hold) for _ in range(2)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert len({id(table) for table in seen}) == 2


def test_a_lost_race_is_noticed_by_a_handle_that_was_lent_before(warehouse: Warehouse, tmp_path: Path) -> None:
    from deltalake.exceptions import CommitFailedError

    record(warehouse, "a", "first")
    with pytest.raises(CommitFailedError), delta.writing(warehouse, "runs") as table:
        rows = delta.rows(table, "runs").rows(named=True)
        record(Warehouse(warehouse.uri), "a", "second")
        delta.replace(table, "runs", rows, "run_id = 'a'")
    assert [run.status for run in runs.all_runs(warehouse)] == ["second"]
