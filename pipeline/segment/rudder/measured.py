"""The signals of one log on one clock, and the chains of rudder legs measured against the heading."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.segment.rudder.legs import Leg, noise_level
from kempf.pipeline.segment.rudder.local_fit import value_and_rate
from kempf.pipeline.segment.rudder.ramps import Ramp, approach_before, measure_ramp
from kempf.pipeline.segment.rudder.switching import Chain
from kempf.pipeline.segment.settings import SegmentSettings
from kempf.schemas.units import SECOND_NS

#: Half width of the local cubic, as a share of the median leg from execute to execute.
_WINDOW_SHARE = 0.08


@dataclass(frozen=True, eq=False)
class Signals:
    """Heading and rudder of one log in seconds after one origin."""

    #: UTC nanoseconds of second 0.
    origin_ns: int
    #: heading_s, heading: Shape (n_heading,). Instants, s; unwrapped heading, rad.
    heading_s: Float
    heading: Float
    #: rudder_s, rudder: Shape (n_rudder,). Instants, s; rudder, rad, positive to starboard.
    rudder_s: Float
    rudder: Float
    #: Standard deviation of the rudder's noise, rad.
    rudder_noise: float

    @classmethod
    def of(cls, heading: Series, rudder: Series) -> Signals:
        """Bring both series to one origin; neither may be empty."""
        origin = int(min(heading.time_utc_ns[0], rudder.time_utc_ns[0]))
        return cls(
            origin,
            heading.seconds_since(origin),
            heading.value,
            rudder.seconds_since(origin),
            rudder.value,
            noise_level(rudder.value),
        )

    def utc_ns(self, second: float) -> int:
        """Return an instant in UTC nanoseconds."""
        return self.origin_ns + round(second * SECOND_NS)

    def longest_gap_s(self, start_s: float, end_s: float) -> float:
        """Return the longest time between two samples of heading or rudder within an interval, s."""
        return max(_longest(self.heading_s, start_s, end_s), _longest(self.rudder_s, start_s, end_s))

    def gap_s(self, start_s: float, end_s: float) -> float:
        """Return for how long heading or rudder, whichever is worse, were not recorded within an interval, s."""
        return max(_gaps(self.heading_s, start_s, end_s), _gaps(self.rudder_s, start_s, end_s))


def said_of_gap(gap_s: float) -> tuple[str, ...]:
    """Return what to say of a manoeuvre for some of which heading or rudder were not recorded; nothing of no gap."""
    return (f"Heading or rudder were not recorded for {gap_s:.1f} s.",) if gap_s > 0.0 else ()


def _gaps(time_s: Float, start_s: float, end_s: float) -> float:
    """Sum the intervals that are more than five times as long as usual."""
    steps = np.diff(time_s[np.searchsorted(time_s, start_s) : np.searchsorted(time_s, end_s, side="right")])
    return float(np.sum(steps[steps > 5.0 * np.median(steps)])) if steps.size else 0.0


def _longest(time_s: Float, start_s: float, end_s: float) -> float:
    inside = time_s[np.searchsorted(time_s, start_s) : np.searchsorted(time_s, end_s, side="right")]
    return float(np.max(np.diff(np.concatenate([[start_s], inside, [end_s]]))))


def measure(signals: Signals, legs: list[Leg], settings: SegmentSettings) -> tuple[Chain, float]:
    """Measure the executes of a chain, and the heading and yaw rate there.

    Parameters
    ----------
    signals : Signals
        Heading and rudder.
    legs : list of Leg
        Alternating legs.
    settings : SegmentSettings
        Thresholds.

    Returns
    -------
    Chain
        The chain with what was measured.
    float
        Half width of the local cubic to be used for its headings, s.
    """
    ramps = _ramps(signals, legs)
    start = [leg.start_s if ramp is None else ramp.start_s for leg, ramp in zip(legs, ramps, strict=True)]
    spacing = float(np.median(np.diff(start)))
    window = _WINDOW_SHARE * spacing
    state = [
        (float("nan"), float("nan"))
        if ramp is None
        else value_and_rate(signals.heading_s, signals.heading, ramp.start_s, window)
        for ramp in ramps
    ]
    unbroken = [
        signals.longest_gap_s(legs[k].start_s, min(legs[k + 1].end_s, start[k + 1] + window))
        <= settings.gap_share * max(start[k + 1] - start[k], spacing)
        for k in range(len(legs) - 1)
    ]
    heading, rate = np.array(state).T
    return Chain(legs, ramps, heading, rate, unbroken), window


def _ramps(signals: Signals, legs: list[Leg]) -> list[Ramp | None]:
    """Measure the movement before each leg; the rate of the slower ones serves those too quick to sample."""
    time_s, rudder, noise = signals.rudder_s, signals.rudder, signals.rudder_noise

    def reversals(known_rate: float) -> list[Ramp | None]:
        return [
            measure_ramp(
                time_s,
                rudder,
                leg.first,
                held_after=leg.rudder,
                held_before=before.rudder,
                earliest=before.first,
                noise=noise,
                known_rate=known_rate,
            )
            for before, leg in pairwise(legs)
        ]

    ramps = reversals(float("nan"))
    rates = [abs(ramp.rate) for ramp in ramps if ramp is not None and np.isfinite(ramp.rate)]
    rate = float(np.median(rates)) if rates else float("nan")
    if rates and len(rates) < len(ramps):
        ramps = reversals(rate)
    first = legs[0]
    spacing = float(np.median(np.diff([leg.start_s for leg in legs])))
    earliest = int(np.searchsorted(time_s, first.start_s - spacing))
    begin, held = approach_before(
        time_s, rudder, first.first, held_after=first.rudder, earliest=earliest, noise=noise, rate=rate
    )
    opening = measure_ramp(
        time_s,
        rudder,
        first.first,
        held_after=first.rudder,
        held_before=held,
        earliest=begin,
        noise=noise,
        known_rate=rate,
    )
    return [opening, *ramps]
