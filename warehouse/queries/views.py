"""The tables that analysts ask for, made of those in which things are kept.

Times are timestamps in UTC, to the microsecond. Nothing here is stored.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import polars as pl
from orjson import loads

from kempf.warehouse.queries import history
from kempf.warehouse.storage import append_only, delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, examinations, logs, parameter_sets, segments, vessels

_TIME = pl.Datetime("us", "UTC")


def parameter_history(warehouse: Warehouse) -> pl.DataFrame:
    """Return a row a parameter of every set, superseded ones too, sorted by vessel, start, set and parameter.

    Columns: vessel, start_at, parameter, value, std, low, high (of the 95 % interval), unit, model, effects, estimator,
    converged, superseded, current, parameter_set_id, stored_at, code.
    """
    names = vessels.names(warehouse)
    schema: dict[str, Any] = {"vessel": pl.String, **_PARAMETER}
    stored = parameter_sets.stored_at_ms(warehouse) if names else {}
    frames = [_of_vessel(warehouse, name, stored) for name in names]
    frame = pl.concat([pl.DataFrame(schema=schema), *frames]) if frames else pl.DataFrame(schema=schema)
    return frame.sort("vessel", "start_at", "parameter_set_id", "parameter")


_PARAMETER: dict[str, Any] = {
    "start_at": _TIME,
    "parameter": pl.String,
    "value": pl.Float64,
    "std": pl.Float64,
    "low": pl.Float64,
    "high": pl.Float64,
    "unit": pl.String,
    "model": pl.String,
    "effects": pl.String,
    "estimator": pl.String,
    "converged": pl.Boolean,
    "superseded": pl.Boolean,
    "current": pl.Boolean,
    "parameter_set_id": pl.String,
    "stored_at": _TIME,
    "code": pl.String,
}


def _of_vessel(warehouse: Warehouse, vessel: str, stored_ms: Mapping[str, int]) -> pl.DataFrame:
    timeline = history.of_vessel(warehouse, vessel, superseded=True)
    current = aliases.of_vessel(warehouse, vessel).get(aliases.CURRENT)
    facts = _sets(warehouse, vessel)
    rows = [
        {
            **{key: row[key] for key in ("parameter", "value", "std", "low", "high", "unit", "model", "estimator")},
            **{key: row[key] for key in ("converged", "superseded", "parameter_set_id")},
            **facts[row["parameter_set_id"]],
            "stored_at": _in_us(stored_ms.get(row["parameter_set_id"])),
            "vessel": vessel,
            "start_at": row["start_utc_ns"] // 1000,
            "current": row["parameter_set_id"] == current,
        }
        for row in timeline.rows()
    ]
    schema = {"vessel": pl.String, **_PARAMETER}
    return pl.DataFrame(
        rows, schema={**schema, "start_at": pl.Int64, "stored_at": pl.Int64}, orient="row"
    ).with_columns(pl.col("start_at", "stored_at").cast(_TIME))


def _sets(warehouse: Warehouse, vessel: str) -> dict[str, dict[str, Any]]:
    """Return effects and code of every set of a vessel, by id."""
    from kempf.warehouse.storage.keys import vessel_key

    columns = ("parameter_set_id", "model_json", "provenance_json")
    frame = delta.read(warehouse, "parameter_sets", {"vessel_key": vessel_key(vessel)}, columns)
    return {name: _facts(loads(model), loads(provenance)) for name, model, provenance in frame.rows()}


def _facts(model: Mapping[str, Any], provenance: Mapping[str, Any]) -> dict[str, Any]:
    return {"effects": " + ".join(model.get("effects") or ()), "code": provenance.get("code_version")}


def _in_us(milliseconds: int | None) -> int | None:
    return None if milliseconds is None else milliseconds * 1000


def manoeuvres(warehouse: Warehouse) -> pl.DataFrame:
    """Return a row a manoeuvre of every kind, excluded ones too, sorted by vessel and start.

    Columns: vessel, start_at, end_at, kind, psi0_deg, delta0_deg, first_side, base_heading_deg, executes,
    overshoot_1_deg to overshoot_3_deg, imo_passed (null where nothing was judged), excluded (why), remarks, file_name,
    segment_id, log_id.
    """
    names = {row.ingest_id: row.file_name for row in logs.current(warehouse)}
    rows = []
    for segment in segments.found_in(warehouse):
        judged = [c["passed"] for c in segment.imo.values() if c.get("passed") is not None]
        angles = (*segment.overshoots_deg, None, None, None)
        rows.append(
            {
                "vessel": segment.vessel,
                "start_at": segment.start_utc_ns // 1000,
                "end_at": segment.end_utc_ns // 1000,
                "kind": segment.kind,
                "psi0_deg": None if segment.psi0_deg != segment.psi0_deg else segment.psi0_deg,
                "delta0_deg": segment.delta0_deg,
                "first_side": segment.first_side,
                "base_heading_deg": segment.base_heading_deg,
                "executes": len(segment.executes_utc_ns),
                **{f"overshoot_{k + 1}_deg": angles[k] for k in range(3)},
                "imo_passed": all(judged) if judged else None,
                "excluded": segment.excluded,
                "remarks": " ".join(segment.quality.get("reasons") or ()),
                "file_name": names.get(segment.ingest_id),
                "segment_id": segment.segment_id,
                "log_id": segment.log_id,
            }
        )
    text, real = pl.String, pl.Float64
    schema: dict[str, Any] = {
        **{
            "vessel": text,
            "start_at": pl.Int64,
            "end_at": pl.Int64,
            "kind": text,
            "psi0_deg": real,
            "delta0_deg": real,
        },
        **{"first_side": text, "base_heading_deg": real, "executes": pl.Int64},
        **{f"overshoot_{k}_deg": real for k in (1, 2, 3)},
        **{"imo_passed": pl.Boolean, "excluded": text, "remarks": text, "file_name": text},
        **{"segment_id": text, "log_id": text},
    }
    frame = pl.DataFrame(rows, schema=schema, orient="row").with_columns(pl.col("start_at", "end_at").cast(_TIME))
    return frame.sort("vessel", "start_at", "segment_id")


def log_quality(warehouse: Warehouse) -> pl.DataFrame:
    """Return a row a log, removed ones too, sorted by vessel and start.

    Columns: vessel, start_at, end_at, file_name, format, records and values read, kept and rejected, zigzags, channels
    (the doctor's verdict), findings, first_finding, removed (why), log_id.
    """
    rows = [*logs.current(warehouse), *logs.removed(warehouse)]
    seen = examinations.of_ingests(warehouse, [row.ingest_id for row in rows])
    zigzags: dict[str, int] = {}
    for segment in segments.found_in(warehouse):
        zigzags[segment.ingest_id] = zigzags.get(segment.ingest_id, 0) + segment.is_zigzag
    counts = [f"{item}_{outcome}" for item in ("records", "values") for outcome in ("read", "kept", "rejected")]
    content = [
        {
            "vessel": row.vessel,
            "start_at": row.start_utc_ns // 1000,
            "end_at": row.end_utc_ns // 1000,
            "file_name": row.file_name,
            "format": row.format,
            **{name: getattr(row.tally, name) for name in counts},
            "zigzags": zigzags.get(row.ingest_id, 0),
            "channels": seen[row.ingest_id].verdict if row.ingest_id in seen else None,
            "findings": len(seen[row.ingest_id].findings) if row.ingest_id in seen else None,
            "first_finding": next(iter(seen[row.ingest_id].findings), None) if row.ingest_id in seen else None,
            "removed": row.removed,
            "log_id": row.log_id,
        }
        for row in rows
    ]
    text, whole = pl.String, pl.Int64
    schema: dict[str, Any] = {
        **{"vessel": text, "start_at": whole, "end_at": whole, "file_name": text, "format": text},
        **dict.fromkeys(counts, whole),
        **{"zigzags": whole, "channels": text, "findings": whole, "first_finding": text, "removed": text},
        "log_id": text,
    }
    frame = pl.DataFrame(content, schema=schema, orient="row").with_columns(pl.col("start_at", "end_at").cast(_TIME))
    return frame.sort("vessel", "start_at", "log_id")


def run_history(warehouse: Warehouse) -> pl.DataFrame:
    """Return a row a vessel that a run worked on, in the order of time; vessels that had nothing to do have none.

    Columns: run_at, flow, flow_run, vessel, status, new_sets, kept_sets, reread, failures, findings, first_failure.
    """
    times = append_only.times(warehouse, "run_history")
    rows = delta.read(warehouse, "run_history").sort("number", "vessel").rows(named=True)
    content = [
        {**{key: row[key] for key in row if key != "number"}, "run_at": times.get(row["number"])} for row in rows
    ]
    text, whole = pl.String, pl.Int64
    schema: dict[str, Any] = {
        **{"run_at": _TIME, "flow": text, "flow_run": text, "vessel": text, "status": text},
        **{"new_sets": whole, "kept_sets": whole, "reread": whole, "failures": whole, "findings": whole},
        "first_failure": text,
    }
    return pl.DataFrame(content, schema=schema, orient="row")


#: Every view by name.
VIEWS: dict[str, Callable[[Warehouse], pl.DataFrame]] = {
    "parameter_history": parameter_history,
    "manoeuvres": manoeuvres,
    "log_quality": log_quality,
    "run_history": run_history,
}
