"""The rudder turns no faster than its steering engine can.

The parameter is the time that a radian takes, so that 0 is an engine without limit. The answer to a straight line
between two instants is exact: approach at the full rate, then the line itself, or the full rate again where the line
is too steep.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compiled import njit
from kempf.pipeline.model.terms.effect import Effect, Parameter


def rudder_course(time_s: Float, rudder_rad: Float, values: Float) -> Float:
    """Return the rudder that follows its reading at a limited rate, and stood at it at the first instant.

    Parameters
    ----------
    time_s, rudder_rad : ndarray, shape (n,)
        Evenly spaced; the rudder is linear between them.
    values : ndarray, shape (1,)
        Time for one radian, s/rad.

    Returns
    -------
    ndarray, shape (n,)
        What the hull feels, rad.
    """
    slowness, step = float(values[0]), float(time_s[1] - time_s[0]) if time_s.size > 1 else 0.0
    if not slowness > 0.0 or step == 0.0:
        return rudder_rad
    chased: Float = _chased(np.ascontiguousarray(rudder_rad), step / slowness)
    return chased


@njit(cache=True, nogil=True)
def _chased(rudder, most):  # type: ignore[no-untyped-def]
    """Follow with at most ``most`` a step; a step is one unit of time here, and a rate is an angle a step."""
    out = np.empty_like(rudder)
    out[0] = rudder[0]
    for k in range(1, rudder.size):
        rate, gap, place, left = rudder[k] - rudder[k - 1], rudder[k - 1] - out[k - 1], out[k - 1], 1.0
        if gap != 0.0:
            side = np.sign(gap)
            closing = most - side * rate
            if closing <= 0.0 or abs(gap) >= closing:
                out[k] = place + side * most
                continue
            met = abs(gap) / closing
            place, left = place + side * most * met, 1.0 - met
        out[k] = rudder[k] if abs(rate) <= most else place + np.sign(rate) * most * left
    return out


EFFECT = Effect(
    name="rate_limit",
    title="rate limit of the steering gear",
    group="rudder",
    plain="The rudder turns no faster than its steering engine can, however fast its reading or order moves.",
    equation="|d(delta)/dt| <= 1 / c",
    reference=(
        "van Amerongen 1982, Adaptive steering of ships, thesis, TU Delft; IMO SOLAS II-1 reg. 29 (35 deg to 30 "
        "deg on the other side within 28 s)"
    ),
    parameters=(Parameter("c", "s/rad", 0.0, 120.0, (12.0, 25.0, 45.0), "time that the rudder takes for one radian"),),
    rudder_course=rudder_course,
    confounded_with="rudder_lag, dead_time, rudder_stall",
    separated_by=(
        "A rudder feedback logged at 1 Hz or faster: a limited rudder moves along a straight line, and longer for "
        "a 20/20 than for a 10/10."
    ),
)
