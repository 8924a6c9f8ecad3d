"""docs/fleet.md followed word for word: server, pool, worker, a run with a failure, one cancelled, the schedule."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest

from kempf.flows.fleet.plan import do_fleet, plan
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, runs
from tests.flows.content import seen
from tests.scale.conftest import FLEET, Server, touch
from tests.scale.servers import ROOT, environment, running, wait_for

TEXT = (ROOT / "docs" / "fleet.md").read_text(encoding="utf-8")


def documented(beginning: str) -> list[str]:
    """Return the one command of the page that begins so."""
    found = re.findall(rf"^{re.escape(beginning)}.*$", TEXT, re.MULTILINE)
    assert len(set(found)) == 1, (beginning, found)
    return [part.strip("\"'") for part in found[0].split()]


@pytest.fixture(scope="module")
def place(stocked: Path, tmp_path_factory: pytest.TempPathFactory) -> Warehouse:
    return Warehouse(str(copytree(stocked, tmp_path_factory.mktemp("nightly") / "w")))


@pytest.fixture(scope="module")
def deployed(place: Warehouse, server: Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """The pool and the deployments are made and a worker runs, each by the page's own command."""
    assert documented("prefect server start") == ["prefect", "server", "start", "--host", "127.0.0.1"]
    exported = re.findall(r"^export (\w+)=", TEXT, re.MULTILINE)
    assert {"PREFECT_API_URL", "KEMPF_WAREHOUSE", "KEMPF_INBOX", "DO_NOT_TRACK"} <= set(exported)
    env = environment(**server.settings, KEMPF_WAREHOUSE=place.uri)
    for beginning in ("prefect work-pool create", "prefect --no-prompt deploy --"):
        done = ran(documented(beginning), env)
        assert done.returncode == 0, done
    log = tmp_path_factory.mktemp("worker") / "log"
    with running(documented("prefect worker start"), env, log):
        yield env


