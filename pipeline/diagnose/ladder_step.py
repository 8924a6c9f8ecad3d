"""One rung of the ladder: a fitted model, what its effect was chosen from, and its free runs; and as JSON content."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.confirm import Confirmation
from kempf.pipeline.diagnose.screen import Candidate
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.predict.free_run import FreeRun, free_run
from kempf.schemas.effect import Effect


@dataclass(frozen=True, eq=False)
class Step:
    """One rung of the ladder."""

    fit: PooledFit
    #: None on the first.
    added: Effect | None
    #: The set it was taken from, itself first.
    chosen_from: tuple[tuple[Candidate, Confirmation], ...]
    #: What was refitted and did not stand the tests, or was clearly worse.
    refused: tuple[tuple[Candidate, Confirmation], ...]
    #: What the screen of this step's model says of everything else.
    screened: tuple[Candidate, ...]
    #: fitted, held: Free runs of the fitted and of the held-out manoeuvres.
    fitted: tuple[FreeRun, ...]
    held: tuple[FreeRun, ...]

    @property
    def in_sample_error(self) -> float:
        """Mean relative error of the free runs of fitted manoeuvres."""
        return float(np.mean([run.relative_error for run in self.fitted]))

    @property
    def held_out_error(self) -> float | None:
        """Mean relative error of the free runs of held-out manoeuvres."""
        return float(np.mean([run.relative_error for run in self.held])) if self.held else None

    @property
    def intensities(self) -> Float:
        """Geometric means over the runs of the levels of the disturbances' drives, shape (3,)."""
        result: Float = np.exp(np.mean(self.fit.levels[:, :3], axis=0))
        return result


def step_of(fit: PooledFit, held: Sequence[GridRun]) -> Step:
    """Return a fitted model as a rung by itself, with its free runs and nothing screened."""
    return make_step(fit, fit.model.effects[-1] if fit.model.effects else None, (), (), held, ())


def make_step(
    fit: PooledFit,
    added: Effect | None,
    chosen_from: tuple[tuple[Candidate, Confirmation], ...],
    refused: tuple[tuple[Candidate, Confirmation], ...],
    held: Sequence[GridRun],
    screened: Sequence[Candidate],
    workers: Executor | None = None,
) -> Step:
    """Return a fitted model as a rung, with the free runs of fitted and held-out manoeuvres.

    Parameters
    ----------
    added : Effect or None
        None on the first rung.
    chosen_from, refused : tuple of (Candidate, Confirmation)
        See `Step`.
    held : sequence of GridRun
        Held out.
    workers : Executor, optional
        Free runs share it.
    """
    runs = [*(filtered.run for filtered in fit.runs), *held]
    each = map if workers is None else workers.map
    free = tuple(each(lambda run: free_run(fit, run), runs))
    many = len(fit.runs)
    return Step(fit, added, chosen_from, refused, tuple(screened), free[:many], free[many:])


def rung(number: int, step: Step) -> dict[str, Any]:
    """Return one rung of the ladder as JSON content."""
    force, moment, current = step.intensities
    return {
        "step": number,
        "added": None if step.added is None else step.added.name,
        "in_sample_error": step.in_sample_error,
        "held_out_error": step.held_out_error,
        "held_out": {run.name: _rms(run.rms) for run in step.held},
        "in_sample": {run.name: _rms(run.rms) for run in step.fitted},
        "disturbance_intensity": {
            "wind_force_m_s2_per_sqrt_s": float(force),
            "moment_rad_s2_per_sqrt_s": float(moment),
            "current_m_s_per_sqrt_s": float(current),
        },
        "log_likelihood": step.fit.log_likelihood,
        "converged": step.fit.converged,
        "hull": dict(zip(("a11", "a12", "a21", "a22", "b1", "b2"), (float(x) for x in step.fit.hull), strict=True)),
        "effects": {
            f"{effect.name}.{parameter.name}": {"value": float(v), "std": float(s), "unit": parameter.unit}
            for (effect, parameter), v, s in zip(
                step.fit.model.parameters, step.fit.values, step.fit.std[6:], strict=True
            )
        },
    }


def _rms(rms: Float) -> dict[str, float]:
    return dict(zip(("lateral_speed", "yaw_rate", "heading"), (float(x) for x in rms), strict=True))
