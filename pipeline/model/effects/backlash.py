"""Play between the rudder's sensor and the rudder: hysteresis."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compiled import njit
from kempf.pipeline.model.terms.effect import Effect, Parameter


def rudder_course(time_s: Float, rudder_rad: Float, values: Float) -> Float:
    """Return the rudder behind a play, in whose middle it stood at the first instant.

    Parameters
    ----------
    time_s, rudder_rad : ndarray, shape (n,)
        Evenly spaced; the rudder is linear between them.
    values : ndarray, shape (1,)
        Whole width of the play, rad.

    Returns
    -------
    ndarray, shape (n,)
        What the hull feels, rad.
    """
    width = float(values[0])
    if not width > 0.0 or time_s.size == 0:
        return rudder_rad
    taken: Float = _taken(np.ascontiguousarray(rudder_rad), 0.5 * width)
    return taken


@njit(cache=True, nogil=True)
def _taken(rudder, half):  # type: ignore[no-untyped-def]
    out = np.empty_like(rudder)
    out[0] = rudder[0]
    for k in range(1, rudder.size):
        out[k] = min(max(out[k - 1], rudder[k] - half), rudder[k] + half)
    return out


EFFECT = Effect(
    name="backlash",
    title="backlash in the steering gear",
    group="rudder",
    plain="When the helm turns back, the rudder stands still until the play in its gear is taken up.",
    equation="delta = logged angle within -c/2 .. c/2 of delta: delta stands still; beyond: it is taken along",
    reference=(
        "Visintin 1994, Differential models of hysteresis (the play operator); van Amerongen 1982, Adaptive "
        "steering of ships, thesis, TU Delft"
    ),
    parameters=(Parameter("c", "rad", 0.0, 0.15, (0.01, 0.025, 0.06), "whole width of the play"),),
    rudder_course=rudder_course,
    confounded_with=(
        "dead_time and rudder_lag while the helm moves at one rate; neutral_angle while it moves one way; "
        "rudder_asymmetry"
    ),
    separated_by=(
        "Small and slow rudder movements to both sides, as a 5/5 zigzag or course keeping: a play swallows a "
        "fixed angle, a lag a fixed time."
    ),
)
