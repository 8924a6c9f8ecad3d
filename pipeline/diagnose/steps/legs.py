"""Sums over stretches of a leg: statistics whose errors are honest where prediction errors hang together.

One step ahead a log holds thousands of errors, and where a model lacks something they are not independent. Summed over
stretches about a leg long they nearly are, and the spread of the sums is the statistic's own error (Carlstein 1986,
"The use of subseries values", Annals of Statistics 14). For two models that are not nested it is the test of Vuong
(1989), "Likelihood ratio tests for model selection and non-nested hypotheses", Econometrica 57.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.screen import Candidate
from kempf.pipeline.estimate.pooled_fit import PooledFit

Rows = NDArray[np.int64]


def in_std(sums: Float) -> float:
    """Return the sum of independent contributions in its standard errors; 0 for fewer than two.

    Parameters
    ----------
    sums : ndarray, shape (s,)
    """
    if sums.size < 2:
        return 0.0
    error = float(np.sqrt(sums.size) * np.std(sums, ddof=1))
    return float(np.sum(sums)) / error if error > 0.0 else 0.0


def candidate_in_std(base: PooledFit, candidate: Candidate, leg_s: float) -> float:
    """Return how clearly a candidate shows beside a model, in standard errors that allow for what is misfitted.

    Parameters
    ----------
    candidate : Candidate
        Of the screen beside ``base``.
    leg_s : float
        Length of a stretch, s.
    """
    if not candidate.direction.size:
        return 0.0
    sums, row = [], 0
    for filtered, line in zip(base.runs, base.linearised, strict=True):
        m = line.u.size // 2
        rows = slice(row, row + 2 * m)
        each = candidate.direction[rows] * candidate.innovations[rows]
        sums.append(_summed(each[:m] + each[m:], _stretch(line.passed.innovation, filtered.run.step_s, leg_s)))
        row += 2 * m
    return in_std(np.concatenate(sums))


def ahead_in_std(first: PooledFit, second: PooledFit, leg_s: float) -> float:
    """Return by how many standard errors the second fit's log-likelihood is above the first's.

    Parameters
    ----------
    first, second : PooledFit
        Of the same manoeuvres.
    leg_s : float
        Length of a stretch, s.
    """
    sums = []
    for filtered, a, b in zip(first.runs, first.linearised, second.linearised, strict=True):
        part = _log_likelihood(b.passed.innovation, b.passed.variance)
        part -= _log_likelihood(a.passed.innovation, a.passed.variance)
        sums.append(_summed(part, _stretch(a.passed.innovation, filtered.run.step_s, leg_s)))
    return in_std(np.concatenate(sums))


def _log_likelihood(innovation: Float, variance: Float) -> Float:
    measured = np.isfinite(innovation)
    result: Float = -0.5 * (np.log(variance[measured]) + innovation[measured] ** 2 / variance[measured])
    return result


def _stretch(innovation: Float, step_s: float, leg_s: float) -> Rows:
    """Return the stretch that every measurement belongs to, in the order in which measurements are listed."""
    rows, _ = np.nonzero(np.isfinite(innovation))
    many = max(2, round(innovation.shape[0] * step_s / leg_s))
    stretches: Rows = np.minimum(rows * many // innovation.shape[0], many - 1)
    return stretches


def _summed(values: Float, of: Rows) -> Float:
    return np.asarray(np.bincount(of, values), dtype=np.float64)
