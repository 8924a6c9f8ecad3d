"""Whether several runs share one set of parameters, and how much wider errors are where they do not.

Every run has its own say on what is shared: its score there, beyond its own noise levels. Where one set is true for
all, the sum of their squares over their information is chi-squared; where the runs pull apart, as with a sea that
comes from elsewhere on another day or an effect that the model lacks, it is larger, and standard errors are to be
widened by as much (Birge 1932, Physical Review 40).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float, Mask
from kempf.pipeline.distributions import chi2_tail
from kempf.pipeline.estimate.pooled_fit import Linearised, PooledFit
from kempf.pipeline.estimate.search.block_arrow import inverse
from kempf.schemas.model_spec import N_HULL

#: with a smaller probability under one set of parameters the runs are said not to share it
LEVEL = 0.01
#: eigenvalues of a run's information, scaled to a unit diagonal, below this are nothing that it has a say on
_NOTHING = 1e-8


@dataclass(frozen=True)
class Agreement:
    """What runs say of one set of parameters."""

    #: Chi-squared with ``degrees_of_freedom`` where they share it.
    statistic: float
    degrees_of_freedom: int

    @property
    def p_value(self) -> float:
        """Probability of a statistic as large where the runs share their parameters."""
        return chi2_tail(self.statistic, self.degrees_of_freedom) if self.degrees_of_freedom > 0 else 1.0

    @property
    def widened(self) -> float:
        """Factor by which what the runs disagree about widens standard errors: Birge's ratio, at least 1.

        There is no threshold (decision 0079): runs that pull apart by a fifth more than their errors say prove
        nothing, and their errors are too small by a fifth all the same.
        """
        if self.degrees_of_freedom <= 0:
            return 1.0
        return float(np.sqrt(max(self.statistic / self.degrees_of_freedom, 1.0)))


def agreement_of(fit: PooledFit) -> Agreement:
    """Return how well the runs of a fit agree on hull and effects, to first order in what each would change of them.

    Parameters that ended at a bound are held. How much lasting noise her instruments have a run may see as it likes.
    """
    movable = np.isfinite(np.diag(fit.covariance))
    free = movable & np.concatenate([np.ones(N_HULL, dtype=np.bool_), fit.model.of_ship])
    statistic, count = 0.0, 0
    for line in fit.linearised:
        score, information = _of_shared(line, free, movable)
        scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
        size, along = np.linalg.eigh(information * np.outer(scale, scale))
        known = size > _NOTHING
        statistic += float(np.sum((along.T @ (score * scale))[known] ** 2 / size[known]))
        count += int(np.count_nonzero(known))
    return Agreement(statistic, count - int(np.count_nonzero(free)))


def _of_shared(line: Linearised, free: Mask, movable: Mask) -> tuple[Float, Float]:
    """Return score and information of a run on ``free`` parameters, beyond its own levels and what else is movable."""
    common = [k for k, i in enumerate(line.index) if i < free.size and free[i]]
    own = [k for k, i in enumerate(line.index) if i >= free.size or (movable[i] and not free[i])]
    shared, beside = line.J[:, common], line.J[:, own]
    # what of the shared columns none of a run's own can do
    alone: Float = shared - beside @ (inverse(beside.T @ beside) @ (beside.T @ shared))
    return alone.T @ line.u, alone.T @ alone
