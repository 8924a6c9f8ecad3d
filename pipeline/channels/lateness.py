"""How late a receiver shows its velocity beside its fixes.

A velocity that the receiver smooths comes late, and adds up to a way that is short by the lateness times the velocity.
The fixes show the whole way. No model of the ship is asked, and a receiver that is late as a whole shows nothing here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.doctor.log import Complex, Velocity
from kempf.pipeline.channels.doctor.robust_regression import fit
from kempf.pipeline.channels.recursion import filtered
from kempf.pipeline.channels.series import Float, Nanoseconds
from kempf.schemas.units import SECOND_NS

#: instants that are needed
_FEWEST = 60
#: gains of the mean that follows what is left: from errors fresh at every instant to errors that add up
_GAINS = (0.01, 0.03, 0.1, 0.3, 1.0)


@dataclass(frozen=True)
class Lateness:
    """By how much a velocity is shown late."""

    #: late_s, std_s: And its standard error, s.
    late_s: float
    std_s: float


def velocity_lateness(track: tuple[Nanoseconds, Complex], velocity: Velocity) -> Lateness | None:
    """Return how much later than the fixes a velocity over ground shows the ship's motion.

    Parameters
    ----------
    track : (ndarray, ndarray), shape (n,)
        Instants, UTC ns, and places, north plus i times east, m.
    velocity : Velocity
        In the earth's frame.

    Returns
    -------
    Lateness or None
        None where the two have too little in common.

    Notes
    -----
    A velocity y that is late by tau adds up to Y = p - tau y. The velocity's scale and zero, towards north and east,
    are regressed beside tau.
    """
    time, place = track
    at, way = _both(time, velocity.time_utc_ns)
    if at.size < _FEWEST or velocity.time_utc_ns.size < _FEWEST:
        return None
    own = _seconds(velocity.time_utc_ns, int(at[0]))
    t = _seconds(at, int(at[0]))
    gone = np.interp(t, own, _total(own, velocity.value.real)) + 1j * np.interp(
        t, own, _total(own, velocity.value.imag)
    )
    shown = np.interp(t, own, velocity.value.real) + 1j * np.interp(t, own, velocity.value.imag)
    left, none = place[way] - gone, np.zeros(at.size)
    north = [shown.real, gone.real, t, none, none]
    east = [shown.imag, none, none, gone.imag, t]
    return _regressed([left.real, left.imag], [np.column_stack(north), np.column_stack(east)])


def _regressed(left: list[Float], columns: list[Float]) -> Lateness | None:
    """Return the first coefficient of what is left by columns, several series below each other.

    Errors of a way partly stay where they are and partly add up: an integrated moving average, whose innovations are
    what a mean that follows with a gain leaves over (Muth 1960, Journal of the American Statistical Association 55).
    """
    best: tuple[float, Float, Float] | None = None
    for gain in _GAINS:
        y = np.concatenate([_innovations(part[:, None], gain)[:, 0] for part in left])
        A = np.concatenate([_innovations(part, gain) for part in columns])
        size = np.linalg.norm(A, axis=0)
        A = A[:, size > 1e-12 * max(float(np.max(size)), 1e-300)]
        missed = float(np.sum((y - A @ np.linalg.lstsq(A, y, rcond=1e-10)[0]) ** 2))
        if best is None or missed < best[0]:
            best = missed, A, y
    assert best is not None
    line = fit(best[1], best[2])
    return None if line is None else Lateness(float(line.value[0]), float(line.std[0]))


def _innovations(columns: Float, gain: float) -> Float:
    """Return what a mean that follows columns with a gain does not foresee, shape (n - 1, c)."""
    step = np.diff(columns, axis=0)
    return filtered([1.0], [1.0, gain - 1.0], step)


def _both(time: Nanoseconds, other: Nanoseconds) -> tuple[Nanoseconds, slice]:
    """Return those of some instants that lie within others, and where they are."""
    if not other.size:
        return time[:0], slice(0, 0)
    first, last = np.searchsorted(time, [other[0], other[-1] + 1])
    return time[first:last], slice(int(first), int(last))


def _total(time_s: Float, rate: Float) -> Float:
    total: Float = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time_s))])
    return total


def _seconds(time: Nanoseconds, origin: int) -> Float:
    seconds: Float = (time - origin).astype(np.float64) / SECOND_NS
    return seconds
