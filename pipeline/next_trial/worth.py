"""What a planned manoeuvre is worth: how it narrows what is known of the parameters, and whether it parts two models.

To narrow: the expected information of the run, its noise levels unknown, added to what is known (D-optimal design;
Goodwin and Payne 1977, Dynamic System Identification, ch. 6). To part: the log-likelihood by which the true model is
expected to be ahead of the other after that has been fitted to the new run as well as to what is known (T-optimal
design; Atkinson and Fedorov 1975, "The design of experiments for discriminating between two rival models", Biometrika
62). With D twice that, the log-likelihood ratio of the run is normal about D / 2 with variance D.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.distributions import normal_up_to
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.search.block_arrow import inverse
from kempf.pipeline.estimate.sensitivity import Point, active, whitened, with_columns
from kempf.schemas.model_spec import N_HULL

#: so often a manoeuvre may be repeated
_MOST = 64


@dataclass(frozen=True, eq=False)
class Known:
    """What is known of the parameters that a model shares over its runs."""

    #: Which of hull, effects and lasting noise have an error.
    index: tuple[int, ...]
    #: Shape (k, k). Of these.
    covariance: Float


def information(filtered: RunFilter, point: Point) -> Float:
    """Return the expected information of a run on hull and effects, its noise levels unknown, shape (6 + p, 6 + p)."""
    _, columns = with_columns(filtered, point, active(filtered))
    J = np.column_stack(columns)
    whole, shared = J.T @ J, N_HULL + point.values.size
    across, levels = whole[:shared, shared:], whole[shared:, shared:]
    complement: Float = whole[:shared, :shared] - across @ inverse(levels) @ across.T
    return complement


def narrowed(known: Known, information_of_run: Float, times: int = 1) -> Float:
    """Return standard errors after a run has been sailed so many times, as shares of those before, shape (k,)."""
    own = information_of_run[np.ix_(known.index, known.index)]
    after = inverse(inverse(known.covariance) + times * own)
    shares: Float = np.sqrt(np.diag(after) / np.diag(known.covariance))
    return shares


def times_to_halve(known: Known, information_of_run: Float, which: int) -> int | None:
    """Return how often a run must be sailed to halve one standard error; None where that takes more than 64 times.

    Parameters
    ----------
    which : int
        Place in `Known.index`.
    """
    for times in range(1, _MOST + 1):
        if narrowed(known, information_of_run, times)[which] <= 0.5:
            return times
    return None


def apart(filtered: RunFilter, point: Point, known: Known) -> float:
    """Return D: twice the log-likelihood by which this model is expected to fall behind the one that made the run.

    Parameters
    ----------
    filtered : RunFilter
        This model, over a run as the other predicts it, see `kempf.pipeline.next_trial.planned_run.as_predicted`.
    point : Point
        Where this model stands.
    """
    base, columns = with_columns(filtered, point, known.index)
    u = whitened(base)
    m = u.size // 2
    # the mean of what is measured differs, its spread hardly
    z = u[:m]
    J = np.column_stack(columns)[:m]
    pull = J.T @ z
    left = float(z @ z - pull @ inverse(J.T @ J + inverse(known.covariance)) @ pull)
    return max(left, 0.0)


def probability(D: float, window: float) -> float:
    """Return the probability that a run puts the true model ahead by so much of twice the log-likelihood."""
    return float(normal_up_to((0.5 * D - 0.5 * window) / np.sqrt(D))) if D > 0.0 else 0.0
