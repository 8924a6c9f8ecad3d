"""What an effect changes that anybody uses: predictions one leg ahead, and the hull's parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.diagnose.screening.screen import Candidate
from kempf.pipeline.diagnose.steps.confirm import Confirmation
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.pooled_uncertainty import uncertainty_of
from kempf.pipeline.shooting.ahead import Ahead
from kempf.pipeline.shooting.paired import paired
from kempf.schemas.model_spec import N_HULL

#: part of the misfit one leg ahead by which it must fall with an effect that is certain, for that to matter
LEAST_PART = 0.02
#: or part by which a parameter of the hull must move, and standard errors
LEAST_SHIFT, _MOVES = 0.03, 2.0


@dataclass(frozen=True, eq=False)
class Weight:
    """How much an effect changes."""

    #: Part by which the error one leg ahead falls, in manoeuvres left out, and that in its standard errors; NaN where
    #: no manoeuvre can be left out.
    fall: float
    t: float
    #: Largest change of a parameter of the hull that moves by more than its error, part of it.
    shift: float
    #: Largest of those changes in its standard error, which allows for errors that hang together.
    shift_in_std: float

    @property
    def matters(self) -> bool:
        """Whether predictions or parameters change by what anybody would notice."""
        moves = self.shift > LEAST_SHIFT and self.shift_in_std > _MOVES
        return bool(np.isnan(self.fall) or self.fall > LEAST_PART or moves)


@dataclass(frozen=True, eq=False)
class Immaterial:
    """An effect that is certain and changes neither a prediction nor a parameter by more than its error."""

    #: It and what looks like it, itself first.
    chosen_from: tuple[tuple[Candidate, Confirmation], ...]
    weight: Weight


def weighed(before: Ahead | None, after: Ahead | None, plain: PooledFit, fitted: PooledFit) -> Weight:
    """Return how much an effect changes.

    Parameters
    ----------
    before, after : Ahead or None
        Without and with it one leg ahead.
    plain, fitted : PooledFit
        Without and with it by likelihood.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        std = np.sqrt(np.diag(uncertainty_of(fitted).covariance))[:N_HULL]
        moved = np.abs(fitted.hull - plain.hull)
        known = np.abs(fitted.hull) > 3.0 * std
        in_std = np.where(known, moved / std, 0.0)
        part = np.where(known & (in_std > _MOVES), moved / np.abs(fitted.hull), 0.0)
    shift = (float(np.max(part, initial=0.0)), float(np.max(in_std, initial=0.0)))
    if before is None or after is None:
        return Weight(np.nan, np.nan, *shift)
    comparison = paired(before.left_out, after.left_out)
    return Weight(comparison.falls_by, comparison.in_std, *shift)
