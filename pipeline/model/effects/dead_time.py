"""A dead time between the rudder reading and the rudder that the hull feels."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.terms.effect import Effect, Parameter


def rudder_course(time_s: Float, rudder_rad: Float, values: Float) -> Float:
    """Return the rudder some time ago; before the first instant it stood still.

    Parameters
    ----------
    time_s, rudder_rad : ndarray, shape (n,)
        Evenly spaced; the rudder is linear between them.
    values : ndarray, shape (1,)
        Dead time, s.

    Returns
    -------
    ndarray, shape (n,)
        What the hull feels, rad.
    """
    late = float(values[0])
    if not late > 0.0:
        return rudder_rad
    shifted: Float = np.interp(time_s - late, time_s, rudder_rad)
    return shifted


EFFECT = Effect(
    name="dead_time",
    title="dead time of the rudder",
    group="rudder",
    plain="The rudder does what its reading says, but a fixed time later.",
    equation="delta(t) = delta logged(t - tau)",
    reference=(
        "van Amerongen 1982, Adaptive steering of ships, thesis, TU Delft; Ljung 1999, System identification: "
        "theory for the user"
    ),
    parameters=(
        Parameter("tau", "s", 0.0, 15.0, (0.3, 1.0, 3.0), "time by which the rudder comes later than its reading"),
    ),
    rudder_course=rudder_course,
    confounded_with="rudder_lag, rate_limit, heading_latency, gyro_latency",
    separated_by=(
        "A rudder feedback logged at 1 Hz or faster on the same clock as the heading: its course after an execute "
        "shows whether it waits or creeps."
    ),
)
