"""Runs beside their predictions as they are shown: one object a run, and means of fitted and of held-out ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kempf.pipeline.compare.overshoot import OvershootError
from kempf.pipeline.predict.median_error import LEFT_THE_COURSE, median_error
from kempf.pipeline.predict.prediction import Predicted
from kempf.pipeline.predict.run_residuals import RunResiduals
from kempf.schemas.motion_channel import MOTION

FITTED, HELD_OUT = "fitted", "held_out"
_DEG = float(np.rad2deg(1.0))


@dataclass(frozen=True, eq=False)
class ComparedRun:
    """One run beside its prediction."""

    #: Of the run.
    name: str
    #: Whether the parameters have not seen it.
    held_out: bool
    #: At the horizon asked for.
    predicted: Predicted
    #: The free run, for overshoots and for the threshold.
    free: Predicted
    #: The error of the model on this run, `kempf.pipeline.predict.free_run.FreeRun.relative_error`.
    free_run_error: float
    overshoots: tuple[OvershootError, ...]
    #: For `kempf.pipeline.compare.misfit.where`.
    residuals: RunResiduals
    #: Where the noise levels come from, in words.
    levels_from: str
    #: The free-run error with the parameters fitted to legs, where these predict better than the set's; None elsewhere.
    free_run_error_by_legs: float | None = None

    @property
    def sample(self) -> str:
        """``fitted`` or ``held_out``."""
        return HELD_OUT if self.held_out else FITTED

    @property
    def by_legs(self) -> bool:
        """Whether the horizon asks for the parameters fitted to legs."""
        return self.predicted.horizon.name == "legs"

    @property
    def shown_error(self) -> float:
        """The free-run error with the parameters that the horizon asks for."""
        by_legs = self.free_run_error_by_legs if self.by_legs else None
        return self.free_run_error if by_legs is None else by_legs

    @property
    def free_run_error_percent(self) -> float:
        """The error in percent."""
        return 100.0 * self.free_run_error

    def as_json(self) -> dict[str, Any]:
        """Return the run as JSON content; overshoots in deg, ``rms`` in SI, ``rms_display`` in display units."""
        predicted = self.predicted
        rms = predicted.rms()
        shown = {name: channel.shown for name, channel in MOTION.items() if name in rms}
        display = {name: {"value": factor * rms[name], "unit": unit} for name, (unit, factor) in shown.items()}
        return {
            "segment_id": self.name,
            "held_out": self.held_out,
            "sample": self.sample,
            "fit_percent": _ordered(predicted.fit_percent()),
            "rms": _ordered(rms),
            "rms_unit": {name: MOTION[name].unit for name in shown},
            "rms_display": display,
            "rms_told": display,  # as it was called up to 0.1
            "n": _ordered(predicted.count()),
            "left_out_settling": predicted.settling,
            "inside_95_percent": {
                name: {"share": k / n, "inside": k, "of": n} for name, (k, n) in _ordered(predicted.inside_95()).items()
            },
            "overshoot_error_deg": [turn.error_deg for turn in self.overshoots],
            "overshoot_horizon": "legs" if self.by_legs else "free",
            "overshoots": [
                {
                    "number": turn.number,
                    "side": "starboard" if turn.side > 0 else "port",
                    "measured_deg": turn.measured_deg,
                    "predicted_deg": turn.predicted_deg,
                    "error_deg": turn.error_deg,
                }
                for turn in self.overshoots
            ],
            "started_from": _started_from(self),
            "noise_levels": self.levels_from,
        }


def _ordered(by_channel: dict[str, Any]) -> dict[str, Any]:
    return {name: by_channel[name] for name in MOTION if name in by_channel}


def _started_from(run: ComparedRun) -> dict[str, Any]:
    """Return what a prediction began with, and what it took for wind and current."""
    horizon = run.predicted.horizon
    if horizon.kind == "one step":
        return {
            "initial_state": "the filter's, from every measurement before",
            "disturbances": "wind force, moment and current as the filter estimates them at that instant",
        }
    if horizon.seconds is not None:
        return {
            "initial_state": f"the filter's, from the measurements up to {0.75 * horizon.seconds:g} to "
            f"{horizon.seconds:g} s before, of {3 * horizon.seconds:g} s and more",
            "disturbances": "wind force, moment and current as estimated then, carried on by their correlation rates",
        }
    assert run.predicted.constants is not None
    v, r, psi, force, moment, first, second, bias = (float(x) for x in run.predicted.constants)
    has, earth = run.residuals.filtered.present(), run.residuals.filtered.spec.current == "earth"
    state = {"lateral_speed_m_s": v, "yaw_rate_deg_s": _DEG * r, "heading_from_first_deg": _DEG * psi}
    disturbances = (
        (has[3], "wind_force_m_s2", force),
        (has[4], "yaw_acceleration_rad_s2", moment),
        (has[5], "current_north_m_s" if earth else "current_lateral_m_s", first),
        (has[6], "current_east_m_s", second),
        (has[7], "rate_bias_deg_s", _DEG * bias),
    )
    return {
        "initial_state": state,
        "disturbances": {name: value for there, name, value in disturbances if there},
        "note": "constants fitted to this manoeuvre, the same few for every model; their changes count as error",
    }


def summary(runs: Sequence[ComparedRun]) -> dict[str, Any]:
    """Return means over the runs, fitted and held out apart, each with the standard error over runs.

    Returns
    -------
    dict
        ``fitted`` and ``held_out``, None where there is no such run: ``runs``, ``fit_percent`` and ``rms_display`` by
        channel, ``inside_95_percent`` by channel over all runs, ``overshoot_error_deg`` with ``mean``, ``std_error``,
        ``mean_size``, ``n`` and ``not_predicted``, ``free_run_error_percent``, and the same fitted to legs, None where
        those predict no better.
    """
    by_sample: dict[str, Any] = {}
    for sample in (FITTED, HELD_OUT):
        of = [run for run in runs if run.sample == sample]
        by_sample[sample] = _summary(of) if of else None
    return by_sample


def _summary(runs: Sequence[ComparedRun]) -> dict[str, Any]:
    fits = [run.predicted.fit_percent() for run in runs]
    rms = [run.predicted.rms() for run in runs]
    inside = [run.predicted.inside_95() for run in runs]
    there = [name for name in MOTION if any(name in fit for fit in fits)]
    covered = {}
    for name in there:
        counts = [by_channel[name] for by_channel in inside if name in by_channel]
        if counts:
            k, n = (sum(column) for column in zip(*counts, strict=True))
            covered[name] = {"share": k / n, "inside": k, "of": n}
    display = {
        name: {
            **_mean([MOTION[name].shown[1] * by_channel[name] for by_channel in rms if name in by_channel]),
            "unit": MOTION[name].shown[0],
        }
        for name in there
    }
    errors = [turn.error_deg for run in runs for turn in run.overshoots]
    known = [e for e in errors if e is not None]
    legs = [run.free_run_error_by_legs for run in runs if run.free_run_error_by_legs is not None]
    return {
        "runs": len(runs),
        "fit_percent": {name: _mean([fit[name] for fit in fits if name in fit]) for name in there},
        "rms_display": display,
        "rms_told": display,  # as it was called up to 0.1
        "inside_95_percent": covered,
        "overshoot_error_deg": {
            **_mean(known),
            "mean_size": float(np.mean(np.abs(known))) if known else None,
            "n": len(known),
            "not_predicted": len(errors) - len(known),
        },
        "free_run_error_percent": _errors([run.free_run_error for run in runs]),
        "free_run_error_percent_fitted_to_legs": _errors(legs) if legs else None,
    }


def judged(runs: Sequence[ComparedRun]) -> tuple[str, float]:
    """Return the sample that a threshold is put to, held out where there is any, and its free-run error in percent.

    It is the mean; where the horizon asks for parameters fitted to legs, the median with these.

    Parameters
    ----------
    runs : sequence of ComparedRun
        At least one.
    """
    held = [run for run in runs if run.held_out]
    return (HELD_OUT, _error(held)) if held else (FITTED, _error(runs))


def _error(runs: Sequence[ComparedRun]) -> float:
    # a ladder keeps means of shares; to the last digit the same they are only if the mean comes first here too
    if runs[0].by_legs:
        # the free run of a ship that keeps no course may run off
        return 100.0 * median_error(run.shown_error for run in runs)
    return 100.0 * float(np.mean([run.free_run_error for run in runs]))


def _finite(error: float) -> float | None:
    return error if np.isfinite(error) else None


def _errors(errors: Sequence[float]) -> dict[str, float | None]:
    """Return mean, standard error and median in percent, and how many runs leave the measured course altogether."""
    summed = _in_percent({**_mean(errors), "median": _finite(median_error(errors)) if errors else None})
    return {**summed, "off": sum(not error < LEFT_THE_COURSE for error in errors)}


def _in_percent(mean: dict[str, float | None]) -> dict[str, float | None]:
    return {name: None if value is None else 100.0 * value for name, value in mean.items()}


def _mean(values: Sequence[float]) -> dict[str, float | None]:
    """Return mean and standard error over runs; the error None of a single one."""
    if not values:
        return {"mean": None, "std_error": None}
    n = len(values)
    return {"mean": float(np.mean(values)), "std_error": float(np.std(values, ddof=1) / np.sqrt(n)) if n > 1 else None}
