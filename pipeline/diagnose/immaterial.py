"""What an effect changes that anybody uses: predictions one leg ahead, and the hull's parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.diagnose.confirm import Confirmation
from kempf.pipeline.diagnose.screen import Candidate
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.pooled_uncertainty import uncertainty_of
from kempf.pipeline.estimate.sensitivity import N_HULL
from kempf.pipeline.shooting.ahead import Ahead
from kempf.pipeline.shooting.paired import paired

#: standard errors by which an effect must change a parameter or a prediction to matter, and least part of the misfit
_MATTERS, _LEAST_PART = 2.0, 0.01


@dataclass(frozen=True, eq=False)
class Weight:
    """How much an effect changes."""

    #: Part by which the error one leg ahead falls, in manoeuvres left out, and that in its standard errors; NaN where
    #: no manoeuvre can be left out.
    fall: float
    t: float
    #: Largest change of a parameter of the hull, standard errors that allow for errors that hang together.
    shift: float

    @property
    def matters(self) -> bool:
        """Whether a prediction or a parameter changes by more than its error."""
        predicts = self.t > _MATTERS and self.fall > _LEAST_PART
        return bool(np.isnan(self.fall) or predicts or self.shift > _MATTERS)


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
        shift = float(np.nanmax(np.abs(fitted.hull - plain.hull) / std, initial=0.0))
    if before is None or after is None:
        return Weight(np.nan, np.nan, shift)
    found = paired(before.left_out, after.left_out)
    return Weight(found.falls_by, found.in_std, shift)
