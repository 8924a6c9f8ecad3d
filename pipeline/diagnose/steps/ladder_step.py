"""One rung of the ladder: a fitted model, what its effect was chosen from, and its free runs; and as JSON content."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.screen import Candidate
from kempf.pipeline.diagnose.steps.confirm import Confirmation
from kempf.pipeline.diagnose.steps.improves_prediction import comparisons
from kempf.pipeline.estimate.agreement import Agreement, agreement_of
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.predict.free_run import FreeRun, free_run
from kempf.pipeline.shooting.ahead import Ahead
from kempf.schemas.effect import Effect
from kempf.schemas.model_spec import HULL_PARAMETERS


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
    #: The model one leg ahead, fitted by shooting; None where one manoeuvre alone is fitted.
    ahead: Ahead | None = None
    #: Free runs with the parameters of that fit, of the fitted and then of the held-out manoeuvres; empty without it.
    by_legs: tuple[FreeRun, ...] = ()
    #: Share of repetitions, each without one manoeuvre, that chose the same set by its prediction one leg ahead; None
    #: where the likelihood chose.
    stability: float | None = None
    #: Names of the effects that were chosen together with this one, itself among them; empty where it stands alone.
    together: tuple[str, ...] = ()

    @property
    def predicts_by_legs(self) -> bool:
        """Whether predictions take the parameters fitted to legs: these predict them better than the likelihood's."""
        return self.ahead is not None and self.ahead.disagrees is not None

    @property
    def shown_by_legs(self) -> bool:
        """Whether a ladder that ends here shows its free runs with parameters fitted to legs.

        A plain model alone is shown by the likelihood's: an effect that is added later is compared with these, unless
        the model lacks something even then.
        """
        return self.predicts_by_legs and bool(self.fit.ship.model.effects)

    def free_runs(self, *, by_legs: bool) -> tuple[tuple[FreeRun, ...], tuple[FreeRun, ...]]:
        """Return the free runs of fitted and of held-out manoeuvres.

        Parameters
        ----------
        by_legs : bool
            Whether with the parameters fitted to legs, if there are such, and not with the likelihood's.
        """
        many = len(self.fitted)
        return (self.by_legs[:many], self.by_legs[many:]) if by_legs and self.by_legs else (self.fitted, self.held)

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


def step_of(fit: PooledFit, held: Sequence[GridRun], ahead: Ahead | None, workers: Executor | None = None) -> Step:
    """Return a fitted model as a rung by itself, with its free runs and nothing screened."""
    effects = fit.model.ship.effects
    added = effects[-1] if effects else None
    return make_step(fit, added, (), (), held, (), workers, ahead)


