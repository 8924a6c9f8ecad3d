"""The zigzag between bounds that a person gave: he says that it is one, the search no longer asks whether."""

from __future__ import annotations

from dataclasses import replace
from math import inf

from kempf.pipeline.channels.series import Series
from kempf.pipeline.segment.rudder.legs import find_chains
from kempf.pipeline.segment.rudder.measured import Signals, measure
from kempf.pipeline.segment.rudder.switching import zigzags_in
from kempf.pipeline.segment.settings import SegmentSettings
from kempf.pipeline.segment.zigzags.describe import describe
from kempf.pipeline.segment.zigzags.zigzag import Phase, Zigzag
from kempf.schemas.errors import DataRejected

#: what is a zigzag because somebody says so: rudder legs that alternate, wherever the heading reversed them
_SAID = SegmentSettings(
    largest_heading_deg=180.0, switching_scatter=inf, rate_share=0.0, gap_share=inf, switchings_without_approach=1
)


def zigzag_between(heading: Series, rudder: Series, speed: Series | None, start_utc_ns: int, end_utc_ns: int) -> Zigzag:
    """Describe the zigzag between two instants.

    Parameters
    ----------
    heading : Series
        Unwrapped heading at its own rate, rad.
    rudder : Series
        Rudder angle at its own rate, rad, positive to starboard.
    speed : Series or None
        Speed through the water, m/s.
    start_utc_ns, end_utc_ns : int
        Its bounds; it is given these, whatever the rudder does between them.

    Raises
    ------
    DataRejected
        ``no_legs``: the rudder is not held to one side and then to the other between the bounds.
    """
    inside = [series.between(start_utc_ns, end_utc_ns) for series in (heading, rudder)]
    candidates = []
    if min(map(len, inside)) >= 5:
        signals = Signals.of(*inside)
        for legs in find_chains(signals.rudder_s, signals.rudder, _SAID):
            chain, window_s = measure(signals, legs, _SAID)
            candidates += [(signals, chain, candidate, window_s) for candidate in zigzags_in(chain, _SAID)]
    if not candidates:
        raise DataRejected(
            "no_legs",
            "Between these bounds the rudder is not held to one side and then to the other with the heading following: "
            "there is no zigzag to describe.",
            "Look at rudder and heading with `kempf doctor`, and give bounds that hold two legs at least.",
            {"start_utc_ns": start_utc_ns, "end_utc_ns": end_utc_ns},
        )
    signals, chain, switching, window_s = max(
        candidates, key=lambda c: (c[1].legs[c[2].last].end_s - c[1].legs[c[2].first].start_s, -c[2].scatter)
    )
    zigzag = describe(signals, chain, switching, window_s, speed=speed, settings=_SAID)
    return replace(
        zigzag,
        start_utc_ns=start_utc_ns,
        end_utc_ns=end_utc_ns,
        phases=_filling(zigzag.phases, start_utc_ns, end_utc_ns),
    )


def _filling(phases: tuple[Phase, ...], start_utc_ns: int, end_utc_ns: int) -> tuple[Phase, ...]:
    """Let phases go from bound to bound."""
    first, last = phases[0], phases[-1]
    before = [] if first.start_utc_ns <= start_utc_ns else [Phase("approach", 0, start_utc_ns, first.start_utc_ns)]
    if first.name == "approach" and before:
        phases, before = (replace(first, start_utc_ns=start_utc_ns), *phases[1:]), []
    return (*before, *phases[:-1], replace(phases[-1], end_utc_ns=max(last.end_utc_ns, end_utc_ns)))
