"""The manoeuvres of a diagnosis under one of its models: filtered with their own noise levels, and in free run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.diagnose.steps.ladder_step import Step
from kempf.pipeline.estimate import sensitivity
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.levels import fit_levels
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.predict.free_run import FreeRun
from kempf.pipeline.predict.run_residuals import PhaseInterval, RunResiduals


@dataclass(frozen=True, eq=False)
class JudgedRun:
    """One manoeuvre under one model."""

    #: Parameters of the model, with noise levels fitted to this manoeuvre, held out or not: a noisier sensor is no
    #: misfit.
    point: Point
    #: One step ahead by ``point``, and in free run by it or by the parameters fitted to legs.
    residuals: RunResiduals
    #: The free run by ``point``.
    one_step_free: FreeRun

    @property
    def settles(self) -> bool:
        """Whether the filter follows the measurements at all."""
        return bool(np.isfinite(self.residuals.passed.log_likelihood))


def judged_fitted(step: Step, phases: Mapping[str, Sequence[PhaseInterval]], *, by_legs: bool) -> tuple[JudgedRun, ...]:
    """Return the fitted manoeuvres under the model of a step.

    Parameters
    ----------
    phases : mapping of str to sequence of PhaseInterval
        By run; a run without has none.
    by_legs : bool
        As `Step.free_runs`.
    """
    fit = step.fit
    return tuple(
        JudgedRun(
            Point(fit.hull, fit.values, levels),
            RunResiduals(filtered, line.passed, predicting, tuple(phases.get(filtered.run.name, ()))),
            free,
        )
        for filtered, levels, line, predicting, free in zip(
            fit.runs, fit.levels, fit.linearised, step.free_runs(by_legs=by_legs)[0], step.fitted, strict=True
        )
    )


def judged_held_out(
    step: Step, held: Sequence[GridRun], phases: Mapping[str, Sequence[PhaseInterval]], *, by_legs: bool
) -> tuple[JudgedRun, ...]:
    """Return the held-out manoeuvres under the model of a step.

    Parameters
    ----------
    held : sequence of GridRun
        In the order of ``step.held``.
    phases : mapping of str to sequence of PhaseInterval
        By run; a run without has none.
    by_legs : bool
        As `Step.free_runs`.
    """
    fit, judged = step.fit, []
    usual = np.mean(fit.levels, axis=0)
    for run, predicting, free in zip(held, step.free_runs(by_legs=by_legs)[1], step.held, strict=True):
        filtered = RunFilter(run, fit.model, fit.runs[0].spec)
        levels = fit_levels(filtered, fit.hull, fit.values, usual).levels
        point = Point(fit.hull, fit.values, levels)
        passed = sensitivity.passed(filtered, point)
        residuals = RunResiduals(filtered, passed, predicting, tuple(phases.get(run.name, ())))
        judged.append(JudgedRun(point, residuals, free))
    return tuple(judged)
