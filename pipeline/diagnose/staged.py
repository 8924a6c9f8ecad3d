"""Fitting a model effect by effect: the plain ship first, each effect from where the score says it lies.

Every fit of a model goes this way, in a diagnosis, when an effect is added by hand and when a stored set is built
again, so that all three end at the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from pipeline.diagnose import pooled_fit
from pipeline.diagnose.gate import without_gross_errors
from pipeline.diagnose.pooled_fit import Fit
from pipeline.diagnose.run import Run
from pipeline.diagnose.screen import Candidate, score
from pipeline.diagnose.start import Start
from pipeline.model.augmented import Augmented
from pipeline.model.terms.effect import Effect
from pipeline.normalise.series import Float
from schemas.errors import DataRejected
from schemas.model_spec import ModelSpec


def plain(runs: Sequence[Run], spec: ModelSpec, start: Start, workers: Executor) -> tuple[Fit, int]:
    """Fit eq. (16), take gross errors out, fit again.

    Returns
    -------
    fit : Fit
    gross_errors : int
    """
    found = pooled_fit.fit(Augmented(), runs, spec, start.hull, start.levels, np.zeros(0), workers)
    cleaned, gross = without_gross_errors(found)
    if gross:
        found = pooled_fit.fit(Augmented(), cleaned, spec, found.hull, found.levels, np.zeros(0), workers)
    return found, gross


def added(base: Fit, candidate: Candidate, workers: Executor) -> Fit:
    """Fit a model with one effect more.

    Parameters
    ----------
    base : Fit
    candidate : Candidate
        Of the screen beside ``base``.
    workers : Executor
    """
    model = base.model.with_effect(candidate.effect)
    return pooled_fit.with_model(base, model, np.concatenate([base.values, _begin(candidate)]), workers)


def _begin(candidate: Candidate) -> Float:
    """Where to start: at the expected change, inside the bounds; a threshold from where it was tried."""
    parameters = candidate.effect.parameters
    inside = np.clip(candidate.change, [p.low for p in parameters], [p.high for p in parameters])
    # at 0 a threshold has no slope of its own
    if len(parameters[0].steps) > 1 and inside[0] <= 0.0 <= parameters[0].low + 0.0:
        inside[0] = candidate.steps[0]
    return np.asarray(inside, dtype=np.float64)


def staged(
    runs: Sequence[Run], spec: ModelSpec, start: Start, effects: Sequence[Effect], workers: Executor
) -> tuple[list[Fit], int]:
    """Fit the plain ship, then with one effect more after the other.

    Parameters
    ----------
    runs : sequence of Run
    spec : ModelSpec
    start : Start
    effects : sequence of Effect
        In the order in which they were added.
    workers : Executor

    Returns
    -------
    fits : list of Fit
        The last one is the model.
    gross_errors : int

    Raises
    ------
    DataRejected
        ``effect_not_testable``: nothing can be told of an effect from these runs; the message says why.
    """
    first, gross = plain(runs, spec, start, workers)
    fits = [first]
    for effect in effects:
        candidate = score(fits[-1], effect)
        if candidate.missing:
            raise DataRejected(
                "effect_not_testable",
                f"{effect.title} needs the channel {', '.join(candidate.missing)}, which the logs lack.",
                "Log it, or map it in the vessel profile if the log has it under another name.",
                {"effect": effect.name, "missing": list(candidate.missing)},
            )
        if np.isnan(candidate.score):
            raise DataRejected(
                "effect_not_testable",
                f"What the model has already imitates {100 * candidate.absorption:.2f} % of {effect.title}: these data "
                "cannot tell its size.",
                effect.separated_by or "Sail another kind of manoeuvre.",
                {"effect": effect.name, "absorption": candidate.absorption},
            )
        fits.append(added(fits[-1], candidate, workers))
    return fits, gross
