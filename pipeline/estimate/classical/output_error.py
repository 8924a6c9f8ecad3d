"""Output error without disturbances: the ship is simulated, and what is left over is white measurement noise.

The likelihood of eq. (16) with no wind and no current is exactly that criterion, so the default estimator is asked for
it. Reference: Ljung (1999), System Identification, 2nd ed., sec. 4.2; Jategaonkar (2015), Flight Vehicle System
Identification, 2nd ed., ch. 4.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from kempf.pipeline.estimate import maximum_likelihood
from kempf.pipeline.estimate.classical.report import disturbed
from kempf.pipeline.estimate.classical.resample import without_means
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.result import Estimate
from kempf.schemas.model_spec import ModelSpec


@dataclass(frozen=True)
class OutputErrorSettings(MaximumLikelihoodSettings):
    """Those of the search for maximum likelihood, and one more."""

    #: Take the means off measurements and rudder first, the usual remedy against what is constant. The heading is then
    #: left out where there is a yaw rate: it is the integral of what lost its mean.
    remove_means: bool = False


def identify(record: Record, spec: ModelSpec, arm_per_m: float, settings: OutputErrorSettings) -> Estimate:
    """Estimate the hull by output error.

    Parameters
    ----------
    spec : ModelSpec
        Its wind and current are left out.
    arm_per_m : float
        Without meaning here: there is no wind.

    Returns
    -------
    Estimate
        Standard errors are right where nothing acts but the ship.
    """
    still = spec.model_copy(update={"wind": "none", "moment": "none", "current": "none"})
    used = _without_means(record) if settings.remove_means else record
    estimate = maximum_likelihood.identify(used, still, arm_per_m, settings)
    if not disturbed(spec):
        return replace(estimate, estimator="output-error")
    unknown = "output-error does not model wind and current; they bias the parameters"
    return replace(estimate, estimator="output-error", warnings=(unknown, *estimate.warnings))


def _without_means(record: Record) -> Record:
    flat = without_means(record)
    if record.used[1] and record.used[2]:
        measured = flat.measured.copy()
        measured[:, 2] = np.nan
        flat = replace(flat, measured=measured)
    return flat
