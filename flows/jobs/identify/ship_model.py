"""A stored parameter set as predictions and steering take it: numbers, their covariance, and what had to be assumed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kempf.flows.jobs.identify.leg_fit import fitted_to_legs
from kempf.flows.jobs.identify.loads_of_logs import loads_of_logs
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.plausibility import plausibility_warnings
from kempf.pipeline.model.ship import Hull
from kempf.pipeline.steering.carried import carried, sentences
from kempf.pipeline.steering.motion import ShipEffects
from kempf.pipeline.steering.nomoto import require_numbers
from kempf.pipeline.steering.state_space import NoiseLevels, usual_levels
from kempf.schemas.errors import UsageError
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels
from kempf.warehouse.tables.covariance import covariance_of
from kempf.warehouse.tables.parameter_set import Bounds, ParameterSet, StoredValue

#: noise level of a set by the field of `NoiseLevels` that it is
_LEVELS = {
    "wind_m_s2": "sigma_F",
    "current_m_s": "sigma_V",
    "lateral_speed_m_s": "sigma_v",
    "yaw_rate_rad_s": "sigma_r",
    "heading_rad": "sigma_psi",
}
#: below this part of the usual level an estimated one means zero, and an estimator would trust it blindly; as its
#: gain is a settled one, it has to find force and stream from nothing, however little they change once they are known
_LEAST = {"wind_m_s2": 1.0, "current_m_s": 1.0}
_LEAST_OF_A_MEASUREMENT = 0.02

_FITTED_TO_LEGS = (
    "parameters are those fitted to legs, which predict manoeuvres better than the likelihood's (kempf params show); "
    "noise levels are the likelihood's"
)


@dataclass(frozen=True, eq=False)
class ShipOfSet:
    """What a parameter set says of a ship: by the parameters that predictions of manoeuvres take."""

    parameter_set: ParameterSet
    hull: Hull
    #: None where the model has none.
    effects: ShipEffects | None
    #: Shape (6 + p, 6 + p). Of the six parameters and those of the effects; NaN where unknown.
    covariance: Float
    spec: ModelSpec
    speed_m_s: float
    #: l of eq. (16), 1/m.
    arm_per_m: float
    #: Of the profile.
    length_m: float | None
    #: For an estimator: of the set, and where it has none, the usual ones.
    noise: NoiseLevels
    #: What a linear model about a straight course has not, or not wholly, of the effects.
    remarks: tuple[str, ...]
    #: Factor on the standard errors of parameters fitted to legs, in ``covariance`` already; None where they are the
    #: likelihood's.
    leg_factor: float | None
    #: What the set says against the parameters; of those fitted to legs that they are, and what is implausible about
    #: them in the place of what is about the likelihood's.
    of_parameters: tuple[str, ...]
    #: What speaks against these numbers: the above, what was assumed, and the remarks.
    warnings: tuple[str, ...]

    @property
    def parameters(self) -> tuple[StoredValue, ...]:
        """The parameters of hull and effects, in the order of ``covariance``."""
        held = {p.name: p for p in self.parameter_set.parameters}
        names = [*HULL_PARAMETERS, *(self.effects.model.names if self.effects is not None else ())]
        if self.leg_factor is None:
            return tuple(held[name] for name in names)
        values = [*self.hull.array().tolist(), *(self.effects.values.tolist() if self.effects is not None else ())]
        stds = np.sqrt(np.diag(self.covariance)).tolist()
        return tuple(
            replace(held[name], value=value, std=std) for name, value, std in zip(names, values, stds, strict=True)
        )

    @property
    def effect_parameters(self) -> tuple[StoredValue, ...]:
        """The parameters of the effects, in their order."""
        return self.parameters[len(HULL_PARAMETERS) :]


def ship_of_set(warehouse: Warehouse, parameter_set: ParameterSet, speed_m_s: float | None = None) -> ShipOfSet:
    """Return what a parameter set says of a ship, for steering.

    Parameters
    ----------
    speed_m_s : float, optional
        Speed through the water to work at; by default the mean one of the manoeuvre.

    Raises
    ------
    UsageError
        No speed is known, or it is not positive.
    DataRejected
        The set holds no six finite parameters.
    """
    spec = ModelSpec.model_validate(dict(parameter_set.model_spec))
    speed = speed_m_s if speed_m_s is not None else parameter_set.convergence.get("speed_m_s")
    if speed is None:
        raise UsageError(
            "speed_unknown",
            f"{parameter_set.parameter_set_id} does not say at which speed it was identified.",
            "Give the speed through the water with --speed.",
        )
    by_name = {p.name: p.value for p in parameter_set.parameters if p.value is not None}
    legs = fitted_to_legs(parameter_set)
    own = [by_name.get(name, np.nan) for name in HULL_PARAMETERS] if legs is None else legs[0].tolist()
    hull = Hull(*map(float, own))
    require_numbers(hull, float(speed))
    profile = vessels.get(warehouse, str(parameter_set.provenance["inputs"]["profile_sha256"]))
    arm = spec.wind_arm_per_m if spec.wind_arm_per_m is not None else profile.wind_arm_per_m
    effects = _effects(parameter_set, profile)
    if effects is not None and legs is not None:
        effects = replace(effects, values=legs[1])
    remarks = sentences(carried(hull, effects, float(speed), arm or 0.0))
    noise, assumed = _noise(parameter_set, spec)
    of_parameters = parameter_set.warnings if legs is None else _of_legs(parameter_set, legs)
    warnings = [*of_parameters, *assumed, *remarks]
    if not parameter_set.convergence.get("converged"):
        warnings.insert(0, f"the set did not converge: {parameter_set.convergence.get('reason')}")
    if legs is None:
        covariance = covariance_of(parameter_set, [*HULL_PARAMETERS, *(effects.model.names if effects else ())])
    else:
        covariance = legs[3] ** 2 * legs[2]
    numbers = (float(speed), arm or 0.0, profile.length_m)
    return ShipOfSet(
        *(parameter_set, hull, effects, covariance, spec, *numbers, noise, remarks),
        leg_factor=None if legs is None else legs[3],
        of_parameters=of_parameters,
        warnings=tuple(warnings),
    )


def _of_legs(parameter_set: ParameterSet, legs: tuple[Float, Float, Float, float]) -> tuple[str, ...]:
    """Return the warnings of a set with what is implausible about its hull as fitted to legs."""
    held = {p.name: p for p in parameter_set.parameters}
    hull = np.array([held[name].value for name in HULL_PARAMETERS], dtype=np.float64)
    std = np.array([np.nan if held[name].std is None else held[name].std for name in HULL_PARAMETERS])
    of_likelihood = plausibility_warnings(hull, std, {})
    own = legs[3] * np.sqrt(np.diag(legs[2]))[: len(HULL_PARAMETERS)]
    kept = (warning for warning in parameter_set.warnings if warning not in of_likelihood)
    return (_FITTED_TO_LEGS, *plausibility_warnings(legs[0], own, {}), *kept)


def _effects(parameter_set: ParameterSet, profile: VesselProfile) -> ShipEffects | None:
    """Return the effects of a set as its fit had them."""
    if not parameter_set.model_spec.get("effects"):
        return None
    # compiled code, which a set without effects does without
    from kempf.flows.jobs.identify.standing_model import known_effects, model_of, named
    from kempf.flows.jobs.identify.vessel_runs import LENGTH_M
    from kempf.pipeline.model.effect_model import EffectModel

    spec, own = model_of(parameter_set)
    model = EffectModel(named(spec.effects, known_effects(own)))
    values = {p.name: p.value for p in parameter_set.parameters}
    return ShipEffects(
        model,
        np.array([values[name] for name in model.names]),
        length_m=profile.length_m or LENGTH_M,
        draught_m=profile.draught_m or 1.0,
        day=_last_load(parameter_set),
    )


def _last_load(parameter_set: ParameterSet) -> float:
    """Return how the ship was laden in the last log of a set, which she is taken to be still."""
    inputs = parameter_set.provenance["inputs"]
    named = [("", Bounds(**bounds)) for bounds in inputs["segments"]]
    return list(loads_of_logs(named, inputs.get("draughts_m", {})).values())[-1]


def _noise(parameter_set: ParameterSet, spec: ModelSpec) -> tuple[NoiseLevels, list[str]]:
    levels = _with_what_lasts(
        parameter_set,
        {p.name: p.value for p in parameter_set.noise if "." not in p.name} or _levels_of_runs(parameter_set, spec),
    )
    usual, values, assumed = usual_levels(spec), {}, []
    for field, name in _LEVELS.items():
        standard = float(getattr(usual, field))
        level, least = levels.get(name), standard * _LEAST.get(field, _LEAST_OF_A_MEASUREMENT)
        values[field] = standard if level is None else max(float(level), least)
        if level is None:
            assumed.append(f"{name} is not in the set: {standard:g} assumed for an estimator")
        elif level < least and f"{level:.2g}" != f"{least:.2g}":
            assumed.append(f"{name} is {level:.2g} in the set, too little for an estimator: {least:.2g} taken")
    return NoiseLevels(**values), assumed


def _with_what_lasts(parameter_set: ParameterSet, levels: dict[str, Any]) -> dict[str, Any]:
    """Return noise levels with the variance of what lasts: an estimator that knows no other takes it for fresh."""
    lasting = {p.name: p.value or 0.0 for p in parameter_set.noise}
    pairs = (("sigma_v", "lateral_speed_noise.c"), ("sigma_r", "yaw_rate_noise.c"), ("sigma_psi", "heading_noise.c"))
    more = {
        name: float(np.hypot(levels[name] or 0.0, lasting[c])) for name, c in pairs if name in levels and c in lasting
    }
    return {**levels, **more}


def _levels_of_runs(parameter_set: ParameterSet, spec: ModelSpec) -> dict[str, float]:
    """Return the noise levels of a model with effects, geometric means over its manoeuvres.

    A measurement that no manoeuvre has keeps the level at which the fit began.
    """
    runs = list(dict(parameter_set.convergence.get("levels") or {}).values())
    if not runs:
        return {}
    mean = np.exp(np.mean(np.array(runs, dtype=np.float64), axis=0))
    # intensities of force and current become levels in the long run
    force = float(mean[0] / np.sqrt(2.0 * spec.wind_correlation_rate_per_s))
    stream = float(mean[2] / np.sqrt(2.0 * spec.current_correlation_rate_per_s))
    levels = dict(zip(("sigma_v", "sigma_r", "sigma_psi"), mean[3:].tolist(), strict=True))
    if spec.wind != "none":
        levels["sigma_F"] = force
    if spec.current != "none":
        levels["sigma_V"] = stream
    return levels
