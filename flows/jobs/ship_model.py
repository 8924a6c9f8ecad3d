"""A stored parameter set as `pipeline.steering` takes it: numbers with their covariance, and what had to be assumed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.ship import Hull
from kempf.pipeline.steering.nomoto import require_numbers
from kempf.pipeline.steering.state_space import NoiseLevels, usual_levels
from kempf.schemas.errors import UsageError
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec
from kempf.warehouse import parameter_sets, vessels
from kempf.warehouse.parameter_set import ParameterSet
from kempf.warehouse.store import Warehouse

#: noise level of a set by the field of `NoiseLevels` that it is
_LEVELS = {
    "wind_m_s2": "sigma_F",
    "current_m_s": "sigma_V",
    "lateral_speed_m_s": "sigma_v",
    "yaw_rate_rad_s": "sigma_r",
    "heading_rad": "sigma_psi",
}
#: below this part of the usual level an estimated one stands for zero, and an estimator would trust it blindly; as its
#: gain is a settled one, it has to find force and stream from nothing, however little they change once they are known
_LEAST = {"wind_m_s2": 1.0, "current_m_s": 1.0}
_LEAST_OF_A_MEASUREMENT = 0.02


@dataclass(frozen=True, eq=False)
class KnownShip:
    """What a parameter set says of a ship.

    Attributes
    ----------
    parameter_set : ParameterSet
    hull : Hull
    covariance : ndarray, shape (6, 6)
        Of the six parameters; NaN where unknown.
    spec : ModelSpec
    speed_m_s : float
    arm_per_m : float
        l of eq. (16), 1/m.
    length_m : float or None
        Of the profile.
    noise : NoiseLevels
        For an estimator: of the set, and where it has none, the usual ones.
    warnings : tuple of str
        What speaks against these numbers: the set's own, and what was assumed.
    """

    parameter_set: ParameterSet
    hull: Hull
    covariance: Float
    spec: ModelSpec
    speed_m_s: float
    arm_per_m: float
    length_m: float | None
    noise: NoiseLevels
    warnings: tuple[str, ...]


def known_ship(warehouse: Warehouse, set_id: str, speed_m_s: float | None = None) -> KnownShip:
    """Read a parameter set for steering.

    Parameters
    ----------
    warehouse : Warehouse
    set_id : str
        Or a unique beginning of it.
    speed_m_s : float, optional
        Speed through the water to work at; by default the mean one of the manoeuvre.

    Raises
    ------
    NotFound
        There is no such set.
    UsageError
        No speed is known, or it is not positive.
    DataRejected
        The set holds no six finite parameters.
    """
    one = parameter_sets.get(warehouse, set_id)
    spec = ModelSpec.model_validate(dict(one.model_spec))
    told = speed_m_s if speed_m_s is not None else one.convergence.get("speed_m_s")
    if told is None:
        raise UsageError(
            "speed_unknown",
            f"{one.parameter_set_id} does not say at which speed it was identified.",
            "Give the speed through the water with --speed.",
        )
    by_name = {p.name: p.value for p in one.parameters if p.value is not None}
    hull = Hull(*(float(by_name.get(name, np.nan)) for name in HULL_PARAMETERS))
    require_numbers(hull, float(told))
    profile = vessels.get(warehouse, str(one.provenance["inputs"]["profile_sha256"]))
    arm = spec.wind_arm_per_m if spec.wind_arm_per_m is not None else profile.wind_arm_per_m
    noise, assumed = _noise(one, spec)
    warnings = [*one.warnings, *assumed]
    if not one.convergence.get("converged"):
        warnings.insert(0, f"the set did not converge: {one.convergence.get('reason')}")
    return KnownShip(
        one, hull, _covariance(one), spec, float(told), arm or 0.0, profile.length_m, noise, tuple(warnings)
    )


def _covariance(one: ParameterSet) -> Float:
    """Pick the six parameters out of the covariance; NaN for what it does not hold."""
    found = np.full((6, 6), np.nan)
    names = list(one.covariance_names)
    held = [(i, names.index(name)) for i, name in enumerate(HULL_PARAMETERS) if name in names]
    for i, row in held:
        for j, column in held:
            found[i, j] = one.covariance[row][column]
    return found


def _noise(one: ParameterSet, spec: ModelSpec) -> tuple[NoiseLevels, list[str]]:
    levels = {p.name: p.value for p in one.noise}
    usual, values, assumed = usual_levels(spec), {}, []
    for field, name in _LEVELS.items():
        standard = float(getattr(usual, field))
        level, least = levels.get(name), standard * _LEAST.get(field, _LEAST_OF_A_MEASUREMENT)
        values[field] = standard if level is None else max(float(level), least)
        if level is None:
            assumed.append(f"{name} is not in the set: {standard:g} assumed for an estimator")
        elif level < least:
            assumed.append(f"{name} is {level:.2g} in the set: {least:.2g} taken, an estimator finds it from nothing")
    return NoiseLevels(**values), assumed
