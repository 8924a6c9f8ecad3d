"""How a measured manoeuvre began, and which steady wind acted on it, as the filter of a model finds both."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kempf.pipeline.estimate.filtered import Passed, RunFilter
from kempf.pipeline.manoeuvre.ship import Start
from kempf.pipeline.model.chain import F, R, V

#: parts of a manoeuvre, none longer than a leg: what changes within one averages out
_PARTS = 16
#: a force that changes faster is no wind that is steady over a manoeuvre
_STEADY_PER_S = 0.01


def start_of(run: RunFilter, passed: Passed | None, at_s: float, rudder_rad: float | None) -> tuple[Start, Start]:
    """Return with which speed, drift, turn and rudder a manoeuvre began, and standard errors as the filter has them.

    Parameters
    ----------
    run : RunFilter
    passed : Passed or None
        The run passed through the filter; None where it could not be: then the speed alone is known.
    at_s : float
        The first execute, seconds from the beginning of the run.
    rudder_rad : float or None
        Before it.
    """
    speed = float(np.interp(at_s, run.run.time_s, run.run.speed_m_s))
    if passed is None or not np.all(np.isfinite(passed.states)):
        return Start(forward_m_s=speed), Start()
    lateral, rate = (float(np.interp(at_s, run.run.time_s, passed.states[:, i])) for i in (V, R))
    errors = (float(np.sqrt(np.interp(at_s, run.run.time_s, passed.spread[:, i]))) for i in (V, R))
    return Start(speed, lateral, rate, rudder_rad), Start(None, *errors)


def usual_force(winds: Sequence[tuple[float, float]]) -> float:
    """Return the root mean square of steady wind forces, m/s^2, each given with its standard error; 0 of none."""
    # one that could not be passed says nothing
    steady = [force for force, std in winds if std > 0.0]
    return float(np.sqrt(np.mean(np.square(steady)))) if steady else 0.0


def steady_wind(run: RunFilter, passed: Passed) -> tuple[float, float]:
    """Return the wind force that the filter comes to in a manoeuvre, m/s^2, and how far that of a leg is from it.

    Both are 0 where the model's force is no steady wind.
    """
    if run.spec.wind == "none" or run.spec.wind_correlation_rate_per_s > _STEADY_PER_S:
        return 0.0, 0.0
    # the first half is what it takes to find it; in its first legs it was as far from there as in any other
    late = slice(len(passed.states) // 2, None)
    force, spread = float(np.mean(passed.states[late, F])), float(np.mean(passed.spread[late, F]))
    legs = np.array_split(passed.states[:, F] - force, _PARTS)[1:]
    wander = float(np.mean([np.mean(leg) ** 2 for leg in legs]))
    within = float(np.mean([np.mean(leg**2) for leg in legs]))
    # an error of the filter changes as quickly as the force that it follows
    std = float(np.sqrt(wander + spread * (wander / within if within > 0.0 else 1.0)))
    return (force, std) if np.isfinite(force + std) else (0.0, 0.0)
