"""One run compared: prediction at the horizon, free run, overshoots, and what the search for misfits needs."""

from __future__ import annotations

from collections.abc import Sequence

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compare.comparison import ComparedRun
from kempf.pipeline.compare.overshoot import StoredOvershoot, compare_overshoots
from kempf.pipeline.estimate import sensitivity
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.predict.free_run import free_run_of
from kempf.pipeline.predict.horizon import Horizon, horizon_of
from kempf.pipeline.predict.prediction import of_free_run, predict
from kempf.pipeline.predict.run_residuals import PhaseInterval, RunResiduals

_HEADING = 2


def compare_run(
    filtered: RunFilter,
    point: Point,
    horizon: Horizon,
    *,
    held_out: bool,
    legs: tuple[Float, Float] | None = None,
    levels_from: str = "fitted with the parameters",
    own_levels: Float | None = None,
    phases: Sequence[PhaseInterval] = (),
    turns: Sequence[StoredOvershoot] = (),
) -> ComparedRun:
    """Compare one run with its prediction.

    Parameters
    ----------
    held_out : bool
        Whether the parameters have not seen this run.
    legs : (ndarray, ndarray), optional
        Hull and parameters of effects, shape (6,) and (p,), fitted to legs where these predict better than ``point``;
        a horizon with these asks for them.
    levels_from : str, optional
        Where the noise levels come from, in words.
    own_levels : ndarray, shape (6,), optional
        Logarithms of levels fitted to this run, for the search for misfits; by default those of ``point``: a noisier
        sensor is no misfit.
    turns : sequence of StoredOvershoot, optional
        Its overshoots.

    Raises
    ------
    DataRejected
        ``prediction_diverges``, ``horizon_too_long``.
    """
    run = filtered.run
    own = point if own_levels is None else Point(point.hull, point.values, own_levels)
    free_run = free_run_of(filtered, point.hull, point.values)
    by_legs = None if legs is None else free_run_of(filtered, *legs)
    error = free_run.relative_error
    if horizon.kind == "free run, fitted to legs":
        assert by_legs is not None
        free_run = by_legs
    free = of_free_run(filtered, free_run, horizon if horizon.runs_freely else horizon_of("free"))
    return ComparedRun(
        name=run.name,
        held_out=held_out,
        predicted=free if horizon.runs_freely else predict(filtered, point, horizon),
        free=free,
        free_run_error=error,
        overshoots=compare_overshoots(
            run.time_s, run.measured[:, _HEADING], free_run.predicted[:, _HEADING], tuple(turns)
        ),
        residuals=RunResiduals(filtered, sensitivity.passed(filtered, own), free_run, tuple(phases)),
        levels_from=levels_from,
        free_run_error_by_legs=None if by_legs is None else by_legs.relative_error,
    )
