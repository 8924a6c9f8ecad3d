"""Ten nights of a small fleet on a real Prefect server: what the operator reads each morning.

``python -m benchmarks.fleet.ten_nights``. Logs arrive, a folder has a slip of the hand in its name, a log is damaged, a
machine is switched off in the middle of a run, the code gets a remark, a zigzag is excluded and taken in again. Every
night the deployments ``ingest/inbox`` and ``reprocess/nightly`` run on a worker, as docs/fleet.md has it.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import yaml

from benchmarks.result_page import table, write
from tests.scale.conftest import Server, prefect_server
from tests.scale.servers import ROOT, environment, receiver, running, wait_for

ROOMS = ("schemas", "pipeline", "warehouse", "flows", "workbench", "kempf")
FILES = ("prefect.yaml", "quality.yaml", "pyproject.toml")
_DAY_NS = 86_400_000_000_000
_KEMPF = [sys.executable, "-c", "from kempf.workbench.cli import main; main()"]
#: a run says that it lives as often as Prefect allows, and is given up after two of these
_HEARTBEAT_S, _SILENT_S = 30, 75


@dataclass
class Night:
    """One night: what happened by day, what each deployment ended as, what was posted, what the operator then did."""

    by_day: str
    ended: list[tuple[str, str, str]] = field(default_factory=list)
    posted: list[str] = field(default_factory=list)
    morning: list[str] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Harbour:
    """Everything that runs, and where it is."""

    folder: Path
    env: dict[str, str]
    received: list[dict[str, Any]]

    @property
    def source(self) -> Path:
        """The copy of the source that is deployed."""
        return self.folder / "source"

    @property
    def inbox(self) -> Path:
        """Where logs arrive."""
        return self.folder / "inbox"

    def kempf(self, *arguments: str) -> str:
        """Run a command of Kempf; return what it prints, its errors behind."""
        done = subprocess.run(
            [*_KEMPF, *arguments], env=self.env, cwd=self.source, capture_output=True, text=True, check=False
        )
        return (done.stdout + done.stderr).replace(str(self.folder), "")

    def prefect(self, *arguments: str) -> None:
        """Run a command of Prefect."""
        subprocess.run(["prefect", *arguments], env=self.env, cwd=self.source, capture_output=True, check=False)

    @contextmanager
    def worker(self) -> Iterator[subprocess.Popen[bytes]]:
        """Let a worker run, in a process group of its own."""
        command = ["prefect", "worker", "start", "--pool", "kempf"]
        with running(command, self.env, self.folder / "worker.log", cwd=self.source) as process:
            yield process


@contextmanager
def harbour(folder: Path) -> Iterator[Harbour]:
    """Start the server, deploy a copy of the source, make the alarms."""
    (folder / "inbox").mkdir()
    source = folder / "source"
    for name in ROOMS:
        shutil.copytree(ROOT / name, source / name, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    for name in FILES:
        shutil.copy(ROOT / name, source / name)
    home = folder / "prefect"
    home.mkdir()
    with prefect_server(home) as server, receiver() as (url, received):
        env = _environment(server, folder)
        here = Harbour(folder, env, received)
        here.prefect("work-pool", "create", "kempf", "--type", "process")
        here.prefect("--no-prompt", "deploy", "--all")
        alarms = [sys.executable, "-m", "kempf.flows.fleet.alarms", url, "--silent", str(_SILENT_S)]
        subprocess.run(alarms, env=env, cwd=source, check=True, capture_output=True)
        yield here


def _environment(server: Server, folder: Path) -> dict[str, str]:
    env = environment(
        **server.settings,
        KEMPF_WAREHOUSE=str(folder / "warehouse"),
        KEMPF_INBOX=str(folder / "inbox"),
        PREFECT_FLOWS_HEARTBEAT_FREQUENCY=str(_HEARTBEAT_S),
    )
    return {**env, "PYTHONPATH": str(folder / "source")}


def sailed(hull: str, day: int, seed: int) -> tuple[bytes, dict[str, Any]]:
    """Sail a zigzag on a day; return her log, and her profile as YAML content."""
    from kempf.pipeline.simulate.csv_log import to_csv
    from kempf.pipeline.simulate.logger_profile import logger_profile
    from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings

    settings = zigzag_settings(hull, duration_s=400.0, seed=seed)
    settings = replace(settings, start_utc_ns=settings.start_utc_ns + day * _DAY_NS)
    profile = logger_profile(settings).model_dump(mode="json", exclude_defaults=True)
    return to_csv(simulate_trial(settings)), profile


def arrive(here: Harbour, folder: str, name: str, data: bytes, profile: dict[str, Any] | None = None) -> None:
    """Put a log into the inbox, written long enough ago to be whole."""
    place = here.inbox / folder
    place.mkdir(exist_ok=True)
    if profile is not None:
        said = yaml.safe_dump({**profile, "vessel": folder}).encode()
        _written(place / "profile.yaml", said)
    _written(place / name, data)


def _written(path: Path, data: bytes) -> None:
    """Write a file as if ten minutes ago; one that is the same already is left alone."""
    if not path.exists() or path.read_bytes() != data:
        path.write_bytes(data)
        before = time.time() - 600.0
        os.utime(path, (before, before))


def run(deployment: str) -> Any:
    """Start a run of a deployment and wait until it ends; return it."""
    from prefect.client.orchestration import get_client
    from prefect.deployments import run_deployment

    begun: Any = run_deployment(deployment, timeout=0)

    def ended() -> bool:
        with get_client(sync_client=True) as client:
            state = client.read_flow_run(begun.id).state
            return bool(state and state.is_final())

    wait_for(ended, 600.0, every_s=0.5)
    with get_client(sync_client=True) as client:
        return client.read_flow_run(begun.id)


def sleep_through(here: Harbour, night: Night) -> None:
    """Let both deployments run, and note what they ended as and what was posted."""
    before = len(here.received)
    bad = 0
    with here.worker():
        for deployment in ("ingest/inbox", "reprocess/nightly"):
            done = run(deployment)
            message = (done.state.message or "").replace(str(here.folder), "")
            night.ended.append((deployment, done.state.name, message))
            bad += done.state.name in ("Failed", "Crashed")
        with suppress(AssertionError):
            wait_for(lambda: len(here.received) - before >= bad, 60.0 if bad else 1.0)
    night.posted = _posted(here, before)


def _posted(here: Harbour, before: int) -> list[str]:
    """Return what was posted since, each run with how it ended."""
    return [f"{one['flow']}: {one['state']}" for one in here.received[before:]]


def killed_in_the_night(here: Harbour, night: Night) -> None:
    """Switch the machine off in the middle of `reprocess/nightly`, and wait until somebody notices."""
    from prefect.client.orchestration import get_client
    from prefect.deployments import run_deployment

    before = len(here.received)

    def state() -> Any:
        with get_client(sync_client=True) as client:
            return client.read_flow_run(begun.id).state

    with here.worker():
        done = run("ingest/inbox")
        night.ended.append(("ingest/inbox", done.state.name, (done.state.message or "").replace(str(here.folder), "")))
        begun: Any = run_deployment("reprocess/nightly", timeout=0)
        wait_for(lambda: state().is_running(), 120.0)
        time.sleep(1.0)
    _kill_all(here)
    wait_for(lambda: state().is_final(), 400.0, every_s=1.0)
    wait_for(lambda: len(here.received) > before, 60.0)
    ended = state()
    night.ended.append(("reprocess/nightly", ended.name, ended.message or ""))
    night.posted = _posted(here, before)


def _kill_all(here: Harbour) -> None:
    """End every process that runs from the copy of the source: runs have groups of their own."""
    for entry in Path("/proc").iterdir():
        with suppress(OSError, ValueError):
            if entry.name.isdigit() and (entry / "cwd").resolve() == here.source.resolve():
                os.kill(int(entry.name), signal.SIGKILL)


def nights(here: Harbour) -> list[Night]:
    """Live through them."""
    hulls = {"mariner": 0, "ferry": 1}
    logs = {(hull, day): sailed(hull, day, 10 * day + k) for hull, k in hulls.items() for day in range(3)}
    found: list[Night] = []

    def one(by_day: str, act: Callable[[], None], sleep: Callable[[Harbour, Night], None] = sleep_through) -> Night:
        night = Night(by_day)
        act()
        sleep(here, night)
        found.append(night)
        print(len(found), by_day, night.ended, night.posted, flush=True)
        return night

    def log(folder: str, hull: str, day: int, *, profile: bool = False) -> None:
        data, said = logs[hull, day]
        arrive(here, folder, f"day{day}.csv.gz", data, said if profile else None)

    def two_ships() -> None:
        log("aurora", "mariner", 0, profile=True)
        log("boreas", "ferry", 0, profile=True)

    def second_logs() -> None:
        log("aurora", "mariner", 1)
        log("boreas", "ferry", 1)

    one("Two new ships: a folder each with a profile and a log.", two_ships)
    one("A second log of each.", second_logs)
    night = one("A log in the folder `auorra`: a slip of the hand.", lambda: log("auorra", "mariner", 2))
    night.morning.append(here.kempf("logs", "quarantine"))
    night.morning.append("$ kempf logs release auorra/day2.csv.gz --vessel aurora\n")
    night.morning.append(here.kempf("logs", "release", "auorra/day2.csv.gz", "--vessel", "aurora"))
    night = one("A log of `boreas` of which the first half is missing.", lambda: _damaged(here, logs["ferry", 2][0]))
    night.morning.append(here.kempf("logs", "quarantine"))
    night.morning.append('$ kempf logs dismiss day2.csv.gz --reason "damaged in transfer"\n')
    night.morning.append(here.kempf("logs", "dismiss", "boreas/day2.csv.gz", "--reason", "damaged in transfer"))
    one("Nothing.", lambda: None)
    one(
        "The profiles of both ships are changed, and by night the machine is switched off.",
        lambda: _changed_profiles(here, logs),
        killed_in_the_night,
    )
    one("Nothing. The machine is on again.", lambda: None)
    one("The code gets a remark.", lambda: _remark(here))
    zigzag = json.loads(here.kempf("segments", "--vessel", "aurora", "--json"))[0]["segment_id"]

    def exclude() -> None:
        here.kempf("segments", "exclude", zigzag, "--reason", "engine slowed", "--yes")

    one("The first zigzag of `aurora` is excluded.", exclude)

    def accept() -> None:
        here.kempf("segments", "accept", zigzag, "--reason", "it was not", "--yes")

    night = one("It is taken in again.", accept)
    night.morning.append("$ kempf verify\n")
    night.morning.append(here.kempf("verify"))
    return found


def _damaged(here: Harbour, data: bytes) -> None:
    arrive(here, "boreas", "day2.csv.gz", data[len(data) // 2 :])


def _changed_profiles(here: Harbour, logs: dict[tuple[str, int], tuple[bytes, dict[str, Any]]]) -> None:
    for folder, hull in (("aurora", "mariner"), ("boreas", "ferry")):
        profile = {**logs[hull, 0][1], "wind_arm_per_m": 0.004}
        arrive(here, folder, "day0.csv.gz", logs[hull, 0][0], profile)


def _remark(here: Harbour) -> None:
    path = here.source / "pipeline" / "estimate" / "maximum_likelihood.py"
    path.write_text(path.read_text(encoding="utf-8") + "# a remark\n", encoding="utf-8")


def page(found: list[Night]) -> list[str]:
    """Return the lines of the page."""
    rows = []
    for k, night in enumerate(found, 1):
        ended = "; ".join(f"{name}: **{state}**" for name, state, _ in night.ended)
        rows.append([str(k), night.by_day, ended, ", ".join(night.posted) or "-"])
    lines = [
        "A fleet of two ships for ten days, on a Prefect server with a worker and the alarms of "
        "`kempf.flows.fleet.alarms`.",
        "",
        *table(["night", "by day", "the runs ended as", "posted to the webhook"], rows),
        "",
        "## In the morning",
    ]
    for k, night in enumerate(found, 1):
        lines += ["", f"**{k}. {night.by_day}**", ""]
        lines += [f"- `{name}`: {state}. {message}" for name, state, message in night.ended]
        if night.morning:
            lines += ["", "```console", *("".join(night.morning)).rstrip().splitlines(), "```"]
    return lines


def main() -> None:
    """Live through ten nights and write ``results/ten_nights.md``."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    import kempf.flows.fleet.engine  # noqa: F401 - first: it sets what Prefect reads when it is imported

    with TemporaryDirectory() as folder, harbour(Path(folder)) as here:
        from prefect.settings import PREFECT_API_URL, PREFECT_HOME, temporary_settings

        settings = {PREFECT_API_URL: here.env["PREFECT_API_URL"], PREFECT_HOME: here.env["PREFECT_HOME"]}
        with temporary_settings(settings):
            found = nights(here)
    write("fleet.ten_nights", "Ten nights, and what the operator reads", page(found))


if __name__ == "__main__":
    main()
