"""Misfits in the units of the prototype: windows shot by models that it tried, and by ours, on the same ships.

A misfit is a mean square over windows in units of fixed errors of v, r and psi, summed. It is of manoeuvres that shared
parameters were not fitted to, twice: from states as they were measured, as the prototype begins a window, and with
these states, and the constants of a manoeuvre, fitted to it, as `kempf diagnose` does.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.shooting import shooting_fit
from kempf.pipeline.shooting.ahead import Ahead, ShootingRange, shooting_range
from kempf.pipeline.shooting.reduced import Scales, squares
from kempf.pipeline.shooting.shot_run import ShotRun
from kempf.pipeline.shooting.windows import Windows, windows_of
from kempf.schemas import effects
from kempf.schemas.model_spec import ModelSpec


@dataclass(frozen=True)
class Misfits:
    """Of one model, one a manoeuvre."""

    #: From states as measured, and with states and constants fitted; infinite where the model runs away.
    measured_states: tuple[float, ...]
    fitted_states: tuple[float, ...]


def in_units(
    runs: Sequence[GridRun],
    held: Sequence[GridRun],
    spec: ModelSpec,
    error: Float,
    horizon_s: float | None,
    workers: Executor,
) -> ShootingRange:
    """Cut manoeuvres into windows and fit the plain model in fixed units.

    Parameters
    ----------
    error : ndarray, shape (3,)
        Units of v, r and psi, m/s, rad/s and rad.
    horizon_s : float or None
        None for a leg.
    """
    made = shooting_range(runs, held, spec, workers)
    scales = Scales(error, np.ones(3))
    if horizon_s is not None:
        fitted, unseen = (tuple(windows_of(run, horizon_s) for run in part) for part in (runs, held))
        made = replace(made, horizon_s=horizon_s, fitted=fitted, held=unseen)
    made = replace(made, scales=scales)
    shots = [ShotRun(windows, made.plain.model, spec) for windows in made.fitted]
    plain = shooting_fit.fit(shots, made.plain.fit.shared, scales, workers)
    return replace(made, plain=made.judged(plain))


def climbed(shooting: ShootingRange, names: Sequence[str]) -> list[Ahead | None]:
    """Return the plain model and those with one named effect more each; None from where one runs away."""
    found: list[Ahead | None] = [shooting.plain]
    for name in names:
        last = found[-1]
        found.append(None if last is None else shooting.with_effect(last, effects.get(name)))
    return found


def misfits(model: Ahead | None, windows: Sequence[Windows], spec: ModelSpec) -> Misfits:
    """Return how a model predicts manoeuvres that it was not fitted to."""
    if model is None:
        away = (float("inf"),) * len(windows)
        return Misfits(away, away)
    shots = [ShotRun(one, model.model, spec) for one in windows]
    fitted = tuple(shooting_fit.alone(shot, model.fit.shared, model.fit.scales)[0] for shot in shots)
    return Misfits(tuple(_from_measured(shot, model.fit.shared, model.fit.scales) for shot in shots), fitted)


def _from_measured(shot: ShotRun, shared: Float, scales: Scales) -> float:
    at = shot.begin(shared)
    found = shot.predicted(shared[:, None], at.own[:, None], at.starts[..., None])[..., 0]
    made = np.isfinite(shot.windows.measured)
    if not np.all(np.isfinite(found)):
        return float("inf")
    error = np.where(made, (shot.windows.measured - found) / scales.error, 0.0)
    return shooting_fit.misfit(squares(shot, error))
