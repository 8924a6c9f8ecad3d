"""OpenLineage events of a run: which tables it reads and writes, and which logs it takes in (https://openlineage.io)."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

from kempf.flows.process.configuration import setting
from kempf.schemas.errors import KempfError
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse

#: Who speaks, and the namespace of the jobs.
PRODUCER, NAMESPACE = "https://pypi.org/project/kempf", "kempf"
#: OpenLineage's own file, in which a transport is described that is no plain address.
_FILE_VARIABLE = "OPENLINEAGE_CONFIG"
#: Tables that a flow reads and writes.
TABLES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "ingest": (("vessels",), ("logs", "readings", "rejected", "lost", "segments", "examinations", "inbox")),
    "identify": (("vessels", "logs", "readings", "segments"), ("parameter_sets", "aliases")),
    "reprocess": (
        ("vessels", "logs", "corrections", "notes"),
        ("readings", "segments", "examinations", "parameter_sets", "aliases", "runs", "run_history"),
    ),
    "diagnose": (("logs", "readings", "segments"), ("parameter_sets", "diagnoses", "diagnosis_evidence")),
}
What = Literal["START", "COMPLETE", "FAIL", "ABORT"]


@dataclass(frozen=True)
class Event:
    """What happened to a run."""

    what: What
    flow: str
    run_id: str
    #: Of the flow.
    parameters: Mapping[str, Any]
    #: Why it failed; blank where it did not.
    message: str = ""


def wanted() -> bool:
    """Return whether the settings name a receiver."""
    return bool(setting("lineage.url") or os.environ.get(_FILE_VARIABLE))


def emit(event: Event) -> list[str]:
    """Send an event to the receiver that the settings name.

    Returns
    -------
    list of str
        Why it could not be done, a sentence each: a run does not fail by it.
    """
    try:
        from openlineage.client import OpenLineageClient
        from openlineage.client.transport.http import HttpConfig, HttpTransport
    except ImportError:
        return [
            "Lineage is asked for, but openlineage-python is not installed: install it with "
            "`pip install 'kempf[lineage]'`, or take lineage.url out of the settings."
        ]
    url = setting("lineage.url")
    try:
        # one attempt: the run waits for it
        config = HttpConfig.from_dict({"url": url, "timeout": 5.0, "retry": {"total": 0}}) if url else None
        client = OpenLineageClient(transport=HttpTransport(config)) if config else OpenLineageClient()
        client.emit(_run_event(event))
        client.close()
    except Exception as error:  # noqa: BLE001 - of any transport: whatever it is, the run goes on
        return [f"The event {event.what} of the run could not be sent to {url or 'the lineage server'}: {error}."]
    return []


def _run_event(event: Event) -> Any:
    from openlineage.client.event_v2 import InputDataset, Job, OutputDataset, Run, RunEvent, RunState
    from openlineage.client.facet_v2 import error_message_run

    warehouse = Warehouse(str(event.parameters["warehouse"]))
    versions = _versions(warehouse)
    read, written = TABLES[event.flow]
    facets: dict[str, Any] = {}
    if event.message:
        facets["errorMessage"] = error_message_run.ErrorMessageRunFacet(event.message, "PYTHON")
    logs = [InputDataset(*_place(str(path))) for path in event.parameters.get("paths") or ()]
    # what is written has its version once it is written
    after = versions if event.what != "START" else {}
    return RunEvent(
        eventType=RunState[event.what],
        eventTime=datetime.now(UTC).isoformat(),
        run=Run(event.run_id, facets=facets),
        job=Job(NAMESPACE, event.flow),
        producer=PRODUCER,
        inputs=[*logs, *(InputDataset(*_place(warehouse.address(t)), facets=_version(versions, t)) for t in read)],
        outputs=[OutputDataset(*_place(warehouse.address(t)), facets=_version(after, t)) for t in written],
    )


def _versions(warehouse: Warehouse) -> dict[str, int]:
    """Return the newest version of every table; none where the warehouse cannot be asked."""
    try:
        return delta.versions(warehouse) if warehouse.exists() else {}
    except KempfError:
        return {}


def _version(versions: Mapping[str, int], table: str) -> dict[str, Any]:
    from openlineage.client.facet_v2 import dataset_version_dataset

    if table not in versions:
        return {}
    return {"version": dataset_version_dataset.DatasetVersionDatasetFacet(str(versions[table]))}


def _place(address: str) -> tuple[str, str]:
    """Return namespace and name of a dataset as OpenLineage's naming has them: ``s3://bucket`` and a key, or ``file``.

    Examples
    --------
    >>> _place("s3://fleet/kempf/logs"), _place("/data/kempf/logs")
    (('s3://fleet', 'kempf/logs'), ('file', '/data/kempf/logs'))
    """
    scheme, there, rest = address.partition("://")
    if not there or scheme == "file":
        return "file", os.path.abspath(rest if there else address)  # noqa: PTH100 - no file is touched
    bucket, _, key = rest.partition("/")
    return f"{scheme}://{bucket}", key
