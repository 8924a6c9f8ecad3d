"""Small made-up logs and parameter sets that the tests of this folder put into a warehouse."""

from __future__ import annotations

from typing import Any

import polars as pl

from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.readings import READING_SCHEMA, REJECTED_SCHEMA, Readings, Tally
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import raw
from kempf.warehouse.tables.deposit import Delivery
from kempf.warehouse.tables.examinations import StoredExamination
from kempf.warehouse.tables.parameter_set import Bounds, Inputs, ParameterSet, StoredValue, parameter_set_id
from kempf.warehouse.tables.segments import Segment, segment_id

START_NS = 1_746_258_421_147_000_001
CODE = "0123456789abcdef"


def readings(n: int = 5, refused: int = 2, shift: float = 0.0) -> Readings:
    frame = pl.DataFrame(
        {
            "record": range(n),
            "time_utc_ns": [START_NS + 500_000_000 * i for i in range(n)],
            "source": ["GPHDT" if i % 2 else "GPRMC" for i in range(n)],
            "heading_rad": [0.1 * i + shift for i in range(n)],
            "yaw_rate_rad_s": [None if i % 2 else -0.0 for i in range(n)],
        },
        schema_overrides=READING_SCHEMA,
    )
    missing = [pl.lit(None, dtype=t).alias(c) for c, t in READING_SCHEMA.items() if c not in frame.columns]
    rejected = pl.DataFrame(
        {
            "record": [n + i for i in range(refused)],
            "time_utc_ns": [None] * refused,
            "source": ["GPRMC"] * refused,
            "channel": [None if i % 2 else "heading" for i in range(refused)],
            "reason": ["checksum"] * refused,
            "raw": ["$GPRMC,\x00'quoted'*00"] * refused,
        },
        schema=REJECTED_SCHEMA,
    )
    tally = Tally(n + refused, n, refused, 2 * n, 2 * n, 0, {"checksum": refused})
    return Readings(frame.with_columns(missing).select(list(READING_SCHEMA)), rejected, tally, ("one note",), "nmea")


def delivery(vessel: str = "aurora", data: bytes = b"log one", length_m: float = 58.0, **changes: Any) -> Delivery:
    values: dict[str, Any] = {
        "vessel": vessel,
        "file_name": "day1.nmea.gz",
        "log": LogFile(data),
        "profile": VesselProfile(vessel="aurora", length_m=length_m),
        "readings": readings(),
        "code_version": CODE,
    }
    return Delivery(**{**values, **changes})


def segment(vessel: str, log_id: str, ingest_id: str, start_utc_ns: int = START_NS, **changes: Any) -> Segment:
    end = start_utc_ns + 60_000_000_000
    values: dict[str, Any] = {
        "segment_id": segment_id(log_id, "zigzag", start_utc_ns, end),
        "vessel": vessel,
        "log_id": log_id,
        "ingest_id": ingest_id,
        "kind": "zigzag",
        "psi0_deg": 20.0,
        "delta0_deg": 20.0,
        "first_side": "starboard",
        "base_heading_deg": 359.5,
        "start_utc_ns": start_utc_ns,
        "end_utc_ns": end,
        "executes_utc_ns": (start_utc_ns + 1, start_utc_ns + 2),
        "overshoots_deg": (9.7, float("nan")),
        "code_version": CODE,
        "imo": {"first": {"value": 9.7, "limit": 25.0, "passed": True}},
        "quality": {"gap_s": float("nan")},
    }
    return Segment(**{**values, **changes})


def examination(vessel: str, log_id: str, ingest_id: str, finding: str) -> StoredExamination:
    return StoredExamination(vessel, ingest_id, log_id, CODE, "faults", (finding,), {"findings": [finding]})


def inputs(log_id: str = "a" * 64, start_utc_ns: int = START_NS, **changes: Any) -> Inputs:
    values: dict[str, Any] = {
        "log_ids": (log_id,),
        "profile_sha256": "b" * 64,
        "bounds": (Bounds(log_id, start_utc_ns, start_utc_ns + 10),),
        "model_spec": {"name": "linear", "effects": ()},
        "estimator": "ml",
        "settings": {"tolerance": 1e-9, "upper": float("inf")},
        "code_version": CODE,
    }
    return Inputs(**{**values, **changes})


def parameter_set(vessel: str = "aurora", made_of: Inputs | None = None, **changes: Any) -> ParameterSet:
    made_of = made_of or inputs()
    values: dict[str, Any] = {
        "parameter_set_id": parameter_set_id(made_of),
        "vessel": vessel,
        "model_name": "linear",
        "model_spec": made_of.model_spec,
        "model_sha256": "c" * 64,
        "estimator": made_of.estimator,
        "settings": made_of.settings,
        "segment_ids": ("seg-1",),
        "log_ids": made_of.log_ids,
        "start_utc_ns": made_of.bounds[0].start_utc_ns,
        "parameters": (StoredValue("a11", -0.1, 0.01, "1/m"), StoredValue("b2", 1 / 3, None, "1/m^2")),
        "discrete": (StoredValue("phi11", 0.9, 0.1, "1"),),
        "noise": (StoredValue("sigma_r", 5e-4, 1e-5, "rad/s"),),
        "covariance_names": ("a11", "b2"),
        "covariance": ((1e-4, -0.0), (-0.0, float("nan"))),
        "fit": {"yaw_rate": {"fit_percent": 91.25, "lag": float("nan")}},
        "iterations": [{"loglik": -12.5, "n": 1}, {"loglik": 0.1 + 0.2, "n": 2}],
        "convergence": {"converged": True, "gradient": 1e-13},
        "warnings": ("b2 has no standard error",),
        "provenance": {"inputs": made_of.as_json(), "packages": {"numpy": "2.4.6"}, "flow_run": None},
    }
    return ParameterSet(**{**values, **changes})


def raw_bytes(warehouse: Warehouse, name: str) -> bytes:
    """The bytes of a log as delivered."""
    with raw.opened(warehouse, name) as log:
        return log.whole()
