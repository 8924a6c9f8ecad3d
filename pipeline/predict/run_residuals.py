"""One run as the search for where a model fails takes it, and all runs' samples in one column."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filtered import Passed, RunFilter
from kempf.pipeline.predict.free_run import FreeRun
from kempf.pipeline.predict.prediction import settled
from kempf.schemas.units import SECOND_NS


@dataclass(frozen=True)
class PhaseInterval:
    """One phase of a manoeuvre, s from the first instant of the run."""

    name: str
    start_s: float
    end_s: float


@dataclass(frozen=True, eq=False)
class RunResiduals:
    """What a model leaves of one run: innovations one step ahead, and the errors of a free run."""

    filtered: RunFilter
    #: Of the fitted model, with the run's noise levels.
    passed: Passed
    free: FreeRun
    #: None where they are not known.
    phases: tuple[PhaseInterval, ...] = ()

    @property
    def whitened(self) -> Float:
        """Innovations over their standard deviations, NaN until the initial state is known, shape (n, 3)."""
        innovation, std = settled(self.passed)
        result: Float = innovation / std
        return result

    @property
    def phase_of(self) -> NDArray[np.str_]:
        """Name of the phase at every instant, ``""`` outside, shape (n,)."""
        time = self.filtered.run.time_s
        names = np.full(time.size, "", dtype="<U24")
        for phase in self.phases:
            names[(time >= phase.start_s) & (time < phase.end_s)] = phase.name
        return names


def phases_s(detail: Sequence[Mapping[str, Any]], start_utc_ns: int) -> tuple[PhaseInterval, ...]:
    """Return phases as a segment has them on the clock of a run.

    Parameters
    ----------
    detail : sequence of mapping
        With ``name``, ``start_utc_ns`` and ``end_utc_ns``: ``phases`` of a segment's detail.
    start_utc_ns : int
        First instant of the run.
    """

    def seconds(ns: int) -> float:
        return (ns - start_utc_ns) / SECOND_NS

    return tuple(PhaseInterval(p["name"], seconds(p["start_utc_ns"]), seconds(p["end_utc_ns"])) for p in detail)


@dataclass(frozen=True, eq=False)
class Samples:
    """The instants of all runs one after the other."""

    #: whitened, free_error: Shape (N, 3).
    whitened: Float
    free_error: Float
    #: phase, run: Shape (N,).
    phase: NDArray[np.str_]
    run: NDArray[np.str_]
    #: lateral_speed_m_s, yaw_rate_rad_s: Shape (N,). As the filter predicted them: measured ones would err with the
    #: innovations (a false alarm by construction).
    lateral_speed_m_s: Float
    yaw_rate_rad_s: Float
    #: rudder_rad, heading_rad, speed_m_s: Shape (N,).
    rudder_rad: Float
    heading_rad: Float
    speed_m_s: Float


def samples_of(residuals: Sequence[RunResiduals]) -> Samples:
    """Put the instants of all runs one after the other.

    Parameters
    ----------
    residuals : sequence of RunResiduals
        At least one.
    """
    records = [run.filtered.run for run in residuals]
    predicted = np.concatenate([run.passed.predicted for run in residuals])
    return Samples(
        whitened=np.concatenate([run.whitened for run in residuals]),
        free_error=np.concatenate([run.free.error for run in residuals]),
        phase=np.concatenate([run.phase_of for run in residuals]),
        run=np.concatenate([np.full(record.measured.shape[0], record.name) for record in records]),
        lateral_speed_m_s=predicted[:, 0],
        yaw_rate_rad_s=predicted[:, 1],
        rudder_rad=np.concatenate([record.rudder_rad for record in records]),
        heading_rad=np.concatenate([record.heading_rad for record in records]),
        speed_m_s=np.concatenate([record.speed_m_s for record in records]),
    )
