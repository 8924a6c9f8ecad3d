"""The Prefect flow ``diagnose`` over the fleet, and its summary: which vessels lack which effect, since when.

Vessels are diagnosed one after the other: a diagnosis uses all cores for its runs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

# first: it decides what Prefect may send out, before Prefect is imported
from flows.fleet import vessel_table
from prefect import flow, get_run_logger, task
from prefect.artifacts import create_table_artifact

from flows.diagnose_vessel import diagnose_vessel
from flows.unforeseen import as_told
from schemas.model_spec import ModelSpec
from warehouse.instant import iso_utc
from warehouse.store import Warehouse


@task(name="diagnose-batch", retries=1, retry_delay_seconds=5)
def diagnose_batch(warehouse: str, vessels: Sequence[str], spec: dict[str, Any]) -> list[dict[str, Any]]:
    """Diagnose vessels; one that fails is reported, the others are done."""
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
        One row of the summary an effect and vessel, see `summary`.
    """
    store = Warehouse(warehouse)
    store.require()
    names = sorted(set(vessels)) if vessels else vessel_table.names(store)
    rows = summary(diagnose_batch(warehouse, names, spec or {"name": "plain", "rate_bias": False}))
    create_table_artifact(key="kempf-diagnose", table=rows, description="What the models of the fleet lack")
    return rows


def summary(diagnoses: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return one row for every set of effects found, and one for every vessel without any.

    Parameters
    ----------
    diagnoses : sequence of mapping
        As `warehouse.diagnoses.StoredDiagnosis.show` gives them, or ``{vessel, verdict, error}``.

    Returns
    -------
    list of dict
        ``vessel``, ``verdict``, ``effects`` (those that the data do not tell apart), ``since`` (ISO 8601, the first
        manoeuvre in which they are seen), ``held_out_before``, ``held_out_after`` (free-run errors), ``note``.
    """
    rows = []
    for one in diagnoses:
        ladder = one.get("ladder", [])
        ends = (ladder[0]["held_out_error"], ladder[-1]["held_out_error"]) if ladder else (None, None)
        told = {"vessel": one["vessel"], "verdict": one["verdict"]}
        error = {"held_out_before": ends[0], "held_out_after": ends[1]}
        note = one["error"]["message"] if "error" in one else ""
        for found in one.get("sets", []):
            since = found["since_utc_ns"]
            rows.append(
                {
                    **told,
                    "effects": " or ".join(found["effects"]),
                    "since": "" if since is None else iso_utc(since),
                    **error,
                    "note": note,
                }
            )
        if not one.get("sets"):
            rows.append({**told, "effects": "", "since": "", **error, "note": note})
    return rows
