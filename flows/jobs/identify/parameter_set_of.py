"""From an estimate to the parameter set that is stored, with what the profile adds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from kempf.pipeline.estimate.result import Estimate, Value
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.tables.parameter_set import Inputs, ParameterSet, parameter_set_id
from kempf.warehouse.tables.parameter_set import StoredValue as Stored


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


@dataclass(frozen=True, eq=False)
class SetRequest:
    """A parameter set to be computed: all that it is a function of but the series, and what is stored beside it."""

    inputs: Inputs
    profile: VesselProfile
    vessel: str
    #: In the order of the inputs' bounds.
    segment_ids: tuple[str, ...]
    #: Provenance.
    origin: dict[str, Any]
    parent: str | None = None
    #: The set that it brings forward, whole; see `ParameterSet.updates`.
    before: ParameterSet | None = None

    @property
    def spec(self) -> ModelSpec:
        """The model of the inputs."""
        return ModelSpec.model_validate(dict(self.inputs.model_spec))


def as_parameter_set(result: Estimate, request: SetRequest, warnings: tuple[str, ...] = ()) -> ParameterSet:
    """Return the set that an estimate is stored as.

    Parameters
    ----------
    warnings : tuple of str, optional
        Beside the estimate's own.
    """
    spec = request.spec
    return ParameterSet(
        **described(request),
        model_name=spec.name,
        parameters=stored(result.parameters),
        discrete=stored(result.discrete),
        noise=stored(result.noise),
        covariance_names=tuple(HULL_PARAMETERS),
        covariance=tuple(tuple(float(x) for x in row) for row in result.covariance),
        fit=result.fit,
        iterations=list(result.iterations),
        convergence=result.report,
        warnings=(*result.warnings, *warnings, *channel_warnings(request.origin)),
        parent=spec.parent,
    )


def described(request: SetRequest) -> dict[str, Any]:
    """Return the fields of a set that say what it was made from."""
    spec, inputs = request.spec, request.inputs
    return {
        "parameter_set_id": parameter_set_id(inputs),
        "vessel": request.vessel,
        "model_spec": spec.model_dump(mode="json"),
        "model_sha256": spec.sha256,
        "estimator": inputs.estimator,
        "settings": dict(inputs.settings),
        "segment_ids": request.segment_ids,
        "log_ids": inputs.log_ids,
        "start_utc_ns": min(bounds.start_utc_ns for bounds in inputs.bounds),
        "provenance": request.origin,
    }


#: how a warning begins that the channels of a log contradict each other
CHANNELS_OF = "channels of log"


def channel_warnings(origin: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what the channel doctor said of the logs behind a set, as its warnings.

    Parameters
    ----------
    origin : mapping
        Provenance; a set from before there was a doctor has nothing of him.
    """
    by_log = dict(origin.get("channels") or {})
    return tuple(
        f"{CHANNELS_OF} {log[:12]}: {words}; see `kempf doctor {log[:12]}`"
        for log in sorted(by_log)
        for words in by_log[log]
    )


def stored(values: Sequence[Value]) -> tuple[Stored, ...]:
    """Return values in the form in which they are kept."""
    return tuple(Stored(v.name, v.value, v.std, v.unit) for v in values)
