"""The job that moves one parameter of a set, the others held: what a free run does, and what the likelihood says to it.

Nothing is stored. The other parameters and the noise levels stay as they are, so that the fall of the likelihood is the
most that a value costs: where others are fitted anew beside it, it costs less.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kempf.flows.jobs.compare.bound_runs import BoundRun, BoundRuns, bound
from kempf.flows.jobs.identify.leg_fit import by_name, shown_by_legs
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.series import Float
from kempf.pipeline.compare.run_series import first_heading
from kempf.pipeline.estimate.record.record import MEASUREMENTS
from kempf.pipeline.estimate.sensitivity import Point, passed
from kempf.pipeline.predict.free_run import free_run_of
from kempf.schemas.errors import DataRejected, NotFound
from kempf.schemas.model_spec import HULL_PARAMETERS
from kempf.schemas.motion_channel import MOTION
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.parameter_set import ParameterSet

#: values tried to each side of the estimate, and standard errors between two of them
_SIDE, _STEP = 4, 1.0
#: of the estimate, between two values, where it has no standard error
_SHARE = 0.1
#: of a drawn series
MOST_INSTANTS = 150


@dataclass(frozen=True, eq=False)
class TriedValue:
    """One value of the parameter."""

    value: float
    #: In standard errors from the estimate; None where it has none.
    in_std: float | None
    #: By how much the log-likelihood of the fitted manoeuvres is lower than at the estimate.
    log_likelihood_falls_by: float
    #: Of the manoeuvre; see `kempf.pipeline.predict.free_run.FreeRun.relative_error`. None where it runs away.
    free_run_error_percent: float | None
    #: Shape (n, 3). Predicted, columns `kempf.pipeline.estimate.record.record.MEASUREMENTS`; NaN where it runs away.
    predicted: Float

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content, without the series."""
        return {name: value for name, value in vars(self).items() if name != "predicted"}


@dataclass(frozen=True, eq=False)
class WhatIf:
    """A parameter moved."""

    vessel: str
    parameter_set: ParameterSet
    parameter: str
    unit: str
    value: float
    std: float | None
    run: BoundRun
    #: In ascending order of the value; the estimate is among them.
    tried: tuple[TriedValue, ...]
    #: Whether the parameters are those fitted to legs, which predictions take.
    by_legs: bool = False

    def as_json(self) -> dict[str, Any]:
        """Return it as the command line's JSON object."""
        return {
            "vessel": self.vessel,
            "parameter_set_id": self.parameter_set.parameter_set_id,
            "segment_id": self.run.segment.segment_id,
            "held_out": self.run.held_out,
            "parameter": self.parameter,
            "unit": self.unit,
            "value": self.value,
            "std": self.std,
            "fitted_to_legs": self.by_legs,
            "others": "held as they are: fitted anew beside it, a value costs less",
            "tried": [attempt.as_json() for attempt in self.tried],
        }

    def measured(self) -> dict[str, Float]:
        """Return what was measured, each of shape (n,): seconds, rudder, rad, and `MEASUREMENTS` in SI."""
        run = self.run.filtered.run
        zero = first_heading(run)
        shown = {
            f"{name}_{MOTION[name].suffix}": run.measured[:, i] + (zero if name == "heading" else 0.0)
            for i, name in enumerate(MEASUREMENTS)
        }
        return {"time_s": run.time_s, "rudder_angle_rad": run.rudder_rad, **shown}

    def predicted(self, attempt: TriedValue) -> dict[str, Float]:
        """Return what one value predicts of it, each of shape (n,), as `measured` does."""
        zero = first_heading(self.run.filtered.run)
        return {
            f"{name}_{MOTION[name].suffix}": attempt.predicted[:, i] + (zero if name == "heading" else 0.0)
            for i, name in enumerate(MEASUREMENTS)
        }


