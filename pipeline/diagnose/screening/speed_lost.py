"""What turning costs a ship of her speed, as far as her log does not show it: considered, not estimated.

The speed that a fit takes for known has the log's noise smoothed away
(`kempf.pipeline.estimate.record.water_speed`). What the ship loses in a turn is then known to a part, the same in all
legs of a manoeuvre, and a log of few readings or much noise may not show it at all. By what is left of it the fit
misses forces that go with v, r and rudder, in every manoeuvre alike: they look like a force that the model lacks. Here
the loss of each manoeuvre is a random number of a known standard error, which is taken out of what its innovations say
(Schmidt 1966, "Application of state-space methods to navigation problems", Advances in Control Systems 3).
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.pooled_fit import Linearised, PooledFit
from kempf.pipeline.estimate.sensitivity import difference

#: less than this of a standard error says nothing, and the factor below would lose its digits
_NOTHING = 1e-9


@dataclass(frozen=True, eq=False)
class SpeedLost:
    """What a standard error of the loss does to the whitened innovations of each run."""

    #: Shape (2 m,) each; zeros where the log shows the loss.
    columns: tuple[Float, ...]

    def lines(self, lines: Sequence[Linearised]) -> list[Linearised]:
        """Return the runs as they are beside a loss that is not known."""
        return [
            replace(line, u=_beside(column, line.u), J=_beside(column, line.J))
            for line, column in zip(lines, self.columns, strict=True)
        ]

    def beside(self, of_all: Float) -> Float:
        """Return what something does to the innovations of all runs, shape (N,) or (N, c), with the loss not known."""
        ends = np.cumsum([column.size for column in self.columns])
        parts = zip(np.split(of_all, ends[:-1]), self.columns, strict=True)
        return np.concatenate([_beside(column, part) for part, column in parts])


def speed_lost(base: PooledFit, workers: Executor) -> SpeedLost:
    """Return what the loss that the logs do not show may do.

    Parameters
    ----------
    base : PooledFit
        Linearised where it stands.
    workers : Executor
        Runs share it; nothing depends on it.
    """
    return SpeedLost(tuple(workers.map(lambda number: _column(base, number), range(len(base.runs)))))


def _column(base: PooledFit, number: int) -> Float:
    filtered, line = base.runs[number], base.linearised[number]
    run, nothing = filtered.run, np.zeros(line.u.size)
    if run.speed_by_turning_m_s is None:
        return nothing
    inputs = run.inputs.copy()
    inputs[:, 0] += run.speed_by_turning_m_s
    slower = replace(filtered, run=replace(run, inputs=inputs))
    passed = slower.run_filter(base.hull, np.exp(base.levels[number]), base.values)
    column = difference(line.passed, passed, 1.0)
    return column if np.all(np.isfinite(column)) else nothing


def _beside(column: Float, part: Float) -> Float:
    """Return a part times the inverse root of I + c c', the covariance of its innovations where c is one of theirs."""
    square = float(column @ column)
    if square < _NOTHING:
        return part
    taken = (1.0 - (1.0 + square) ** -0.5) / square
    result: Float = part - taken * np.multiply.outer(column, column @ part)
    return result
