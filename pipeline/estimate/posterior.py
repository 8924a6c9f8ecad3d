"""What a common fit leaves behind of its runs: a parabola of their log-likelihood about its top.

Beside it the runs need not be filtered again: the next run is fitted together with the parabola, as in a recursive
estimate, where what is known of the parameters is a normal distribution (Ljung 1999, System Identification, sect. 11.2;
Gelman et al. 2013, Bayesian Data Analysis, sect. 4.1 for the approximation).

Two are left. A run is fitted with its instants of measurement as they are logged, and beside it the others count with
theirs as logged, too (decision 0110): hundreds of runs know a hull so well that what the instants of one are off is
many of their standard errors. A parameter set states the other one, with unsure instants free.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.agreement import Agreement
from kempf.pipeline.estimate.pooled_fit import Parabola, PooledFit
from kempf.pipeline.estimate.pooled_uncertainty import PooledUncertainty
from kempf.pipeline.estimate.search.block_arrow import inverse
from kempf.schemas.model_spec import HULL_PARAMETERS


@dataclass(frozen=True, eq=False)
class Posterior:
    """What is known of hull, effects and lasting noise after a common fit of some runs."""

    #: Of the parameters, hull first.
    names: tuple[str, ...]
    #: Shape (q,). Where the log-likelihood is highest with unsure instants of the runs free.
    point: Float
    #: Shape (q, q). Inverse of the expected information there, noise levels and unsure instants unknown.
    covariance: Float
    #: Shapes (q,) and (q, q). The same with the instants as they are logged.
    logged_point: Float
    logged_covariance: Float
    #: Shape (q, q). Of the errors, where prediction errors are not white; else the same.
    stated: Float
    #: ``information`` or ``sandwich``.
    kind: str
    #: How well the runs agree on the ship.
    agreement: Agreement
    #: Of all runs, with the instants as they are logged, at the point of these.
    log_likelihood: float

    @property
    def freed(self) -> Parabola:
        """Of the log-likelihood with unsure instants free."""
        return Parabola(self.point, inverse(self.covariance))

    @property
    def as_logged(self) -> Parabola:
        """Of the log-likelihood with the instants as they are logged."""
        return Parabola(self.logged_point, inverse(self.logged_covariance))

    @property
    def usable(self) -> bool:
        """Whether every parameter is known: one at a bound has no parabola."""
        parts = (self.covariance, self.logged_point, self.logged_covariance, self.stated)
        return all(bool(np.all(np.isfinite(part))) for part in parts)

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return {
            "names": list(self.names),
            "point": self.point.tolist(),
            "covariance": self.covariance.tolist(),
            "logged_point": self.logged_point.tolist(),
            "logged_covariance": self.logged_covariance.tolist(),
            "stated": self.stated.tolist(),
            "kind": self.kind,
            "statistic": self.agreement.statistic,
            "degrees_of_freedom": self.agreement.degrees_of_freedom,
            "log_likelihood": self.log_likelihood,
        }


def from_json(content: Mapping[str, Any]) -> Posterior:
    """Return what `Posterior.as_json` gave; what was not finite, or not stored by an earlier version, is NaN."""

    def array(name: str) -> Float:
        return np.array(content.get(name, np.nan), dtype=np.float64)

    return Posterior(
        tuple(content["names"]),
        *(array("point"), array("covariance"), array("logged_point"), array("logged_covariance"), array("stated")),
        content["kind"],
        Agreement(float(content["statistic"]), int(content["degrees_of_freedom"])),
        float(content["log_likelihood"]),
    )


def posterior_of(
    logged: PooledFit,
    fit: PooledFit,
    uncertainty: PooledUncertainty,
    agreement: Agreement,
    log_likelihood: float,
    late: Float | float = 0.0,
) -> Posterior:
    """Return what a fit leaves behind.

    Parameters
    ----------
    logged : PooledFit
        With the instants of measurement as they are logged.
    fit : PooledFit
        With unsure instants free.
    uncertainty : PooledUncertainty
        Its errors, not widened by what the runs disagree about, with those of instants.
    agreement : Agreement
        Of all runs that it rests on.
    log_likelihood : float
        Of all of them.
    late : ndarray, shape (q, q), optional
        What is not known of instants adds to the covariance: beside unsure instants the runs say that much less.
    """
    return Posterior(
        (*HULL_PARAMETERS, *fit.model.names),
        *(fit.parameters, fit.covariance + late),
        *(logged.parameters, logged.covariance),
        *(uncertainty.covariance, uncertainty.kind),
        agreement,
        log_likelihood,
    )
