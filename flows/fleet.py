"""The Prefect flows: ``ingest``, ``identify``, ``reprocess``, ``diagnose``. Few fat tasks; all leave a table artifact.

The work is in the jobs beside this file; here it is only put into batches, retried and reported.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

# Before prefect is imported: nothing leaves the machine.
os.environ.setdefault("DO_NOT_TRACK", "1")
os.environ.setdefault("PREFECT_SERVER_ANALYTICS_ENABLED", "false")
# A busy machine needs longer than Prefect's 20 s to start the server of a run.
os.environ.setdefault("PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS", "180")

from prefect import flow, get_run_logger, task
from prefect.artifacts import create_table_artifact
from prefect.runtime import flow_run
from prefect.task_runners import ThreadPoolTaskRunner

from flows import ingest_logs
from flows.diagnose_vessel import diagnose_vessel
from flows.files import read_profiles
from flows.fleet_diagnosis import summary
from flows.identify_vessel import Request, identify_vessel
from flows.pool_vessel import pool_vessel
from flows.reprocess_vessel import VesselReport, reprocess_vessel
from flows.unforeseen import as_told
from flows.vessel_model import PLAIN
from schemas.model_spec import ModelSpec
from warehouse import vessels as vessel_table
from warehouse.instant import iso_utc
from warehouse.store import Warehouse

#: The compiled likelihood and the readers run outside the interpreter's lock: one thread a core.
_WORKERS = os.cpu_count() or 1
#: Batches a worker: more than one evens out vessels of different size, many would pay Prefect for each.
_BATCHES_A_WORKER = 2


@task(name="ingest-batch", retries=1, retry_delay_seconds=5)
def ingest_batch(warehouse: str, paths: list[str], vessel: str | None, profiles: list[str]) -> list[dict[str, Any]]:
    """Take a batch of logs in."""
    given = read_profiles([Path(p) for p in profiles]) if profiles else None
    found = ingest_logs.ingest(Warehouse(warehouse), [Path(p) for p in paths], vessel, given)
    return [outcome.show() for outcome in found]


@flow(name="ingest")
def ingest(
    paths: list[str], warehouse: str = "kempf-data", vessel: str | None = None, profiles: Sequence[str] = ()
) -> list[dict[str, Any]]:
    """Take raw logs of one vessel in.

    Parameters
    ----------
    paths : list of str
        Raw logs.
    warehouse : str, optional
        Its address.
    vessel : str, optional
        Whose they are; else the profile tells.
    profiles : sequence of str, optional
        Profile files.
    """
    outcomes = ingest_batch(warehouse, paths, vessel, list(profiles))
    rows = [
        {
            "log": Path(o["path"]).name,
            "outcome": o["outcome"],
            "zigzags": len(o["segments"]),
            "rejected": (o["records"] or {}).get("rejected"),
            "error": o.get("error", {}).get("message", ""),
        }
        for o in outcomes
    ]
    create_table_artifact(key="kempf-ingest", table=rows, description="Logs taken in")
    return outcomes


@task(name="identify-vessel", retries=1, retry_delay_seconds=5)
def identify_task(warehouse: str, vessel: str, estimator: str, spec: dict[str, Any]) -> list[dict[str, Any]]:
    """Identify every zigzag of one vessel."""
    request = Request(ModelSpec.model_validate(spec), estimator)
    run = flow_run.get_id()
    told = str(run) if run else None
    outcomes = identify_vessel(Warehouse(warehouse), vessel, request, flow_run=told)
    pool_vessel(Warehouse(warehouse), vessel, request, outcomes, flow_run=told)
    return [
        {
            "segment": o.segment.segment_id,
            "start": iso_utc(o.segment.start_utc_ns),
            "parameter_set": o.parameter_set.parameter_set_id if o.parameter_set else None,
            "converged": bool(o.parameter_set and o.parameter_set.convergence.get("converged")),
            "error": o.error.message if o.error else "",
        }
        for o in outcomes
    ]


@flow(name="identify")
def identify(
    vessel: str, warehouse: str = "kempf-data", estimator: str = "ml", spec: dict[str, Any] | None = None
) -> list[dict[str, Any]]:
    """Identify a model from every zigzag of one vessel.

    Parameters
    ----------
    vessel : str
        Her name.
    warehouse : str, optional
        Its address.
    estimator : str, optional
        One of `pipeline.identify.names.NAMES`.
    spec : dict, optional
        Model specification.
    """
    rows = identify_task(warehouse, vessel, estimator, spec or {})
    create_table_artifact(key="kempf-identify", table=rows, description=vessel)
    return rows


def _names(warehouse: str, vessels: Sequence[str] | None) -> list[str]:
    """Return the vessels asked for, or all of a warehouse that must be there; sorted."""
    store = Warehouse(warehouse)
    store.require()
    return sorted(set(vessels)) if vessels else vessel_table.names(store)


@task(name="reprocess-batch", retries=1, retry_delay_seconds=5)
def reprocess_batch(warehouse: str, vessels: list[str], changed_only: bool, run: str | None) -> list[dict[str, Any]]:
    """Bring a batch of vessels up to date; a vessel that fails is reported, the others are done."""
    store, reports = Warehouse(warehouse), []
    for vessel in vessels:
        try:
            report = reprocess_vessel(store, vessel, changed_only=changed_only, flow_run=run)
        except Exception as error:  # noqa: BLE001 - whatever it is, the next vessel must not pay for it
            report = VesselReport(vessel)
            report.fail(vessel, as_told(error))
        get_run_logger().info("%s: %s", vessel, report.status)
        reports.append(report.show())
    return reports


#: Typed here because the runner's own parameter cannot be told from its arguments.
_THREADS: Any = ThreadPoolTaskRunner(max_workers=_WORKERS)


@flow(name="reprocess", task_runner=_THREADS)
def reprocess(
    warehouse: str = "kempf-data", vessels: list[str] | None = None, changed_only: bool = True
) -> list[dict[str, Any]]:
    """Bring the fleet up to date with its profiles and the code.

    Parameters
    ----------
    warehouse : str, optional
        Its address.
    vessels : list of str, optional
        Only these; the whole fleet by default.
    changed_only : bool, optional
        False also verifies every kept parameter set from the raw bytes.

    Returns
    -------
    list of dict
        One report a vessel, sorted by name.
    """
    names = _names(warehouse, vessels)
    run = str(flow_run.get_id()) if flow_run.get_id() else None
    n_batches = min(len(names), _WORKERS * _BATCHES_A_WORKER)
    batches = [names[k::n_batches] for k in range(n_batches)]
    futures = [reprocess_batch.submit(warehouse, batch, changed_only, run) for batch in batches]
    reports: list[dict[str, Any]] = sorted((r for f in futures for r in f.result()), key=lambda r: str(r["vessel"]))
    rows = [
        {
            **{k: v for k, v in report.items() if k not in ("failures", "verified")},
            "failures": "; ".join(f"{f['what']}: {f['error']['message']}" for f in report["failures"]),
        }
        for report in reports
    ]
    create_table_artifact(key="kempf-reprocess", table=rows, description="The fleet")
    return reports


@task(name="diagnose-batch", retries=1, retry_delay_seconds=5)
def diagnose_batch(warehouse: str, vessels: Sequence[str], spec: dict[str, Any]) -> list[dict[str, Any]]:
    """Diagnose vessels one after the other, each on all cores; one that fails is reported, the others are done."""
    model, told = ModelSpec.model_validate(spec), []
    for vessel in vessels:
        try:
            found, _ = diagnose_vessel(Warehouse(warehouse), vessel, model)
            told.append(found.show())
        except Exception as error:  # noqa: BLE001 - whatever it is, the next vessel must not pay for it
            told.append({"vessel": vessel, "verdict": "failed", "error": as_told(error).to_json()["error"]})
        get_run_logger().info("%s: %s", vessel, told[-1]["verdict"])
    return told


@flow(name="diagnose")
def diagnose(
    warehouse: str = "kempf-data", vessels: list[str] | None = None, spec: dict[str, Any] | None = None
) -> list[dict[str, Any]]:
    """Find what the models of the fleet lack.

    Parameters
    ----------
    warehouse : str, optional
        Its address.
    vessels : list of str, optional
        Only these; the whole fleet by default.
    spec : dict, optional
        Model to begin from; the plain one by default.

    Returns
    -------
    list of dict
        One row an effect and vessel, see `flows.fleet_diagnosis.summary`.
    """
    names = _names(warehouse, vessels)
    rows = summary(diagnose_batch(warehouse, names, spec or PLAIN.model_dump(mode="json")))
    create_table_artifact(key="kempf-diagnose", table=rows, description="What the models of the fleet lack")
    return rows