def make_step(
    fit: PooledFit,
    added: Effect | None,
    chosen_from: tuple[tuple[Candidate, Confirmation], ...],
    refused: tuple[tuple[Candidate, Confirmation], ...],
    held: Sequence[GridRun],
    screened: Sequence[Candidate],
    workers: Executor | None = None,
    ahead: Ahead | None = None,
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
    ahead : Ahead, optional
        The same model one leg ahead.
    """
    runs = [*(filtered.run for filtered in fit.runs), *held]
    each = map if workers is None else workers.map
    free = tuple(each(lambda run: free_run(fit, run), runs))
    many = len(fit.runs)
    legs: tuple[FreeRun, ...] = ()
    if ahead is not None:
        values = fit.values.copy()
        values[fit.model.of_ship] = ahead.fit.values
        better = replace(fit, hull=ahead.fit.hull, values=values)
        legs = tuple(each(lambda run: free_run(better, run), runs))
    return Step(fit, added, chosen_from, refused, tuple(screened), free[:many], free[many:], ahead, legs)


def without_members(steps: Sequence[Step]) -> list[Step]:
    """Return rungs whose sets leave out the effects of other rungs: these stand in the model, and in no other's place.

    What predicted as well as the first effect that was chosen may have been chosen beside it later.
    """
    own = {step.added.name for step in steps if step.added is not None}
    return [
        replace(
            step, chosen_from=(*step.chosen_from[:1], *(p for p in step.chosen_from[1:] if p[0].effect.name not in own))
        )
        for step in steps
    ]


def rung(number: int, step: Step, before: Ahead | None = None, agreement: Agreement | None = None) -> dict[str, Any]:
    """Return one rung of the ladder as JSON content.

    Parameters
    ----------
    before : Ahead, optional
        The rung below one leg ahead, to compare with.
    agreement : Agreement, optional
        Of all runs that the fit rests on, where it is not fitted to all of them.
    """
    force, moment, current = step.intensities
    ship = step.fit.ship
    widened = (agreement or agreement_of(step.fit)).widened if ship.model.effects else 1.0
    std = widened * ship.std[6:]
    return {
        "step": number,
        "added": None if step.added is None else step.added.name,
        "together": list(step.together),
        "in_sample_error": step.in_sample_error,
        "held_out_error": step.held_out_error,
        "held_out": {run.name: _rms(run.rms) for run in step.held},
        "in_sample": {run.name: _rms(run.rms) for run in step.fitted},
        "disturbance_intensity": {
            "wind_force_m_s2_per_sqrt_s": float(force),
            "moment_rad_s2_per_sqrt_s": float(moment),
            "current_m_s_per_sqrt_s": float(current),
        },
        "one_leg_ahead": None if step.ahead is None else _ahead(step.ahead, before),
        "free_run_fitted_to_legs": {run.name: run.relative_error for run in step.by_legs},
        "log_likelihood": step.fit.log_likelihood,
        "converged": step.fit.converged,
        "widened": widened,
        "hull": dict(zip(HULL_PARAMETERS, (float(x) for x in step.fit.hull), strict=True)),
        "effects": {
            f"{effect.name}.{parameter.name}": {"value": float(v), "std": float(s), "unit": parameter.unit}
            for (effect, parameter), v, s in zip(ship.model.parameters, ship.values, std, strict=True)
        },
        "instrument_noise": {
            name: {"value": value, "std": std, "unit": unit} for name, value, std, unit in step.fit.noise
        },
    }


def _ahead(ahead: Ahead, before: Ahead | None) -> dict[str, Any]:
    """Return how a model predicts one leg ahead as JSON content: per cent of the motion, and sums of squares."""
    names = [shot.windows.run.name for shot in ahead.fit.shots]
    held = [windows.run.name for windows in ahead.held_windows]
    covariance = ahead.fit.covariance
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    samples = ("fitted", "left_out", "held_out")
    against = [] if before is None else comparisons(before, ahead)
    return {
        "horizon_s": ahead.horizon_s,
        "fitted_percent": dict(zip(names, ahead.percent(ahead.own).tolist(), strict=True)),
        "left_out_percent": dict(zip(names, ahead.percent(ahead.left_out).tolist(), strict=True)),
        "held_out_percent": dict(zip(held, ahead.percent(ahead.held).tolist(), strict=True)),
        "fitted_misfit": ahead.own.mean,
        "left_out_misfit": ahead.left_out.mean,
        "held_out_misfit": ahead.held.mean if held else None,
        "parameters": {
            name: {"value": float(value), "std": float(std)}
            for name, value, std in zip((*HULL_PARAMETERS, *ahead.model.names), ahead.fit.shared, std, strict=True)
        },
        "covariance": covariance.tolist(),
        "beside_the_rung_below": {
            sample: asdict(comparison) for sample, comparison in zip(samples, against, strict=False)
        },
        "one_step_parameters_misfit": None if ahead.one_step is None else ahead.one_step.mean,
        "better_than_one_step": None if ahead.disagrees is None else asdict(ahead.disagrees),
    }


def _rms(rms: Float) -> dict[str, float]:
    return dict(zip(("lateral_speed", "yaw_rate", "heading"), (float(x) for x in rms), strict=True))
