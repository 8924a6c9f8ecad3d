"""One manoeuvre for the report: measured, predicted by two models, its phases and overshoots."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kempf.pipeline.channels.series import SECOND_NS
from kempf.pipeline.compare.overshoot import Turn, compare_overshoots, turns_of
from kempf.pipeline.diagnose.diagnosis import Step
from kempf.pipeline.estimate import sensitivity
from kempf.pipeline.estimate.filtered import Filtered
from kempf.pipeline.estimate.record.grid_run import Run
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.predict.free_run import FreeRun
from kempf.pipeline.predict.horizon import horizon_of
from kempf.pipeline.predict.prediction import of_free_run, predict
from kempf.pipeline.predict.run_residuals import Looked, PhaseInterval, phases_s
from kempf.schemas.errors import DataRejected
from kempf.warehouse.instant import iso_utc
from kempf.warehouse.segments import Segment
from kempf.workbench.report.content import Course, RunView
from kempf.workbench.report.smoothed import smoothed

#: horizons of the table beside the free run; one that a run is too short for is left out
HORIZONS = ("1", "10s", "60s", "free")


def run_view(
    run: Run, segment: Segment, logs: Mapping[str, str], first: Step, last: Step, number: int, *, held_out: bool
) -> RunView:
    """Return what the report shows of a run.

    Parameters
    ----------
    run : Run
    segment : Segment
        Of it.
    logs : mapping of str to str
        File name by log id.
    first, last : Step
        The plain model and the last.
    number : int
        Of the run in order of time, for its label.
    held_out : bool
    """
    executes = tuple(_s(run, t) for t in segment.executes_utc_ns)
    peaks = tuple(
        (_s(run, one["peak_utc_ns"]), 1 if one["side"] == "starboard" else -1, float(one["beyond_nominal_deg"]))
        for one in segment.detail.get("overshoots", ())
    )
    phases = phases_s(segment.detail.get("phases", ()), run.start_utc_ns)
    turns = turns_of(
        [(k, side, at, deg) for k, (at, side, deg) in enumerate(peaks, start=1)], executes, float(run.time_s[-1])
    )
    plain = _course(run, first, phases, turns, held_out=held_out)
    angles = f"{segment.psi0_deg:g}/{segment.delta0_deg:g}"
    return RunView(
        segment_id=segment.segment_id,
        label=f"Run {number}: {angles} zigzag, {segment.first_side} first, {_shown(run.start_utc_ns)}",
        log=logs.get(segment.log_id, segment.log_id),
        held_out=held_out,
        time_s=run.time_s,
        measured=run.measured,
        rudder_rad=run.rudder_rad,
        heading_rad=run.heading_rad,
        speed_m_s=run.speed_m_s,
        phases=phases,
        executes_s=executes,
        peaks=peaks,
        psi0_deg=segment.psi0_deg,
        base_heading_deg=segment.base_heading_deg,
        imo=segment.imo,
        plain=plain,
        full=plain if last is first else _course(run, last, phases, turns, held_out=held_out),
    )


def _s(run: Run, utc_ns: int) -> float:
    return (utc_ns - run.start_utc_ns) / SECOND_NS


def _shown(utc_ns: int) -> str:
    return iso_utc(utc_ns)[:16].replace("T", " ") + " UTC"


def _course(
    run: Run,
    step: Step,
    phases: tuple[PhaseInterval, ...],
    turns: tuple[Turn, ...],
    *,
    held_out: bool,
) -> Course:
    fit = step.fit
    number = None if held_out else [one.run.name for one in fit.runs].index(run.name)
    filtered = Filtered(run, fit.model, fit.runs[0].spec)
    # what was not fitted has no noise levels of its own: the mean of the fitted ones
    levels = np.mean(fit.levels, axis=0) if number is None else fit.levels[number]
    point = Point(fit.hull, fit.values, levels)
    free = next(one for one in (*step.held, *step.fitted) if one.name == run.name)
    looked = Looked(filtered, sensitivity.passed(filtered, point), free, phases)
    return Course(
        free=free.predicted,
        whitened=looked.whitened,
        states=smoothed(filtered, point, free),
        fit_percent=_fits(filtered, point, free),
        overshoots=compare_overshoots(
            run.time_s, run.measured[:, 2], free.predicted[:, 2], turns if np.all(np.isfinite(free.predicted)) else ()
        ),
        looked=looked,
    )


def _fits(filtered: Filtered, point: Point, free: FreeRun) -> dict[str, dict[str, float]]:
    found = {}
    for name in HORIZONS:
        horizon = horizon_of(name)
        try:
            made = of_free_run(filtered, free, horizon) if name == "free" else predict(filtered, point, horizon)
        except DataRejected:
            continue
        found[horizon.words] = made.fit_percent()
    return found
