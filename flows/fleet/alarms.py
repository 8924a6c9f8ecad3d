"""Who is woken when: ``python -m kempf.flows.fleet.alarms URL`` makes the alarms on the Prefect server.

A run of Kempf's flows that ends as Failed or Crashed is posted to a webhook. A run of which nothing is heard, because
its machine was switched off or its process killed, is marked as Crashed: it would be Running for ever, and where a
deployment allows one run at a time no later one would start.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from datetime import timedelta
from uuid import UUID

from prefect.blocks.webhook import Webhook
from prefect.client.orchestration import get_client
from prefect.client.schemas.objects import StateType
from prefect.events.actions import CallWebhook, ChangeFlowRunState
from prefect.events.schemas.automations import AutomationCore, EventTrigger, Posture
from prefect.events.schemas.events import ResourceSpecification

import kempf.flows.fleet.engine  # noqa: F401 - first: it sets what Prefect reads when it is imported

#: names of the block and of the automations on the server
WEBHOOK, ENDED_BADLY, GONE_SILENT = "kempf-alarm", "kempf: a run failed or crashed", "kempf: nothing heard of a run"
#: flows whose runs are watched
FLOWS = ("ingest", "identify", "reprocess", "diagnose")
#: of a run that says it is alive every 180 s (PREFECT_FLOWS_HEARTBEAT_FREQUENCY) three signs may be missed
SILENT_S = 600.0

_ENDS = {f"prefect.flow-run.{state}" for state in ("Completed", "Failed", "Cancelled", "Crashed", "TimedOut")}
_PAYLOAD = (
    '{"flow": "{{ flow.name }}", "flow_run": "{{ flow_run.name }}", "flow_run_id": "{{ flow_run.id }}", '
    '"state": "{{ flow_run.state.name }}", "message": {{ (flow_run.state.message or "") | tojson }}, '
    '"page": "{{ flow_run | ui_url }}"}'
)


def automations(webhook: UUID, silent_s: float = SILENT_S) -> list[AutomationCore]:
    """Return the automations that post bad ends of runs to a webhook, and end runs of which nothing is heard.

    Parameters
    ----------
    webhook : UUID
        Id of the block document of the webhook.
    silent_s : float, optional
        So long nothing is heard of a run that said it was alive before.
    """
    runs = ResourceSpecification({"prefect.resource.id": "prefect.flow-run.*"})
    of_kempf = ResourceSpecification({"prefect.resource.role": "flow", "prefect.resource.name": list(FLOWS)})
    return [
        AutomationCore(
            name=ENDED_BADLY,
            description="Posts the run, its state and message to the webhook.",
            trigger=EventTrigger(
                match=runs,
                match_related=of_kempf,
                expect={"prefect.flow-run.Failed", "prefect.flow-run.Crashed", "prefect.flow-run.TimedOut"},
                for_each={"prefect.resource.id"},
                posture=Posture.Reactive,
                threshold=1,
                # the end of a run may be said twice: the second time is within this of the first, and is not posted
                within=timedelta(minutes=5),
            ),
            actions=[CallWebhook(block_document_id=webhook, payload=_PAYLOAD)],
        ),
        AutomationCore(
            name=GONE_SILENT,
            description="Marks the run as Crashed, so that the next one can start.",
            trigger=EventTrigger(
                match=runs,
                match_related=of_kempf,
                after={"prefect.flow-run.heartbeat"},
                expect={"prefect.flow-run.heartbeat", *_ENDS},
                for_each={"prefect.resource.id"},
                posture=Posture.Proactive,
                threshold=1,
                within=timedelta(seconds=silent_s),
            ),
            actions=[
                ChangeFlowRunState(
                    state=StateType.CRASHED,
                    message=f"Nothing was heard of this run for {silent_s:g} s: its machine or process is gone.",
                    force=True,
                )
            ],
        ),
    ]


def make(url: str, silent_s: float = SILENT_S) -> list[str]:
    """Make the alarms on the server that PREFECT_API_URL names, in place of those that are there.

    Parameters
    ----------
    url : str
        To which bad ends are posted as JSON: flow, flow_run, flow_run_id, state, message, page.
    silent_s : float, optional
        See `automations`.

    Returns
    -------
    list of str
        Names of the automations.
    """
    webhook = Webhook(method="POST", url=url, headers={"Content-Type": "application/json"})
    document = webhook.save(WEBHOOK, overwrite=True)
    assert isinstance(document, UUID)  # it is a coroutine only where a loop runs
    alarms = automations(document, silent_s)
    with get_client(sync_client=True) as client:
        known = client.read_automations()
        for alarm in alarms:
            for before in known:
                if before.name == alarm.name:
                    client.delete_automation(before.id)
            client.create_automation(alarm)
    return [alarm.name for alarm in alarms]


def main(arguments: Sequence[str] | None = None) -> None:
    """Make the alarms and print their names."""
    parser = argparse.ArgumentParser(prog="python -m kempf.flows.fleet.alarms", description=__doc__)
    parser.add_argument("url", help="to which bad ends of runs are posted")
    parser.add_argument("--silent", type=float, default=SILENT_S, metavar="S", help="so long nothing is heard, s")
    given = parser.parse_args(arguments)
    sys.stdout.writelines(f"{name}\n" for name in make(given.url, given.silent))


if __name__ == "__main__":
    main()