def what_if(
    warehouse: Warehouse,
    vessel: str,
    parameter: str,
    set_id: str | None = None,
    segment_id: str | None = None,
    progress: Progress = silent,
) -> WhatIf:
    """Move one parameter of a set by up to four standard errors to each side.

    Of a model with effects it is the ship that predictions are made with.

    Parameters
    ----------
    parameter : str
        Of the hull, or of an effect, such as ``rudder_lag.tau``.
    set_id : str, optional
        By default the vessel's current set.
    segment_id : str, optional
        Manoeuvre that is run freely, or the beginning of its id; by default the one that is predicted worst of those
        held out, of all where none is.

    Raises
    ------
    NotFound
        ``no_parameter``, ``no_run``; and what `kempf.flows.jobs.compare.bound_runs.bound` raises.
    DataRejected
        ``prediction_diverges``: the estimate itself runs away.
    """
    bound_runs = bound(warehouse, vessel, set_id, progress)
    parameters = {p.name: p for p in bound_runs.parameter_set.parameters if p.name in bound_runs.names}
    if parameter not in parameters:
        raise NotFound(
            "no_parameter",
            f"{bound_runs.parameter_set.parameter_set_id} has no parameter {parameter[:60]!r}.",
            f"Choose one of {', '.join(parameters)}.",
            {"parameters": list(parameters)},
        )
    estimate, place = parameters[parameter], bound_runs.names.index(parameter)
    by_legs = by_name(bound_runs.parameter_set) if shown_by_legs(bound_runs.parameter_set) else {}
    if bound_runs.legs is not None and by_legs:
        # the ship that predictions are made with
        bound_runs = replace(bound_runs, hull=bound_runs.legs[0], values=bound_runs.legs[1])
        if parameter in by_legs:
            estimate = replace(estimate, value=by_legs[parameter][0], std=by_legs[parameter][1])
    run = _run(bound_runs, segment_id)
    std = estimate.std if estimate.std is not None and np.isfinite(estimate.std) and estimate.std > 0.0 else None
    step = _STEP * std if std is not None else _SHARE * abs(estimate.value) or 1e-6
    moves = np.arange(-_SIDE, _SIDE + 1)
    here = _log_likelihood(bound_runs, place, 0.0)
    if not np.isfinite(here):
        raise DataRejected(
            "prediction_diverges",
            f"{bound_runs.parameter_set.parameter_set_id} itself runs away on the manoeuvres of {vessel!r}.",
            "Choose another set.",
        )
    tried = []
    for done, move in enumerate(moves.tolist()):
        progress(done, moves.size, f"{parameter} at {estimate.value + move * step:.4g}")
        moved = _moved(bound_runs, place, move * step)
        free = free_run_of(run.filtered, *moved)
        error = 100.0 * free.relative_error
        tried.append(
            TriedValue(
                estimate.value + move * step,
                move * _STEP if std is not None else None,
                here - _log_likelihood(bound_runs, place, move * step),
                float(error) if np.isfinite(error) else None,
                free.predicted,
            )
        )
    progress(moves.size, moves.size, "tried")
    about = (vessel, bound_runs.parameter_set, parameter, estimate.unit, estimate.value, std, run)
    return WhatIf(*about, tuple(tried), bool(by_legs))


def _run(bound_runs: BoundRuns, segment_id: str | None) -> BoundRun:
    if segment_id:
        runs = [run for run in bound_runs.runs if run.segment.segment_id.startswith(segment_id)]
        if len(runs) != 1:
            raise NotFound(
                "no_run",
                f"{segment_id[:40]!r} is {'several' if runs else 'none'} of the manoeuvres that can be predicted.",
                "Choose one of " + ", ".join(run.segment.segment_id for run in bound_runs.runs) + ".",
            )
        return runs[0]
    among = [run for run in bound_runs.runs if run.held_out] or list(bound_runs.runs)
    return max(among, key=lambda run: free_run_of(run.filtered, bound_runs.hull, bound_runs.values).relative_error)


def _moved(bound_runs: BoundRuns, place: int, by: float) -> tuple[Float, Float]:
    both = np.concatenate([bound_runs.hull, bound_runs.values])
    both[place] += by
    return both[: len(HULL_PARAMETERS)], both[len(HULL_PARAMETERS) :]


def _log_likelihood(bound_runs: BoundRuns, place: int, by: float) -> float:
    """Return that of the manoeuvres that the set was fitted to; of all where none of them is left."""
    hull, values = _moved(bound_runs, place, by)
    fitted = [run for run in bound_runs.runs if not run.held_out] or list(bound_runs.runs)
    return float(sum(passed(run.filtered, Point(hull, values, run.levels.own)).log_likelihood for run in fitted))


def series_of(answer: WhatIf) -> Mapping[str, Any]:
    """Return what is drawn of it as JSON content, at most `MOST_INSTANTS` instants.

    Returns
    -------
    mapping
        ``measured``: lists by column, see `WhatIf.measured`; ``predicted``: one such
        mapping for each value tried.
    """
    measured = answer.measured()
    step = max(1, -(-measured["time_s"].size // MOST_INSTANTS))

    def thinned(columns: Mapping[str, Float]) -> dict[str, list[float | None]]:
        return {
            name: [float(f"{x:.6g}") if np.isfinite(x) else None for x in values[::step].tolist()]
            for name, values in columns.items()
        }

    return {
        "measured": thinned(measured),
        "predicted": [thinned(answer.predicted(attempt)) for attempt in answer.tried],
    }
