"""What is recorded of one zigzag: a record of plain numbers, angles in deg because that is how a trial is ordered.

Nothing is measured here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kempf.pipeline.segment.rudder.switching import Start
from kempf.schemas.side import Side

#: ``zigzag_broken_off``: fewer than two executes after the first, so that no second overshoot exists.
Kind = Literal["zigzag", "zigzag_broken_off"]

#: Phases in the order in which a leg goes through them. ``execute``: the rudder moves. ``yaw_build_up``: first leg, the
#: ship starts to turn. ``overshoot``: the rudder lies against the swing. ``counter_rudder``: the ship swings back.
#: ``steady_yaw``: the yaw rate is within a tenth of the leg's largest.
PhaseName = Literal["approach", "execute", "yaw_build_up", "overshoot", "counter_rudder", "steady_yaw"]


@dataclass(frozen=True)
class Execute:
    """One movement of the rudder to the next leg."""

    #: When the rudder starts to leave the angle it was held at.
    time_utc_ns: int
    #: Half the interval that the rudder's samples leave open.
    time_uncertainty_s: float
    #: When the rudder arrives at the angle of the leg.
    rudder_held_utc_ns: int
    #: rudder_before_deg, rudder_after_deg: Angles held before and after.
    rudder_before_deg: float
    rudder_after_deg: float
    #: Heading at the execute, relative to the base heading, starboard positive.
    heading_deg: float
    #: Yaw rate at the execute, starboard positive.
    yaw_rate_deg_s: float


@dataclass(frozen=True)
class Overshoot:
    """How far the heading went on after a switching execute."""

    #: 1 for the overshoot after the second execute.
    number: int
    #: One of {"starboard", "port"}. Where the heading went.
    side: Side
    #: When the heading turned back.
    peak_utc_ns: int
    #: From the execute to the peak.
    duration_s: float
    #: Beyond K0 +- the nominal psi0, as it is read from the plot of a trial.
    beyond_nominal_deg: float
    #: Beyond the heading at the execute, which exceeds the nominal by the helmsman's delay; so this one is smaller.
    beyond_execute_deg: float


@dataclass(frozen=True)
class Phase:
    """One stretch of the manoeuvre; phases follow each other without gap or overlap."""

    name: PhaseName
    leg: int
    start_utc_ns: int
    end_utc_ns: int


@dataclass(frozen=True)
class SpeedConstancy:
    """The speed from the second execute to the end."""

    #: Mean before the first execute; None where no speed was recorded there.
    approach_m_s: float | None
    #: mean_m_s, std_m_s: Mean and standard deviation after the second execute.
    mean_m_s: float
    std_m_s: float
    #: Change along the straight line laid through it, from the second execute to the end, in percent of the mean.
    trend_percent: float


@dataclass(frozen=True)
class Quality:
    """How good the zigzag is."""

    #: Legs, one an execute (one more where the log begins with the rudder over).
    n_legs: int
    #: Largest difference of a leg's rudder from the median of its side.
    rudder_scatter_deg: float
    #: Middle of both sides' rudder: the indicator's zero error.
    rudder_offset_deg: float
    #: Largest difference of a switching heading from the symmetric ones.
    switching_scatter_deg: float
    #: Middle of both switching headings, relative to the base heading.
    switching_centre_deg: float
    #: One of {"steady", "turning", "switching", "unknown"}. How the first leg begins: from a steady course; from K0
    #: with the ship still turning; at a switching heading, or unseen, where the log or another manoeuvre hides the
    #: approach.
    start: Start
    #: Time within the zigzag for which heading or rudder were not recorded.
    gap_s: float
    #: What a person should know before trusting it, one sentence each; empty for a good one.
    reasons: tuple[str, ...]


@dataclass(frozen=True)
class Zigzag:
    """One zigzag manoeuvre."""

    #: One of {"zigzag", "zigzag_broken_off"}. Whether the second overshoot was reached.
    kind: Kind
    #: psi0_deg, delta0_deg: Nominal heading change and rudder, as it was most likely ordered.
    psi0_deg: float
    delta0_deg: float
    #: psi0_measured_deg, delta0_measured_deg: What was measured: half the distance of the headings at the switching
    #: executes, and of the held rudder angles.
    psi0_measured_deg: float
    delta0_measured_deg: float
    #: One of {"starboard", "port"}. Side of the first execute.
    first_side: Side
    #: K0, 0 <= K0 < 360.
    base_heading_deg: float
    #: start_utc_ns, end_utc_ns: From the steady approach to the end of the last leg that belongs to the zigzag.
    start_utc_ns: int
    end_utc_ns: int
    #: In order. The first is the one from the approach, where ``quality.start`` is steady or turning.
    executes: tuple[Execute, ...]
    #: Those whose peak was reached.
    overshoots: tuple[Overshoot, ...]
    #: From start to end.
    phases: tuple[Phase, ...]
    #: None where no speed was recorded.
    speed: SpeedConstancy | None
    #: How good it is.
    quality: Quality

    @property
    def executes_utc_ns(self) -> tuple[int, ...]:
        """Instants of the executes, UTC nanoseconds."""
        return tuple(execute.time_utc_ns for execute in self.executes)
