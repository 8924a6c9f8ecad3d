"""Clocks against each other: what a lag between two channels, and its growth, say of the clocks behind them.

The lag comes from the comparison of their motions (`pipeline.channels.doctor.align`); how much of it a ship may cause
is for the check that asks.
"""

from __future__ import annotations

from kempf.pipeline.channels.doctor.align import Alignment
from kempf.pipeline.channels.doctor.faults import Fault
from kempf.pipeline.channels.doctor.outcome import CheckFigure, Outcome, untestable, worst
from kempf.pipeline.channels.series import Series
from kempf.schemas.units import SECOND_NS

#: Over a whole log two clocks may drift apart by so much, s: less is no gross fault.
_DRIFT_S = 1.0
#: Motions that leave more than this over have no lag to speak of, and a lag that the usual one does nearly as well as.
_TOGETHER, _NO_BETTER = 0.35, 0.8
#: A lag so short is within the reach of its own standard error, s.
_SHORT_S = 3.0


def clock_figures(
    alignment: Alignment, lags_s: tuple[float, float], over: Series, own_s: float = 0.0
) -> tuple[CheckFigure, CheckFigure]:
    """Return the lag and its growth with what sound clocks give.

    Parameters
    ----------
    lags_s : (float, float)
        Lags that the ship, the filters and the sampling explain, s.
    over : Series
        That the log lasts as long as.
    own_s : float, optional
        By how much the lag may differ from manoeuvre to manoeuvre for reasons of the ship's own, s.
    """
    span = float(over.time_utc_ns[-1] - over.time_utc_ns[0]) / SECOND_NS
    # one kind of manoeuvre at the beginning and another at the end look like twice as much over the whole
    drift = (_DRIFT_S + 2.0 * own_s) / max(span, 1.0)
    return (
        CheckFigure("lag", alignment.lag_s, alignment.lag_std_s, *lags_s, "s"),
        CheckFigure("growth of the lag", alignment.rate, alignment.rate_std, -drift, drift, "s/s"),
    )


def clock_outcome(
    name: str,
    sides: tuple[tuple[str, ...], tuple[str, ...]],
    alignment: Alignment,
    figures: tuple[CheckFigure, CheckFigure],
    also: tuple[Fault, ...] = (),
) -> Outcome:
    """Judge two clocks by the lag of the second side behind the first and its growth.

    Parameters
    ----------
    name : str
        Of the check.
    sides : (tuple of str, tuple of str)
        Channels of the first and of the second instrument.
    alignment : Alignment
        Of their motions.
    figures : (CheckFigure, CheckFigure)
        From `clock_figures`.
    also : tuple of Fault, optional
        What looks like a lag and is none.
    """
    channels = (*sides[0], *sides[1])
    if max(alignment.left_over, alignment.varying) > _TOGETHER:
        return untestable(name, channels, "the two motions are not correlated, so no lag can be determined")
    lag, growth = figures
    far = max(lag.low - lag.value, lag.value - lag.high)
    if far > _SHORT_S and alignment.explains > _NO_BETTER:
        return untestable(name, channels, "no lag fits clearly better than the usual one")
    words = (
        f"lag of {' and '.join(sides[1])} behind {' and '.join(sides[0])}: {lag.value:.2f} ± {lag.std:.2g} s in the "
        f"middle of the log, growing by {growth.value:.2g} ± {growth.std:.1g} s per second (1 s.e.)"
    )
    first, second = sides
    suspects = (
        *_late(first, -lag.value, lag.std),
        *_late(second, lag.value, lag.std),
        Fault("clock_scale", second, growth.value, "clock", growth.std, simplicity=2),
        Fault("clock_scale", first, -growth.value, "clock", growth.std, simplicity=2),
        *also,
    )
    state = worst([lag.state, growth.state])
    return Outcome(name, channels, state, words, figures, alignment.left_over, suspects)


def _late(channels: tuple[str, ...], lag_s: float, std: float) -> list[Fault]:
    return [Fault("latency", channels, lag_s, "late" if lag_s > 0 else "early", std)]
