"""From an estimate to the parameter set that is stored, with what the profile adds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from kempf.pipeline.estimate.result import Estimate, Value
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.parameter_set import Inputs, ParameterSet, parameter_set_id
from kempf.warehouse.parameter_set import StoredValue as Stored


def arm_of(spec: ModelSpec, profile: VesselProfile) -> float | None:
    """Return l of eq. (16), 1/m: the model's, else the profile's, None where neither has it."""
    return spec.wind_arm_per_m if spec.wind_arm_per_m is not None else profile.wind_arm_per_m


def without_arm(spec: ModelSpec, arm: float | None) -> tuple[str, ...]:
    """Return the warning that belongs to an arm that is not known."""
    if arm is not None or spec.wind != "force":
        return ()
    acts = {
        "none": "the wind is taken to act without a moment",
        "gauss-markov": "the moment is a slow state of its own beside the force",
    }
    return (f"wind_arm_per_m is not in the profile: {acts[str(spec.with_arm(arm).moment)]}",)


def as_parameter_set(
    result: Estimate,
    inputs: Inputs,
    vessel: str,
    segment_ids: tuple[str, ...],
    origin: dict[str, Any],
    warnings: tuple[str, ...] = (),
) -> ParameterSet:
    """Return the set that an estimate from these inputs is stored as.

    Parameters
    ----------
    origin : dict
        Provenance.
    warnings : tuple of str, optional
        Beside the estimate's own.
    """
    spec = ModelSpec.model_validate(dict(inputs.model_spec))
    return ParameterSet(
        parameter_set_id=parameter_set_id(inputs),
        vessel=vessel,
        model_name=spec.name,
        model_spec=spec.model_dump(mode="json"),
        model_sha256=spec.sha256,
        estimator=inputs.estimator,
        settings=dict(inputs.settings),
        segment_ids=segment_ids,
        log_ids=inputs.log_ids,
        start_utc_ns=min(bounds.start_utc_ns for bounds in inputs.bounds),
        parameters=stored(result.parameters),
        discrete=stored(result.discrete),
        noise=stored(result.noise),
        covariance_names=tuple(HULL_PARAMETERS),
        covariance=tuple(tuple(float(x) for x in row) for row in result.covariance),
        fit=result.fit,
        iterations=list(result.iterations),
        convergence=result.report,
        warnings=(*result.warnings, *warnings, *channel_warnings(origin)),
        parent=spec.parent,
        provenance=origin,
    )


def channel_warnings(origin: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what the channel doctor said of the logs behind a set, as its warnings.

    Parameters
    ----------
    origin : mapping
        Provenance; a set from before there was a doctor has nothing of him.
    """
    found = dict(origin.get("channels") or {})
    return tuple(
        f"channels of log {log[:12]}: {words}; see `kempf doctor {log[:12]}`"
        for log in sorted(found)
        for words in found[log]
    )


def stored(values: Sequence[Value]) -> tuple[Stored, ...]:
    """Return values in the form in which they are kept."""
    return tuple(Stored(v.name, v.value, v.std, v.unit) for v in values)