def ran(command: list[str], env: dict[str, str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, env=env, cwd=ROOT, capture_output=True, text=True, timeout=900, check=False)


def flow_runs(*states: str) -> list[Any]:
    from prefect.client.orchestration import get_client
    from prefect.client.schemas.sorting import FlowRunSort

    with get_client(sync_client=True) as client:
        found = client.read_flow_runs(sort=FlowRunSort.START_TIME_DESC)
        return [one for one in found if not states or (one.state and one.state.type.value in states)]


def since(before: set[Any], *states: str) -> list[Any]:
    """The flow runs that were not there before: the server also serves the other files of this session."""
    return [one for one in flow_runs(*states) if one.id not in before]


def planned() -> list[Any]:
    return [one for one in flow_runs("SCHEDULED") if one.auto_scheduled]


def pause_schedules() -> None:
    """What `prefect deployment schedule pause --all` does: at 01:00 or 02:00 UTC too a test sees its own runs only."""
    from prefect.client.orchestration import get_client

    with get_client(sync_client=True) as client:
        for deployment in client.read_deployments():
            for schedule in client.read_deployment_schedules(deployment.id):
                client.update_deployment_schedule(deployment.id, schedule.id, active=False)


def test_a_run_as_documented_reports_the_failed_and_does_the_rest(
    deployed: dict[str, str], place: Warehouse, on_server: None
) -> None:
    # The server's scheduler plans one deployment after another: 01:00 may stand before 02:00 does.
    wait_for(lambda: "02:00" in {f"{one.expected_start_time:%H:%M}" for one in planned()}, 120.0, every_s=0.5)
    pause_schedules()
    before = {one.id for one in flow_runs()}
    sound, damaged = FLEET[:2], FLEET[2]
    touch(place, *FLEET)
    kept = raw_file(place, damaged)
    whole = kept.read_bytes()
    kept.write_bytes(whole[:-10])
    try:
        done = ran(documented("prefect --no-prompt deployment run reprocess/nightly --watch"), deployed)
    finally:
        kept.write_bytes(whole)
    assert done.returncode == 1, done
    (failed,) = since(before, "FAILED")
    assert failed.state.message == f"3 vessels: 2 changed, 1 failed; look at {damaged}"
    stood = {run.vessel: run.status for run in runs.all_runs(place, "reprocess")}
    assert stood == {**dict.fromkeys(sound, "changed"), damaged: "failed"}
    output = ran(documented("prefect artifact inspect kempf-fleet"), deployed)
    assert "3 vessels: 2 changed, 1 failed" in output.stdout and "Ingest the original file again" in output.stdout


def test_a_cancelled_run_goes_on_where_it_stopped(deployed: dict[str, str], place: Warehouse, on_server: None) -> None:
    assert documented("prefect flow-run cancel") == ["prefect", "flow-run", "cancel", "ID"]
    touch(place, *FLEET)
    alone = Warehouse(str(copytree(str(place.folder), f"{place.uri}-alone")))
    kept = raw_file(place, FLEET[0])  # the one that is begun last
    whole = kept.read_bytes()
    kept.unlink()
    os.mkfifo(kept)  # whoever reads it waits: a storage that hangs
    states = {run.vessel: run.message.get("state") for run in runs.all_runs(place, "reprocess")}
    before = {one.id for one in flow_runs()}
    try:
        start("reprocess/nightly")
        wait_for(lambda: finished(place, states) == set(FLEET[1:]), 300.0, every_s=0.2)
        (one,) = since(before, "RUNNING")
        cancel(one.id)
        wait_for(lambda: let_go(kept) or not flow_runs("RUNNING", "CANCELLING"), 300.0, every_s=0.2)
    finally:
        kept.unlink()
        kept.write_bytes(whole)
    assert [r.state.type.value for r in flow_runs() if r.id == one.id] == ["CANCELLED"]
    assert [name for name, _ in plan(place).due] == [FLEET[0]]
    for warehouse in (place, alone):
        assert not any(report["failures"] for report in do_fleet(warehouse))
    assert ids(place) == ids(alone)
    assert {report["status"] for report in do_fleet(place)} == {"unchanged"}


def raw_file(warehouse: Warehouse, vessel: str) -> Path:
    assert warehouse.folder is not None
    (row,) = logs.current(warehouse, vessel)
    return warehouse.folder / "raw" / row.log_id[:2] / row.log_id


def finished(warehouse: Warehouse, before: dict[Any, Any]) -> set[Any]:
    """The vessels whose last run has left another state than before."""
    states = {run.vessel: run.message.get("state") for run in runs.all_runs(warehouse, "reprocess")}
    return {vessel for vessel, state in states.items() if state and state != before.get(vessel)}


def let_go(pipe: Path) -> bool:
    """Give whoever waits at a pipe its end; always False."""
    with suppress(OSError):
        os.close(os.open(pipe, os.O_WRONLY | os.O_NONBLOCK))
    return False


def start(deployment: str) -> None:
    """What `prefect deployment run` does, without the seconds that the program takes to begin."""
    from prefect.deployments import run_deployment

    run_deployment(deployment, timeout=0)


def cancel(flow_run: Any) -> None:
    """What `prefect flow-run cancel` does, without the seconds that the program takes to begin."""
    from prefect.client.orchestration import get_client
    from prefect.client.schemas.objects import State, StateType

    with get_client(sync_client=True) as client:
        client.set_flow_run_state(flow_run, State(type=StateType.CANCELLING))


def ids(warehouse: Warehouse) -> dict[str, list[Any]]:
    """What results are called, which is what they say: an id is the hash of all that made them."""
    content = seen(warehouse)
    keys = {"logs": "ingest_id", "segments": "segment_id", "parameter_sets": "parameter_set_id", "raw": "name"}
    return {name: sorted(row[key] for row in content[name]) for name, key in keys.items()}


@pytest.mark.usefixtures("on_server")
def test_the_schedule_starts_runs_by_itself(deployed: dict[str, str], place: Warehouse) -> None:
    from prefect.client.orchestration import get_client
    from prefect.client.schemas.schedules import IntervalSchedule

    before = {one.id for one in flow_runs()}
    with get_client(sync_client=True) as client:
        deployment = client.read_deployment_by_name("reprocess/nightly")
        # one run: of one every few seconds the server lists hundreds that were refused, and not the one that was not
        soon = IntervalSchedule(interval=timedelta(hours=1), anchor_date=datetime.now(UTC) + timedelta(seconds=5))
        (made,) = client.create_deployment_schedules(deployment.id, [(soon, True)])

        def fired() -> list[Any]:
            return [r for r in since(before, "COMPLETED") if r.auto_scheduled]

        wait_for(fired, 600.0, every_s=0.5)
        client.delete_deployment_schedule(deployment.id, made.id)
