"""The entry of the room: all zigzags of one log, found without knowing what was ordered.

Rudder legs that alternate are candidates (`legs`), the headings at which they switch decide (`switching`); the record
of each is measured in `describe`.
"""

from __future__ import annotations

from kempf.pipeline.channels.series import Series
from kempf.pipeline.segment.rudder.legs import find_chains
from kempf.pipeline.segment.rudder.measured import Signals, measure
from kempf.pipeline.segment.rudder.switching import Chain, Switching, zigzags_in
from kempf.pipeline.segment.settings import STANDARD
from kempf.pipeline.segment.zigzags.describe import describe
from kempf.pipeline.segment.zigzags.short import is_trial
from kempf.pipeline.segment.zigzags.zigzag import Zigzag


def find_zigzags(heading: Series, rudder: Series, speed: Series | None = None) -> list[Zigzag]:
    """Find every zigzag in a log.

    Parameters
    ----------
    heading : Series
        Unwrapped heading at its own rate, rad.
    rudder : Series
        Rudder angle at its own rate, rad, positive to starboard. Samples that a logger merely held should be left out.
    speed : Series, optional
        Speed through the water, m/s.

    Returns
    -------
    list of Zigzag
        In order of time, none overlapping another; empty where there is none.

    References
    ----------
    IMO MSC.137(76), Standards for ship manoeuvrability, and MSC/Circ.1053, its explanatory notes; ITTC 7.5-04-02-01.
    """
    if len(heading) < 5 or len(rudder) < 5:
        return []
    signals = Signals.of(heading, rudder)
    candidates: list[tuple[Chain, Switching, float]] = []
    for legs in find_chains(signals.rudder_s, signals.rudder, STANDARD):
        chain, window_s = measure(signals, legs, STANDARD)
        candidates += [
            (chain, switching, window_s)
            for switching in zigzags_in(chain, STANDARD)
            if is_trial(signals, chain, switching, window_s)
        ]
    # the same manoeuvre is seen at several rudder bands: the longest view of it, then the most regular one; few legs
    # from an approach that was not steady say least, and take nothing from the others
    candidates.sort(key=lambda c: (_says_least(c[1]), c[1].first - c[1].last, c[1].scatter, _span(c[0], c[1])))
    taken: list[tuple[Chain, Switching, float]] = []
    for candidate in candidates:
        begin, end = _span(candidate[0], candidate[1])
        spans = (_span(chain, switching) for chain, switching, _ in taken)
        if all(end <= other_begin or begin >= other_end for other_begin, other_end in spans):
            taken.append(candidate)
    taken.sort(key=lambda c: _span(c[0], c[1]))
    return [
        describe(signals, chain, switching, window_s, speed=speed, settings=STANDARD)
        for chain, switching, window_s in taken
    ]


def _says_least(switching: Switching) -> bool:
    """Whether a zigzag has few legs and an approach that was not steady."""
    return switching.start == "turning" and switching.last - switching.first < STANDARD.switchings_without_approach


def _span(chain: Chain, switching: Switching) -> tuple[float, float]:
    """Return from when to when the rudder is held in the zigzag, s."""
    return chain.legs[switching.first].start_s, chain.legs[switching.last].end_s
