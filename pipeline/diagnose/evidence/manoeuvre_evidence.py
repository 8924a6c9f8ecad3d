"""One manoeuvre as the report shows it: measured, predicted by two models, its phases and overshoots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float, wrapped
from kempf.pipeline.compare.overshoot import StoredOvershoot, compare_overshoots, turns_of
from kempf.pipeline.diagnose.evidence.judged_run import JudgedRun
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.predict.horizon import horizon_of
from kempf.pipeline.predict.prediction import of_free_run, predict
from kempf.schemas.diagnosis_evidence import (
    ManoeuvreEvidence,
    ManoeuvrePhase,
    OvershootPair,
    OvershootPeak,
    PredictedManoeuvre,
)
from kempf.schemas.errors import DataRejected
from kempf.schemas.units import SECOND_NS

#: horizons of the table beside the free run; one that a run is too short for is left out
HORIZONS = ("1", "10s", "60s", "free")
#: s of the approach over which the base course is taken, where no execute is known
_APPROACH_S = 5.0


@dataclass(frozen=True)
class SailedZigzag:
    """What the segment of a manoeuvre has that its run has not."""

    base_heading_deg: float
    executes_utc_ns: tuple[int, ...]
    #: ``peak_utc_ns``, ``side`` and ``beyond_nominal_deg`` of each.
    overshoots: tuple[Mapping[str, Any], ...]


def manoeuvre_evidence(
    before: JudgedRun,
    after: JudgedRun | None,
    states: Float,
    zigzag: SailedZigzag,
    *,
    held_out: bool,
) -> ManoeuvreEvidence:
    """Return what the report shows of a manoeuvre.

    Parameters
    ----------
    before : JudgedRun
        Under the first model of the ladder.
    after : JudgedRun or None
        Under the last; None where it is the first.
    states : ndarray, shape (n, 4)
        Of the last model: v, r, F and M given all measurements; NaN where the free run diverges.
    """
    run = before.residuals.filtered.run
    executes = tuple(_seconds(run, t) for t in zigzag.executes_utc_ns)
    peaks = tuple(
        OvershootPeak(
            at_s=_seconds(run, overshoot["peak_utc_ns"]),
            side=1 if overshoot["side"] == "starboard" else -1,
            beyond_deg=overshoot["beyond_nominal_deg"],
        )
        for overshoot in zigzag.overshoots
    )
    turns = turns_of(
        [(k, peak.side, peak.at_s, peak.beyond_deg) for k, peak in enumerate(peaks, start=1)],
        executes,
        float(run.time_s[-1]),
    )
    course = _BaseCourse.of(run, executes[0] if executes else _APPROACH_S, zigzag.base_heading_deg)
    motion = states[:, :2] if np.all(np.isfinite(states)) else run.measured[:, :2]
    return ManoeuvreEvidence(
        segment_id=run.name,
        start_utc_ns=run.start_utc_ns,
        held_out=held_out,
        time_s=run.time_s,
        rudder=run.rudder_rad,
        speed=run.speed_m_s,
        measured=run.measured,
        drift=motion[:, 0],
        turn=motion[:, 1],
        heading_deviation=course.deviation(course.heading),
        phases=tuple(
            ManoeuvrePhase(name=phase.name, start_s=phase.start_s, end_s=phase.end_s)
            for phase in before.residuals.phases
        ),
        peaks=peaks,
        before=_predicted(before, turns, course),
        after=None if after is None else _predicted(after, turns, course),
    )


def _seconds(run: GridRun, utc_ns: int) -> float:
    return (utc_ns - run.start_utc_ns) / SECOND_NS


@dataclass(frozen=True, eq=False)
class _BaseCourse:
    """The heading that deviations are counted from, whichever turn and whichever zero the compass counts from."""

    heading: Float
    zero: float

    @classmethod
    def of(cls, run: GridRun, until_s: float, base_heading_deg: float) -> _BaseCourse:
        first = run.time_s <= max(until_s, float(run.time_s[1]))
        known = np.isfinite(run.measured[first, 2]).any()
        # without a measured heading, the one that the wind's direction is turned by
        heading = run.measured[:, 2] if known else run.heading_rad
        start = float(np.nanmean(run.heading_rad[first])) - np.radians(base_heading_deg)
        approach = float(wrapped(start))
        return cls(heading, float(np.nanmean(heading[first])) - approach)

    def deviation(self, heading: Float) -> Float:
        result: Float = heading - self.zero
        return result


def _predicted(judged: JudgedRun, turns: tuple[StoredOvershoot, ...], course: _BaseCourse) -> PredictedManoeuvre:
    run, free = judged.residuals.filtered.run, judged.residuals.free
    heading, whitened = free.predicted[:, 2], judged.residuals.whitened
    values = whitened[np.isfinite(whitened)]
    pairs = compare_overshoots(run.time_s, run.measured[:, 2], heading, turns) if np.all(np.isfinite(heading)) else ()
    return PredictedManoeuvre(
        free_run=free.predicted,
        free_run_error=free.error,
        heading_deviation=course.deviation(heading),
        whitened=whitened,
        whitened_rms=float(np.sqrt(np.mean(values**2))) if values.size else None,
        fit_percent=_fits(judged),
        overshoots=tuple(
            OvershootPair(
                number=pair.number, side=pair.side, measured_deg=pair.measured_deg, predicted_deg=pair.predicted_deg
            )
            for pair in pairs
        ),
    )


def _fits(judged: JudgedRun) -> dict[str, dict[str, float]]:
    fits = {}
    for name in HORIZONS:
        horizon, filtered = horizon_of(name), judged.residuals.filtered
        try:
            if name == "free":
                prediction = of_free_run(filtered, judged.residuals.free, horizon)
            else:
                prediction = predict(filtered, judged.point, horizon)
        except DataRejected:
            continue
        fits[horizon.words] = prediction.fit_percent()
    return fits
