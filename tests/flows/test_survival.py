"""A full disk, two processes at once, a signal at any moment: one clear error or one result, and nothing half."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from tests.flows.content import fresh, seen
from tests.workbench.driving import kempf

ROOT = Path(__file__).parents[2]
INGESTED = ("vessels", "logs", "readings", "rejected", "segments", "raw")


@pytest.fixture(scope="module")
def one_log(harbour: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What the tables say after one undisturbed ingest of one log."""
    warehouse = fresh(tmp_path_factory.mktemp("one") / "w")
    profile = VesselProfile.model_validate(yaml.safe_load((harbour / "profile.yaml").read_text()))
    assert [o.error for o in ingest(warehouse, [harbour / "mariner.csv.gz"], given=profile)] == [None]
    content = seen(warehouse)
    return {name: content[name] for name in INGESTED}


def asked(harbour: Path, place: Path) -> tuple[object, ...]:
    return ("ingest", harbour / "mariner.csv.gz", "--profile", harbour / "profile.yaml", "--warehouse", place, "--json")


def held(warehouse: Warehouse) -> dict[str, Any]:
    content = seen(warehouse)
    return {name: content[name] for name in INGESTED}


class Disk:
    """A small disk of its own that can be made larger."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def size(self, kilobytes: int, how: str) -> bool:
        options = f"{how}size={kilobytes}k"
        command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(self.folder)]
        return subprocess.run(command, capture_output=True, check=False, timeout=20).returncode == 0


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Disk]:
    folder = tmp_path / "disk"
    folder.mkdir()
    one = Disk(folder)
    if sys.platform != "linux" or os.geteuid() != 0 or not one.size(40, ""):
        pytest.skip("a small disk can be mounted by root on Linux alone")
    try:
        yield one
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True, timeout=20)


def test_a_full_disk_is_one_clear_error_and_costs_nothing(harbour: Path, disk: Disk, one_log: dict[str, Any]):
    place, stated = disk.folder / "w", []
    for kilobytes in (40, 70, 110, 150, 200, 240):  # the write that finds no room is another each time
        assert disk.size(kilobytes, "remount,")
        ran = kempf(*asked(harbour, place))
        if ran.code == 0:
            break
        stated.append(kilobytes)
        error = ran.json["error"]
        assert (ran.code, error["code"]) == (1, "disk_full"), ran
        assert str(place) in error["message"] and "\x1b" not in error["message"]
        assert f"{error['details']['free_bytes']} bytes are free" in error["message"]
        assert error["details"]["free_bytes"] < 1024 * kilobytes
        assert "Traceback" not in ran.err
        assert not (place / "logs").exists() or seen(fresh(place))["logs"] == []
    assert len(stated) >= 3, stated
    assert disk.size(20_000, "remount,")
    assert kempf(*asked(harbour, place)).code == 0
    assert held(fresh(place)) == one_log


def begun(harbour: Path, place: Path) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-c", "from kempf.workbench.cli import main; main()", *map(str, asked(harbour, place))]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment)


def test_two_processes_with_one_log_leave_one(harbour: Path, tmp_path: Path, one_log: dict[str, Any]):
    both = [begun(harbour, tmp_path / "w") for _ in range(2)]
    said = [(p.communicate(timeout=400), p.returncode) for p in both]
    assert [code for _, code in said] == [0, 0], said
    outcomes = [json.loads(out)[0]["outcome"] for (out, _), _ in said]
    assert sorted(outcomes) == ["new", "unchanged"]
    warehouse = fresh(tmp_path / "w")
    assert held(warehouse) == one_log
    assert {n: delta.read(warehouse, n).height for n in INGESTED[:-1]} == {n: len(one_log[n]) for n in INGESTED[:-1]}


@pytest.mark.skipif(os.name != "posix", reason="signals are sent as POSIX has them")
def test_a_signal_at_any_moment_leaves_what_the_next_run_completes(
    harbour: Path, tmp_path: Path, one_log: dict[str, Any]
):
    """The moment is that of a write, in a process that sends the signal to itself: some of the writes in their turn."""
    moments = [(2, int(signal.SIGTERM)), (4, int(signal.SIGINT)), (6, int(signal.SIGTERM)), (8, int(signal.SIGINT))]
    code = (
        "import os, sys\n"
        "import deltalake, polars, pyarrow.fs, kempf.flows.jobs.ingest.ingest_logs, kempf.workbench.cli.ingest\n"
        "from kempf.warehouse.storage import delta\n"
        "from kempf.warehouse.storage.store import Warehouse\n"
        "from kempf.workbench.cli import main\n"
        "left = [0]\n"
        "def dying(write):\n"
        "    def wrapped(*arguments, **named):\n"
        "        left[0] -= 1\n"
        "        if left[0] == 0:\n"
        "            os.kill(os.getpid(), sent)\n"
        "        return write(*arguments, **named)\n"
        "    return wrapped\n"
        "delta.replace = dying(delta.replace)\n"
        "Warehouse.write = dying(Warehouse.write)\n"
        f"for (number, sent), place in zip({moments}, sys.argv[2:]):\n"
        "    pid = os.fork()\n"
        "    if pid == 0:\n"
        "        left[0] = number\n"
        "        main([*sys.argv[1].split('|'), '--warehouse', place])\n"
        "    print(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), flush=True)\n"
    )
    places = [tmp_path / f"w{number}" for number in range(4)]
    ours = "|".join(map(str, asked(harbour, tmp_path)[:4]))
    command = [sys.executable, "-c", code, ours, *map(str, places)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, capture_output=True, text=True, timeout=400, env=environment, check=True)
    codes = [int(line) for line in done.stdout.splitlines() if line.lstrip("-").isdigit()]
    assert codes == [130 if sent == signal.SIGINT else 143 for _, sent in moments], done.stderr
    assert done.stderr.count("the same command goes on") == 4
    for place in places:
        warehouse = fresh(place)
        if warehouse.exists():
            assert len(seen(warehouse)["logs"]) <= 1
        assert kempf(*asked(harbour, place)).code == 0
        assert held(warehouse) == one_log
