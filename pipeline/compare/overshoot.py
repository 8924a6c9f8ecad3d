"""Overshoot angles, measured and predicted by the free run.

The rudder is the logged one, so that the predicted ship is not at the switching heading when it is laid over. What is
compared is the heading still gained from the execute to the turning point (ITTC 7.5-04-02-01), both read from the same
grid; the predicted overshoot is the measured one plus their difference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float


@dataclass(frozen=True)
class StoredOvershoot:
    """One overshoot as the segment has it, times from the first instant of the run."""

    number: int
    #: Where the heading went, +1 starboard.
    side: int
    #: execute_s, until_s: The execute, and the next one or the end.
    execute_s: float
    until_s: float
    overshoot_deg: float


@dataclass(frozen=True)
class OvershootError:
    """One overshoot, measured and predicted, deg."""

    number: int
    side: int
    measured_deg: float
    #: predicted_deg, error_deg: Predicted, and predicted less measured; None where the predicted ship does not turn
    #: back in time.
    predicted_deg: float | None
    error_deg: float | None


def compare_overshoots(
    time_s: Float, measured: Float, predicted: Float, turns: Sequence[StoredOvershoot]
) -> tuple[OvershootError, ...]:
    """Compare the overshoots of a run.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
    measured, predicted : ndarray, shape (n,)
        Heading, rad, unwrapped; the measured one NaN where there is none.
    """
    known = np.isfinite(measured)
    errors = []
    for turn in turns:
        gained = [
            _gain(time, heading, turn)
            for time, heading in ((time_s[known], measured[known]), (time_s, predicted))
            if time.size
        ]
        error = None
        if len(gained) == 2 and gained[0] is not None and gained[1] is not None:
            error = float(np.rad2deg(gained[1] - gained[0]))
        predicted_deg = None if error is None else turn.overshoot_deg + error
        errors.append(OvershootError(turn.number, turn.side, turn.overshoot_deg, predicted_deg, error))
    return tuple(errors)


def _gain(time: Float, heading: Float, turn: StoredOvershoot) -> float | None:
    """Return what the heading gains from the execute to its turning point, rad; None where it does not turn back."""
    inside = np.flatnonzero((time > turn.execute_s) & (time < turn.until_s))
    if inside.size < 3:
        return None
    y = turn.side * heading[inside]
    at = int(np.argmax(y))
    if at == y.size - 1:
        return None
    start = float(turn.side * np.interp(turn.execute_s, time, heading))
    if at == 0:
        return float(y[0]) - start
    # the parabola through the highest three
    left, middle, right = y[at - 1 : at + 2]
    bend = left - 2.0 * middle + right
    top = middle - (right - left) ** 2 / (8.0 * bend) if bend < 0.0 else middle
    return float(top) - start


def turns_of(
    overshoots: Sequence[tuple[int, int, float, float]], executes_s: Sequence[float], end_s: float
) -> tuple[StoredOvershoot, ...]:
    """Return the overshoots with the executes between which they lie.

    Parameters
    ----------
    overshoots : sequence of (int, int, float, float)
        Number, side, instant of the turning point in s, overshoot in deg.
    end_s : float
        Of the segment.
    """
    turns = []
    for number, side, peak_s, overshoot_deg in overshoots:
        before = [t for t in executes_s if t < peak_s]
        if before:
            after = [t for t in executes_s if t > peak_s]
            turns.append(StoredOvershoot(number, side, max(before), min([*after, end_s]), overshoot_deg))
    return tuple(turns)
