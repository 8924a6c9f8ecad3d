"""How much a disturbance of eq. (16) changes within a time, by its level in the long run and the rate it forgets at.

Of a disturbance that forgets slowly a trial shows the change, not the level: sigma^2 mu is determined, neither alone.
"""

from __future__ import annotations

from math import expm1, sqrt


def change_within(level: float, time_s: float, rate_per_s: float) -> float:
    """Return the standard deviation of the change of a Gauss-Markov process within a time.

    Parameters
    ----------
    level : float
        Standard deviation of the process in the long run, sigma of eq. (16).
    rate_per_s : float
        mu of eq. (16).

    Returns
    -------
    float
        In the unit of ``level``: sigma sqrt(2 (1 - exp(-mu T))), which is sigma sqrt(2 mu T) for a short time.

    References
    ----------
    Gelb, ed. (1974), Applied Optimal Estimation, sect. 3.8.

    Examples
    --------
    >>> round(change_within(0.01, 600.0, 1e-5), 5), round(change_within(0.01, 1e9, 1e-5), 5)
    (0.00109, 0.01414)
    """
    return level * sqrt(-2.0 * expm1(-rate_per_s * time_s))


def level_of_change(change: float, time_s: float, rate_per_s: float) -> float:
    """Return the level, sigma of eq. (16), of a process that changes by so much within a time.

    The inverse of `change_within`; its reference holds.

    Examples
    --------
    >>> round(level_of_change(change_within(0.2, 60.0, 1e-3), 60.0, 1e-3), 12)
    0.2
    """
    return change / sqrt(-2.0 * expm1(-rate_per_s * time_s))
