"""Fitting a model effect by effect: the plain ship first, then one effect more after the other.

Every fit of a model goes this way, in a diagnosis, when an effect is added by hand and when a stored set is built
again, so that all three end at the same bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from kempf.pipeline.diagnose.screening.forward_selection import added
from kempf.pipeline.diagnose.screening.instrument_noise import with_instrument_noise
from kempf.pipeline.diagnose.screening.screen import score
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.maximum_likelihood import STANDARD, MaximumLikelihoodSettings
from kempf.pipeline.estimate.plain_fit import PlainFit, fit_plain
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.schemas.effect import Effect
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import ModelSpec


def staged(
    runs: Sequence[GridRun],
    spec: ModelSpec,
    effects: Sequence[Effect],
    workers: Executor,
    settings: MaximumLikelihoodSettings = STANDARD,
    listener: Listener = SILENT,
) -> tuple[PlainFit, list[PooledFit]]:
    """Fit the plain ship, then with one effect more after the other; each with the noise that the data show.

    Parameters
    ----------
    effects : sequence of Effect
        In the order in which they were added.
    settings : MaximumLikelihoodSettings, optional
        Of the search of single runs.
    listener : Listener, optional
        Notified of every model that is fitted, of its iterations and where they ended.

    Returns
    -------
    plain : PlainFit
    fits : list of PooledFit
        The plain model's first; the last one is the model.

    Raises
    ------
    DataRejected
        ``effect_not_testable``: these runs say nothing of an effect, or a channel measures it already; the
        message says which.
    """
    listener.begins("fitting the plain model")
    plain = fit_plain(runs, spec, workers, settings, listener)
    fits = [with_instrument_noise(plain.fit, workers, listener)]
    listener.fitted(fits[-1].last)
    for effect in effects:
        candidate = score(fits[-1], effect, workers)
        if candidate.missing:
            raise DataRejected(
                "effect_not_testable",
                f"{effect.title} needs the channel {', '.join(candidate.missing)}, which the logs lack.",
                "Log it, or map it in the vessel profile if the log has it under another name.",
                {"effect": effect.name, "missing": list(candidate.missing)},
            )
        if candidate.measured_by:
            raise DataRejected(
                "effect_not_testable",
                f"The logs have {', '.join(candidate.measured_by)}, which measures {effect.title} already.",
                "The model uses that channel; nothing need be added.",
                {"effect": effect.name, "measured_by": list(candidate.measured_by)},
            )
        if np.isnan(candidate.score):
            raise DataRejected(
                "effect_not_testable",
                f"The model as it is absorbs {100 * candidate.absorption:.2f} % of {effect.title}: these data do not "
                "determine its size.",
                effect.separated_by or "Sail another kind of manoeuvre.",
                {"effect": effect.name, "absorption": candidate.absorption},
            )
        listener.begins(f"fitting {effect.name}")
        more = added(fits[-1], candidate, workers, listener=listener)
        fits.append(with_instrument_noise(more, workers, listener))
        listener.fitted(fits[-1].last)
    return plain, fits
