"""The model of a ship whose person names none: what acts beside the rudder at sea, on a pond and in a towing tank.

What is stated in seconds for one ship holds for another in lengths sailed, so that the rates of a model test are those
of its own length and speed.
"""

from __future__ import annotations

from math import log10, sqrt

from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile

#: Rates in V/L: what a model in a tank does beside the linear model, from the zigzags of the KVLCC2 (0.333 1/s at a
#: length of 7.0 m and 1.179 m/s); the yaw acceleration at sea, from 1/30 1/s of the Mariner (160.93 m, 7.72 m/s).
_TANK_RATE, _SEA_MOMENT_RATE = 0.333 * 7.0 / 1.179, 160.93 / 7.72 / 30.0

#: Froude number where the profile has no speed: that of the KVLCC2 model.
_FROUDE, _GRAVITY_M_S2 = 1.179 / sqrt(9.81 * 7.0), 9.81

#: V/L of the KVLCC2 model, 1/s, where the profile has no length either.
_MODEL_PER_S = 1.179 / 7.0


def default_model(profile: VesselProfile) -> ModelSpec:
    """Return the model that is identified where no other is named.

    Parameters
    ----------
    profile : VesselProfile
        ``surroundings`` choose the model; ``length_m`` and ``trial_speed_m_s`` the rates of a model test.

    Returns
    -------
    ModelSpec
        ``sea``: all defaults. ``pond``: wind, and no current. ``tank``: neither; force and moment are what the ship
        does beside the linear model, and the rudder stands in the race of a propeller at constant speed.

    Examples
    --------
    >>> default_model(VesselProfile()) == ModelSpec()
    True
    >>> tank = default_model(VesselProfile(surroundings="tank", length_m=7.0, trial_speed_m_s=1.179))
    >>> tank.current, tank.wind_correlation_rate_per_s
    ('none', 0.333)
    """
    if profile.surroundings == "tank":
        rate = _rounded(_TANK_RATE * _lengths_per_s(profile))
        return ModelSpec(
            name="tank",
            current="none",
            moment="gauss-markov",
            wind_arm_per_m=0.0,
            wind_correlation_rate_per_s=rate,
            moment_correlation_rate_per_s=rate,
            rudder_speed_exponent=1.0,
        )
    if profile.surroundings == "pond":
        rate = _rounded(_SEA_MOMENT_RATE * _lengths_per_s(profile))
        return ModelSpec(name="pond", current="none", moment_correlation_rate_per_s=rate)
    return ModelSpec()


def _lengths_per_s(profile: VesselProfile) -> float:
    """Return V/L, 1/s."""
    if profile.length_m is None:
        return _MODEL_PER_S
    return (profile.trial_speed_m_s or _FROUDE * sqrt(_GRAVITY_M_S2 * profile.length_m)) / profile.length_m


def _rounded(rate_per_s: float) -> float:
    """Return a rate to three digits: no more is known of it, and a speed written otherwise makes no other model."""
    return round(rate_per_s, 2 - int(log10(rate_per_s) // 1))
