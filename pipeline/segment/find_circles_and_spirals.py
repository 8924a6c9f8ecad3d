"""The manoeuvres of one log beside its zigzags: turning circles, pull-outs and spirals, found by themselves.

Turns of the heading say where to look (`turns`), the rudder held meanwhile what it was (`held_rudder`). A manoeuvre
that overlaps a zigzag is not reported again.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.segment.circles.turning_circle import MeasuredCircle, turning_circle
from kempf.pipeline.segment.circles.turns import find_turns, regions
from kempf.pipeline.segment.rudder.held_rudder import HeldRudder, held_stretches
from kempf.pipeline.segment.rudder.measured import Signals
from kempf.pipeline.segment.settings import STANDARD
from kempf.pipeline.segment.spirals.pull_out import PullOut, paired, pull_out
from kempf.pipeline.segment.spirals.spiral import Spiral, find_spirals
from kempf.pipeline.segment.zigzags.zigzag import Zigzag

#: Smallest turn about which circles, pull-outs and spirals are looked for, rad.
_SMALLEST_TURN_RAD = float(np.pi / 3)


def find_circles_and_spirals(
    instruments: Instruments, zigzags: Sequence[Zigzag] = ()
) -> list[MeasuredCircle | PullOut | Spiral]:
    """Find every turning circle, pull-out and direct spiral in a log.

    Parameters
    ----------
    instruments : Instruments
        Series of the log: heading and rudder angle, and for lengths positions or speeds.
    zigzags : sequence of Zigzag, optional
        What was found before: nothing that overlaps one is reported.

    Returns
    -------
    list of MeasuredCircle, PullOut or Spiral
        In order of time; empty where there is none, or heading or rudder are missing. A step of a spiral is no circle
        and no pull-out.

    References
    ----------
    IMO MSC.137(76) and MSC/Circ.1053; ISO 13643-2 and 13643-3; ITTC 7.5-04-02-01.
    """
    heading, rudder = instruments.get("heading"), instruments.get("rudder_angle")
    if heading is None or rudder is None or len(heading) < 5 or len(rudder) < 5:
        return []
    signals = Signals.of(heading, rudder)
    begin_s = max(float(signals.heading_s[0]), float(signals.rudder_s[0]))
    end_s = min(float(signals.heading_s[-1]), float(signals.rudder_s[-1]))
    turns = find_turns(signals.heading_s, signals.heading, _SMALLEST_TURN_RAD)
    manoeuvres: list[MeasuredCircle | PullOut | Spiral] = []
    pull_outs: list[PullOut] = []
    for start, end in regions(turns, begin_s, end_s):
        first, behind = np.searchsorted(signals.rudder_s, [start, end + 1e-9])
        stretches = held_stretches(signals.rudder_s, signals.rudder, int(first), int(behind), signals.rudder_noise)
        free = [stretch for stretch in stretches if not _in_zigzag(signals, stretch, zigzags)]
        spirals = find_spirals(signals, free, STANDARD)
        manoeuvres += spirals
        left = [s for s in free if not any(spiral.holds(signals.utc_ns(s.start_s)) for spiral in spirals)]
        for k, stretch in enumerate(left):
            circle = turning_circle(signals, instruments, stretch, STANDARD)
            if circle is not None:
                manoeuvres.append(circle)
            if k:
                pulled = pull_out(signals, left[k - 1], stretch, STANDARD)
                if pulled is not None:
                    pull_outs.append(pulled)
    return sorted(
        [*manoeuvres, *paired(pull_outs)], key=lambda manoeuvre: (manoeuvre.start_utc_ns, manoeuvre.end_utc_ns)
    )


def _in_zigzag(signals: Signals, stretch: HeldRudder, zigzags: Sequence[Zigzag]) -> bool:
    """Whether a stretch overlaps what lies between a zigzag's first execute and its end."""
    start, end = signals.utc_ns(stretch.start_s), signals.utc_ns(stretch.end_s)
    return any(
        start < zigzag.end_utc_ns and end > (zigzag.executes_utc_ns or (zigzag.start_utc_ns,))[0] for zigzag in zigzags
    )
