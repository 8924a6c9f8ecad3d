"""The job that builds a stored parameter set again from the raw bytes and compares every bit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flows.identify_vessel import build
from flows.pool_vessel import POOLED, build_pooled
from flows.vessel_model import ESTIMATOR, build_model
from pipeline.ingest.read import read_log
from pipeline.normalise.instruments import from_readings
from warehouse import agreement, code_version, logs, parameter_sets, raw, vessels
from warehouse.agreement import Difference
from warehouse.parameter_set import Bounds, Inputs, ParameterSet
from warehouse.store import Warehouse


@dataclass(frozen=True)
class Rerun:
    """The verdict on one parameter set.

    Attributes
    ----------
    parameter_set_id : str
    verdict : str
        ``bit-identical``, ``equal within tolerance`` or ``different``.
    differences : list of Difference
        Fields that differ.
    code_changed, packages_changed : bool, dict
        Whether the code, and which packages, are others than when the set was made.
    """

    parameter_set_id: str
    verdict: str
    differences: list[Difference]
    code_changed: bool
    packages_changed: dict[str, list[str | None]]

    def show(self) -> dict[str, Any]:
        """Return the verdict as JSON content."""
        return {
            "parameter_set_id": self.parameter_set_id,
            "verdict": self.verdict,
            "differences": [difference.as_json() for difference in self.differences],
            "code_changed": self.code_changed,
            "packages_changed": self.packages_changed,
        }


def rerun(warehouse: Warehouse, name: str, tolerance: float = 1e-9) -> Rerun:
    """Build a parameter set again from the raw bytes; nothing is stored.

    Parameters
    ----------
    warehouse : Warehouse
    name : str
        Its id, or a beginning of it.
    tolerance : float, optional
        Largest relative difference that still counts as equal.

    Raises
    ------
    NotFound
        ``no_parameter_set``, ``no_raw_log``, ``no_profile``.
    KempfError
        ``raw_bytes_damaged``.
    """
    stored = parameter_sets.get(warehouse, name)
    inputs = _inputs(stored)
    profile = vessels.get(warehouse, inputs.profile_sha256)
    instruments = {}
    for ingest_id in stored.provenance["ingest_ids"]:
        row = logs.of_ingest(warehouse, str(ingest_id))
        instruments[row.log_id] = from_readings(read_log(row.file_name, raw.get(warehouse, row.log_id), profile).frame)
    told = dict(stored.provenance)
    if inputs.estimator == POOLED:
        rebuilt = build_pooled(instruments, profile, inputs, stored.vessel, stored.segment_ids, told)
    elif inputs.estimator == ESTIMATOR:
        rebuilt = build_model(instruments, profile, inputs, stored.vessel, told, stored.parent)
    else:
        one = instruments[inputs.bounds[0].log_id]
        rebuilt = build(one, profile, inputs, stored.vessel, stored.segment_ids, told, instruments)
    verdict, differences = agreement.verdict(stored, rebuilt, tolerance)
    now, then = code_version.packages(), dict(stored.provenance.get("packages") or {})
    changed = {name: [then.get(name), now.get(name)] for name in sorted(then) if then.get(name) != now.get(name)}
    return Rerun(
        stored.parameter_set_id, verdict, differences, inputs.code_version != code_version.fingerprint(), changed
    )


def _inputs(stored: ParameterSet) -> Inputs:
    told = stored.provenance["inputs"]
    return Inputs(
        log_ids=tuple(told["log_ids"]),
        profile_sha256=told["profile_sha256"],
        bounds=tuple(Bounds(**bounds) for bounds in told["segments"]),
        model_spec=told["model"],
        estimator=told["estimator"],
        settings=told["settings"],
        code_version=told["code_version"],
        companions=tuple(Bounds(**bounds) for bounds in told.get("companions", ())),
    )
