"""What is known of the errors of a pooled fit, as its parameter set states them."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

from kempf.flows.process.cores import usable
from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.unsure_instants import with_instants
from kempf.pipeline.estimate.agreement import Agreement
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.pooled_uncertainty import PooledUncertainty


@dataclass(frozen=True, eq=False)
class FitErrors:
    """What is known of the errors of a fit, before what the runs disagree about widens them."""

    #: The fit as it is stated: instants of measurement that are not quite known are free.
    fit: PooledFit
    known: PooledUncertainty
    #: Shape (6 + p, 6 + p). What is not known of the instants adds.
    late: Float
    #: Whether the model has effects: their diagnosis widens the first alone.
    of_effects: bool

    @property
    def together(self) -> PooledUncertainty:
        """Both."""
        return replace(self.known, covariance=self.known.covariance + self.late)

    def widened(self, agreement: Agreement) -> PooledUncertainty:
        """Return both, wider by what the runs disagree about."""
        if self.of_effects:
            return replace(self.known, covariance=self.known.covariance * agreement.widened**2 + self.late)
        both = self.together
        return replace(both, covariance=both.covariance * agreement.widened**2)


def errors_of(fit: PooledFit, known: PooledUncertainty, step: Float | float = 0.0) -> FitErrors:
    """Return a fit and its errors, instants free; those of a model with effects are the ones that its diagnosis states.

    Parameters
    ----------
    known : PooledUncertainty
        Of all runs, without what is not known of the instants of those that are fitted here.
    step : ndarray, shape (6 + p,), optional
        To the maximum, see `pipeline.diagnose.screening.unsure_instants.with_instants`.
    """
    of_effects = bool(fit.ship.model.effects)
    if of_effects:
        known = replace(known, covariance=fit.covariance, kind="information")
    with ThreadPoolExecutor(max_workers=usable()) as workers:
        instants = with_instants(fit, workers, step)
    return FitErrors(instants.fit, known, instants.covariance, of_effects)
