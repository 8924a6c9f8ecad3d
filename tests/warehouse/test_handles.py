"""Tables kept open: the newest version, one thread at a time, and never those of another folder."""

from __future__ import annotations

import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier, Thread
from typing import Any

import pytest

from kempf.warehouse.storage import delta, table_cache
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import runs

ROOT = Path(__file__).parents[2]


def put(warehouse: Warehouse, status: str, name: str = "run-1") -> None:
    runs.record_all(warehouse, [runs.FlowRun(name, "ingest", None, status)])


def stands(warehouse: Warehouse) -> dict[str, str]:
    return {run.run_id: run.status for run in runs.all_runs(warehouse)}


def test_a_handle_is_used_again(warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch) -> None:
    put(warehouse, "one")
    assert stands(warehouse) == {"run-1": "one"}
    other = Warehouse(warehouse.uri)
    with monkeypatch.context() as patched:
        patched.setattr(delta, "open_table", lambda *_: pytest.fail("opened anew"))
        assert stands(warehouse) == {"run-1": "one"}
        for status in ("two", "three", "four"):
            put(other, status)
            assert stands(warehouse) == {"run-1": status}
    assert delta.versions(warehouse) == {"runs": 4}


def test_what_another_process_wrote_is_seen(warehouse: Warehouse) -> None:
    put(warehouse, "one")
    assert stands(warehouse) == {"run-1": "one"}
    code = (
        "from kempf.warehouse.tables import runs; from kempf.warehouse.storage.store import Warehouse\n"
        f"runs.record_all(Warehouse({warehouse.uri!r}), [runs.FlowRun('run-1', 'ingest', None, 'two')])"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT, timeout=60)
    assert stands(warehouse) == {"run-1": "two"}


def test_a_folder_that_was_replaced_is_opened_anew(warehouse: Warehouse, tmp_path: Path) -> None:
    assert warehouse.folder is not None
    put(warehouse, "one")
    early = Path(shutil.copytree(warehouse.folder, tmp_path / "early"))
    put(warehouse, "two")
    late = Path(shutil.copytree(warehouse.folder, tmp_path / "late"))
    assert stands(warehouse) == {"run-1": "two"}
    for copy, status in ((early, "one"), (late, "two")):
        shutil.rmtree(warehouse.folder)
        shutil.copytree(copy, warehouse.folder)
        assert stands(warehouse) == {"run-1": status}
    shutil.rmtree(warehouse.folder)
    warehouse.create()
    assert stands(warehouse) == {}


def test_a_table_made_anew_at_the_same_place_is_another(warehouse: Warehouse) -> None:
    put(warehouse, "done", "old")
    put(warehouse, "done", "older")
    assert stands(warehouse) == {"old": "done", "older": "done"}
    assert warehouse.folder is not None
    shutil.rmtree(warehouse.folder)
    put(Warehouse(warehouse.uri), "done", "new")
    assert stands(warehouse) == {"new": "done"} and delta.versions(warehouse) == {"runs": 1}


def test_nobody_shares_a_handle(warehouse: Warehouse) -> None:
    put(warehouse, "one")
    with delta.reading(warehouse, "runs") as first, delta.reading(warehouse, "runs") as second:
        assert first is not second
        assert first is not None and second is not None
        put(warehouse, "two")
        with delta.reading(warehouse, "runs") as third:
            assert third is not None
            assert third.version() == first.version() + 1 == second.version() + 1


def test_two_threads_never_share_one(warehouse: Warehouse) -> None:
    put(warehouse, "one")
    seen: list[Any] = []
    both = Barrier(2)

    def hold() -> None:
        with delta.ensured(warehouse, "runs") as table:
            seen.append(table)
            both.wait(timeout=60)

    threads = [Thread(target=hold) for _ in range(2)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert len({id(table) for table in seen}) == 2


def test_one_over_which_something_went_wrong_is_not_kept(warehouse: Warehouse) -> None:
    put(warehouse, "one")
    with delta.reading(warehouse, "runs") as held:
        pass
    with pytest.raises(ZeroDivisionError), delta.reading(warehouse, "runs") as bad:
        raise ZeroDivisionError
    assert bad is held, "it was the one that was kept"
    with delta.reading(warehouse, "runs") as next_one:
        assert next_one is not bad


def test_a_lost_race_is_noticed_by_a_handle_that_was_lent_before(warehouse: Warehouse) -> None:
    from deltalake.exceptions import CommitFailedError

    put(warehouse, "first")
    with pytest.raises(CommitFailedError), delta.ensured(warehouse, "runs") as table:
        rows = delta.rows(table, "runs").rows(named=True)
        put(Warehouse(warehouse.uri), "second")
        delta.replace(table, "runs", rows, "run_id = 'run-1'")
    assert stands(warehouse) == {"run-1": "second"}
    with delta.ensured(warehouse, "runs") as again:
        assert again is table, "the next attempt has the same one, brought up to date"
        assert [row["status"] for row in delta.rows(again, "runs").rows(named=True)] == ["second"]


def test_many_threads_lose_nothing(warehouse: Warehouse) -> None:
    put(warehouse, "one")
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda i: put(warehouse, "done", f"run-{i}"), range(2, 14)))
        seen = list(pool.map(lambda _: len(stands(warehouse)), range(8)))
    assert seen == [13] * 8
    assert len(table_cache._kept) <= table_cache.MOST


def test_a_handle_that_saw_many_commits_is_opened_anew(warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = []
    real = delta.open_table

    def counted(place: Warehouse, name: str, version: int | None = None) -> Any:
        opened.append(name)
        return real(place, name, version)

    monkeypatch.setattr(delta, "open_table", counted)
    monkeypatch.setattr(table_cache, "MOST_COMMITS", 3)
    put(warehouse, "0")
    opened.clear()
    for k in range(1, 9):
        put(warehouse, str(k))
        assert stands(warehouse) == {"run-1": str(k)}
    assert 2 <= len(opened) <= 3
