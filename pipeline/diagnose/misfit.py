"""The runs of a diagnosis as the search for where a model fails takes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kempf.pipeline.compare.misfit import where
from kempf.pipeline.diagnose.diagnosis import Diagnosis
from kempf.pipeline.estimate import sensitivity
from kempf.pipeline.estimate.filtered import Filtered
from kempf.pipeline.estimate.levels import fit_levels
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.predict.run_residuals import Looked, PhaseInterval


def where_left(diagnosis: Diagnosis, phases: Mapping[str, Sequence[PhaseInterval]]) -> dict[str, Any] | None:
    """Say where the last model of a diagnosis still fails: on held-out runs, on the fitted ones where none is held out.

    Noise levels are those fitted to each run, held out or not: a noisier sensor is no misfit.

    Parameters
    ----------
    diagnosis : Diagnosis
    phases : mapping of str to sequence of PhaseInterval
        By run; a run without has none.

    Returns
    -------
    dict or None
        As `pipeline.compare.misfit.where`, with ``sample`` (``held_out`` or ``fitted``) and ``beside``, the effects in
        the model; None where the model runs away from every run.
    """
    step = diagnosis.steps[-1]
    fit = step.fit
    if diagnosis.held:
        usual = np.mean(fit.levels, axis=0)
        filtered = [Filtered(run, fit.model, fit.runs[0].spec) for run in diagnosis.held]
        levels = [fit_levels(one, fit.hull, fit.values, usual).levels for one in filtered]
        passed = [
            sensitivity.passed(one, Point(fit.hull, fit.values, own)) for one, own in zip(filtered, levels, strict=True)
        ]
        free = step.held
    else:
        filtered, passed, free = list(fit.runs), [line.passed for line in fit.linearised], step.fitted
    looked = [
        Looked(one, seen, alone, tuple(phases.get(one.run.name, ())))
        for one, seen, alone in zip(filtered, passed, free, strict=True)
        if np.isfinite(seen.log_likelihood)
    ]
    if not looked:
        return None
    told = {"sample": "held_out" if diagnosis.held else "fitted", "beside": [e.name for e in fit.model.effects]}
    return {**told, **where(looked)}
