"""The rudder as it acts: in the race of a propeller that keeps turning, its force falls less than with V^2.

With a constant shaft speed the water at the rudder is part ship's speed, part propeller race; as the ship slows in a
turn the race grows stronger. In between lies a force with V to a power below 2. Reference: Yasukawa & Yoshimura
(2015), "Introduction of MMG standard method for ship maneuvering predictions", J. Mar. Sci. Technol. 20.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.record import Instants
from kempf.schemas.model_spec import ModelSpec

_APPROACH_S = 5.0
_SLOWEST = 0.1
#: share of the speed that a run comes to below which it does not begin with the speed of the approach: it begins at
#: rest, out of a turn, or amid a random manoeuvre; quantile that is the speed it comes to
_BEGINS_SLOWER, _REACHED = 0.9, 0.95


def approach_speed(time_s: Float, speed_m_s: Float) -> float:
    """Return the speed of the approach, m/s; of a run that begins slower, the one that it comes to.

    Parameters
    ----------
    time_s, speed_m_s : ndarray, shape (n,)
    """
    approach = float(np.median(speed_m_s[time_s <= time_s[0] + _APPROACH_S]))
    reached = float(np.quantile(speed_m_s, _REACHED))
    return approach if approach > _BEGINS_SLOWER * reached else reached


T = TypeVar("T", bound=Instants)


def with_rudder_inflow(record: T, spec: ModelSpec) -> T:
    """Return the record with the rudder that, through b V^2 delta, does what the true one does in the race.

    Parameters
    ----------
    spec : ModelSpec
        ``rudder_speed_exponent`` n: the force goes with V^n V_0^(2 - n), V_0 the speed of the approach.

    Returns
    -------
    Instants
        The same where n is 2, eq. (16).
    """
    if spec.rudder_speed_exponent == 2.0:
        return record
    approach = approach_speed(record.time_s, record.speed_m_s)
    share = np.maximum(np.abs(record.speed_m_s / approach), _SLOWEST)
    factor = share ** (spec.rudder_speed_exponent - 2.0)
    return replace(
        record,
        rudder_rad=record.rudder_rad * factor,
        rudder_noise_rad_sqrt_s=record.rudder_noise_rad_sqrt_s * factor,
        speed_error=record.speed_error.scaled(factor),
    )
