"""Interrupted at any write, or killed: nothing half is seen, and the next run ends where an undisturbed one does."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest
import yaml

from kempf.flows.jobs.identify.identify_vessel import identify_vessel
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, segments
from tests.flows.content import fresh, seen

ROOT = Path(__file__).parents[2]


class Killed(BaseException):
    """Stands for the end of the process: nothing in the house catches it."""


def profile(harbour: Path) -> VesselProfile:
    return VesselProfile.model_validate(yaml.safe_load((harbour / "profile.yaml").read_text()))


def take_in(warehouse: Warehouse, harbour: Path) -> None:
    outcomes = ingest(warehouse, [harbour / f"mariner.{end}" for end in ("nmea.gz", "csv.gz")], given=profile(harbour))
    assert [o.error for o in outcomes] == [None, None]


@pytest.fixture(scope="module")
def _taken(harbour: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("taken") / "w"
    take_in(fresh(place), harbour)
    return place


@pytest.fixture
def taken(_taken: Path, tmp_path: Path) -> Warehouse:
    """A copy of a warehouse with both logs."""
    return fresh(copytree(_taken, tmp_path / "w"))


@pytest.fixture(scope="module")
def undisturbed(_taken: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    warehouse = fresh(copytree(_taken, tmp_path_factory.mktemp("undisturbed") / "w"))
    identify_vessel(warehouse, "mariner")
    content = seen(warehouse)
    assert [len(content[name]) for name in ("logs", "segments", "parameter_sets", "aliases")] == [2, 2, 2, 1]
    return content


@pytest.fixture
def at_write(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Die right before the so-many-th write to the warehouse, which is right after the one before it; 0 for never."""
    left = [0]

    def dying(write: Callable[..., Any]) -> Callable[..., Any]:
        def wrapped(*arguments: Any, **named: Any) -> Any:
            left[0] -= 1
            if left[0] == 0:
                raise Killed
            return write(*arguments, **named)

        return wrapped

    monkeypatch.setattr(delta, "replace", dying(delta.replace))
    monkeypatch.setattr(delta, "ensured", dying(delta.ensured))
    monkeypatch.setattr(Warehouse, "write", dying(Warehouse.write))
    return lambda number: left.__setitem__(0, number)


def whole(warehouse: Warehouse) -> None:
    """Every log that counts has its readings, its refusals, its raw bytes and its zigzag."""
    if not warehouse.exists():
        return
    content = seen(warehouse)
    for row in content["logs"]:
        ours = [r for r in content["readings"] if r["ingest_id"] == row["ingest_id"]]
        assert len(ours) == row["records_kept"]
        refused = [r for r in content["rejected"] if r["ingest_id"] == row["ingest_id"]]
        assert len(refused) == row["records_rejected"] + row["values_rejected"]
        assert {"name": row["log_id"], "size": row["size_bytes"]} in content["raw"]
    assert len(segments.current(warehouse)) == len(content["logs"]) == len(logs.current(warehouse))


@pytest.mark.parametrize("number", range(1, 16))
def test_ingest_may_die_at_any_write(
    harbour: Path,
    tmp_path: Path,
    undisturbed: dict[str, Any],
    at_write: Callable[[int], None],
    number: int,
):
    warehouse = fresh(tmp_path / "w")
    at_write(number)
    with pytest.raises(Killed):
        take_in(warehouse, harbour)
    at_write(0)
    whole(warehouse)
    take_in(warehouse, harbour)
    content = seen(warehouse)
    ingested = ("vessels", "logs", "readings", "rejected", "lost", "examinations", "segments", "raw")
    assert {name: content[name] for name in ingested} == {name: undisturbed[name] for name in ingested}


@pytest.mark.parametrize("number", range(1, 5))
def test_identify_may_die_at_any_write(
    taken: Warehouse, undisturbed: dict[str, Any], at_write: Callable[[int], None], number: int
):
    at_write(number)
    with pytest.raises(Killed):
        identify_vessel(taken, "mariner")
    at_write(0)
    assert all(one["parameters"] for one in seen(taken)["parameter_sets"])
    identify_vessel(taken, "mariner")
    assert seen(taken) == undisturbed


def start(*arguments: object) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-c", "from kempf.workbench.cli import main; main()", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


def wait_for(process: subprocess.Popen[bytes], reached: Callable[[], bool]) -> None:
    until = time.monotonic() + 60
    while not reached() and process.poll() is None and time.monotonic() < until:
        time.sleep(0.001)


@pytest.mark.skipif(os.name != "posix", reason="signals are sent as POSIX has them")
def test_a_process_killed_while_it_takes_logs_in(harbour: Path, tmp_path: Path, undisturbed: dict[str, Any]):
    """Killed from outside, between two writes or in the middle of one; test_survival.py sends what can be caught."""
    warehouse = fresh(tmp_path / "w")
    paths = [harbour / f"mariner.{end}" for end in ("nmea.gz", "csv.gz")]
    process = start("ingest", *paths, "--profile", harbour / "profile.yaml", "--warehouse", tmp_path / "w")
    wait_for(process, (tmp_path / "w" / "segments").is_dir)
    process.kill()
    process.communicate(timeout=60)
    assert process.returncode in (-signal.SIGKILL, 0)  # it may have been faster
    whole(warehouse)
    take_in(warehouse, harbour)
    identify_vessel(warehouse, "mariner")
    assert seen(warehouse) == undisturbed


@pytest.mark.skipif(os.name != "posix", reason="signals are sent as POSIX has them")
def test_a_process_killed_while_it_identifies(tmp_path: Path, taken: Warehouse, undisturbed: dict[str, Any]):
    asked = ("identify", "--vessel", "mariner", "--warehouse", tmp_path / "w")
    process = start(*asked)
    wait_for(process, (tmp_path / "w" / "parameter_sets").is_dir)
    process.kill()
    process.communicate(timeout=60)
    assert process.returncode in (-signal.SIGKILL, 0)
    identify_vessel(taken, "mariner")
    assert seen(taken) == undisturbed
