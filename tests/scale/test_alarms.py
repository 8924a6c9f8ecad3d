"""The alarms on a real server: a run that ends badly is posted to a webhook, one that went silent is ended."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest

from kempf.schemas.errors import DataRejected
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs
from tests.scale.conftest import FLEET, prefect_server, reporting_to, touch
from tests.scale.servers import receiver, wait_for


@pytest.fixture
def posted() -> Iterator[tuple[str, list[dict[str, Any]]]]:
    with receiver() as lent:
        yield lent


@pytest.fixture
def _server_of_its_own(tmp_path: Path) -> Iterator[None]:
    """Its alarms concern no other test."""
    home = tmp_path / "prefect"
    home.mkdir()
    with prefect_server(home) as server, reporting_to(server):
        yield


@pytest.mark.usefixtures("_server_of_its_own")
def test_bad_ends_are_posted_and_silent_runs_are_ended(
    posted: tuple[str, list[dict[str, Any]]], stocked: Path, tmp_path: Path
) -> None:
    from prefect.client.orchestration import get_client
    from prefect.events import emit_event
    from prefect.states import Running

    from kempf.flows.fleet import alarms
    from kempf.flows.fleet.flows import reprocess

    url, received = posted
    alarms.main([url, "--silent", "600"])
    alarms.main([url, "--silent", "10"])  # in place of those, not beside them
    with get_client(sync_client=True) as client:
        assert sorted(one.name for one in client.read_automations() if one.name.startswith("kempf")) == sorted(
            (alarms.ENDED_BADLY, alarms.GONE_SILENT)
        )
    place = Warehouse(str(copytree(stocked, tmp_path / "w")))
    assert place.folder is not None
    (row,) = logs.current(place, FLEET[0])
    touch(place, FLEET[0])
    (place.folder / "raw" / row.log_id[:2] / row.log_id).write_bytes(b"damaged")
    with pytest.raises(DataRejected):
        reprocess(place.uri, [FLEET[0]])
    wait_for(lambda: received, 120.0, every_s=0.2)
    (alarm,) = received
    assert (alarm["flow"], alarm["state"]) == ("reprocess", "Failed")
    assert alarm["message"] == f"1 vessel: 1 failed; look at {FLEET[0]}"
    assert alarm["flow_run_id"] in alarm["page"]

    with get_client(sync_client=True) as client:
        run = client.create_flow_run(reprocess, parameters={"warehouse": place.uri}, state=Running())
        flow = client.read_flow(run.flow_id)
        emit_event(  # as the process of a run does while it lives
            "prefect.flow-run.heartbeat",
            {"prefect.resource.id": f"prefect.flow-run.{run.id}", "prefect.resource.name": run.name},
            related=[
                {
                    "prefect.resource.id": f"prefect.flow.{flow.id}",
                    "prefect.resource.role": "flow",
                    "prefect.resource.name": flow.name,
                }
            ],
        )
        wait_for(lambda: len(received) == 2, 180.0, every_s=0.5)
        state = client.read_flow_run(run.id).state
    assert (
        state is not None and state.is_crashed() and "Nothing was heard of this run for 10 s" in (state.message or "")
    )
    assert (received[1]["flow_run_id"], received[1]["state"]) == (str(run.id), "Crashed")
