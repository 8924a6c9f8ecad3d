"""Where the models of a diagnosis fail."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from kempf.pipeline.compare.misfit import where
from kempf.pipeline.diagnose.evidence.judged_run import JudgedRun, judged_fitted, judged_held_out
from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis
from kempf.pipeline.predict.run_residuals import PhaseInterval


def where_left(diagnosis: Diagnosis, phases: Mapping[str, Sequence[PhaseInterval]]) -> dict[str, Any] | None:
    """Say where the last model of a diagnosis still fails: on held-out runs, on the fitted ones where none is held out.

    Parameters
    ----------
    phases : mapping of str to sequence of PhaseInterval
        By run; a run without has none.

    Returns
    -------
    dict or None
        As `pipeline.compare.misfit.where`, with ``sample`` (``held_out`` or ``fitted``) and ``beside``, the effects in
        the model; None where the model runs away from every run.
    """
    step = diagnosis.steps[-1]
    by_legs = step.shown_by_legs
    if diagnosis.held:
        judged = judged_held_out(step, diagnosis.held, phases, by_legs=by_legs)
    else:
        judged = judged_fitted(step, phases, by_legs=by_legs)
    places = misfit_of(judged)
    if not places:
        return None
    sample = "held_out" if diagnosis.held else "fitted"
    return {"sample": sample, "beside": [e.name for e in step.fit.model.ship.effects], **places}


def misfit_of(judged: Sequence[JudgedRun]) -> dict[str, Any]:
    """Say where a model fails, as `pipeline.compare.misfit.where`; empty where no run says.

    Parameters
    ----------
    judged : sequence of JudgedRun
        All fitted, or all held out.
    """
    residuals = [run.residuals for run in judged if run.settles]
    return where(residuals) if residuals else {}
