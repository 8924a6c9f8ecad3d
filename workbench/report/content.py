"""What a report shows, as plain content: nothing here computes, draws or reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compare.overshoot import Overshoot
from kempf.pipeline.predict.run_residuals import Looked, PhaseInterval


@dataclass(frozen=True, eq=False)
class Course:
    """What one model says of one run.

    Attributes
    ----------
    free : ndarray, shape (n, 3)
        Free run: lateral speed, m/s, yaw rate, rad/s, heading, rad.
    whitened : ndarray, shape (n, 3)
        One-step innovations over their standard deviation; NaN where not measured.
    states : ndarray, shape (n, 4)
        v, r, F and M given all measurements of the run, SI.
    fit_percent : mapping of str to mapping of str to float
        By horizon in words, then by channel.
    overshoots : tuple of Overshoot
        Of the free run.
    looked : Looked
        For the search for where the model fails.
    """

    free: Float
    whitened: Float
    states: Float
    fit_percent: Mapping[str, Mapping[str, float]]
    overshoots: tuple[Overshoot, ...]
    looked: Looked


@dataclass(frozen=True, eq=False)
class RunView:
    """One manoeuvre: what was measured, and what the plain model and the last one say of it.

    Attributes
    ----------
    segment_id, label, log : str
    held_out : bool
    time_s : ndarray, shape (n,)
    measured : ndarray, shape (n, 3)
        NaN where there is none.
    rudder_rad, heading_rad, speed_m_s : ndarray, shape (n,)
    phases : tuple of PhaseInterval
    executes_s : tuple of float
    peaks : tuple of (float, int, float)
        Instant, s, side and overshoot beyond the nominal heading, deg, of each overshoot.
    psi0_deg : float
    base_heading_deg : float
    imo : mapping
        As the segment has it.
    plain, full : Course
        The same object where no effect was added.
    """

    segment_id: str
    label: str
    log: str
    held_out: bool
    time_s: Float
    measured: Float
    rudder_rad: Float
    heading_rad: Float
    speed_m_s: Float
    phases: tuple[PhaseInterval, ...]
    executes_s: tuple[float, ...]
    peaks: tuple[tuple[float, int, float], ...]
    psi0_deg: float
    base_heading_deg: float
    imo: Mapping[str, Any]
    plain: Course
    full: Course


@dataclass(frozen=True)
class RankedEffect:
    """One effect of the catalogue against the plain model.

    Attributes
    ----------
    name, title, verdict, why, separated_by : str
    set_id : str or None
    score, p_adjusted, absorption : float
        NaN where it cannot be tested.
    changes : tuple of (str, float, float, str)
        Name, expected change, its standard error and unit of each parameter.
    refitted : str
        Its size after the refit, in words; empty where it was not added.
    """

    name: str
    title: str
    verdict: str
    why: str
    separated_by: str
    set_id: str | None
    score: float
    p_adjusted: float
    absorption: float
    changes: tuple[tuple[str, float, float, str], ...]
    refitted: str


@dataclass(frozen=True, eq=False)
class Rung:
    """One step of the ladder.

    Attributes
    ----------
    added : str
        Title of the effect, "plain model" on the first.
    in_sample, held_out : ndarray
        Relative free-run errors of the single runs, fitted and held out.
    intensities : mapping of str to float
        Of the disturbances that the model has, by name with unit.
    log_likelihood : float
    parameters : int
    """

    added: str
    in_sample: Float
    held_out: Float
    intensities: Mapping[str, float]
    log_likelihood: float
    parameters: int


@dataclass(frozen=True, eq=False)
class AddedVariable:
    """What is left of the innovations against what an effect would explain, both cleaned of the fitted parameters.

    Attributes
    ----------
    title : str
    expected, left : ndarray, shape (N,)
        Standard deviations of the innovation; expected at the size that the score foretells.
    score : float
    """

    title: str
    expected: Float
    left: Float
    score: float


@dataclass(frozen=True, eq=False)
class MissingForce:
    """What acts on the ship beside the model, at the instants of all runs.

    Attributes
    ----------
    sway, yaw : ndarray, shape (N,)
        m/s^2 and rad/s^2: the disturbance's part, the mean of each run taken off.
    against : mapping of str to ndarray, shape (N,)
        v, m/s; r, deg/s; rudder, deg; heading, deg.
    """

    sway: Float
    yaw: Float
    against: Mapping[str, Float]


@dataclass(frozen=True, eq=False)
class ReportContent:
    """All that a report shows of one vessel.

    Attributes
    ----------
    vessel, verdict : str
    headline : str
        The verdict in one sentence.
    sentences, next_steps : tuple of str
    ranked : tuple of RankedEffect
        The highest score first, what cannot be tested last.
    names, alike : tuple of str, ndarray of shape (k, k)
        Squared cosines between what the first effects would explain.
    ladder : tuple of Rung
    added_variables : tuple of AddedVariable
    missing_before, missing_after : MissingForce
        Beside the plain model and beside the last.
    runs : tuple of RunView
        In order of time.
    where_before, where_after, where_held : mapping
        Where the plain model and the last one fail on fitted runs, and the last one on held-out runs, as
        `kempf.pipeline.compare.misfit.where` has it; the last empty where none is held out.
    ship : mapping of str to str
    provenance : tuple of (str, str)
        What and its value, in the order shown.
    """

    vessel: str
    verdict: str
    headline: str
    sentences: tuple[str, ...]
    next_steps: tuple[str, ...]
    ranked: tuple[RankedEffect, ...]
    names: tuple[str, ...]
    alike: Float
    ladder: tuple[Rung, ...]
    added_variables: tuple[AddedVariable, ...]
    missing_before: MissingForce
    missing_after: MissingForce
    runs: tuple[RunView, ...]
    where_before: Mapping[str, Any]
    where_after: Mapping[str, Any]
    where_held: Mapping[str, Any]
    ship: Mapping[str, str]
    provenance: tuple[tuple[str, str], ...]

    @property
    def improved(self) -> bool:
        """Whether an effect was added."""
        return len(self.ladder) > 1
