"""Random manoeuvres: large rudder orders at irregular times, as they are sailed to identify a model.

Neither the headings nor the angles repeat, so that they are no zigzag; the ship goes ahead and turns meanwhile. They
visit speeds and rates of turn that zigzags do not, which is what they are sailed for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Nanoseconds, Series
from kempf.pipeline.segment.held_rudder import HeldRudder, held_stretches
from kempf.pipeline.segment.measured import Signals
from kempf.pipeline.segment.zigzag import Side

#: Smallest change of the rudder that is an order of such a manoeuvre, and smallest angle that it goes to or comes from,
#: rad: keeping and regaining a course takes less.
_ORDER_RAD = float(np.deg2rad(15.0))

#: Fewest values of heading and of rudder.
_FEWEST_VALUES = 5

#: Fewest orders.
_FEWEST_ORDERS = 6

#: Longest time between two orders, in medians of it: beyond it she sails a circle or a straight course.
_LONGEST_PAUSE = 4.0

#: Smallest range of the heading, rad: orders that do not turn her say nothing.
_TURNED_RAD = float(np.deg2rad(30.0))

#: Slowest way, as a share of the speed that the log hardly exceeds. Hard over a full ship keeps a third of her approach
#: speed; below that she is stopping, or gathering way.
_SLOWEST_SHARE, _HARDLY_EXCEEDED = 0.3, 90.0

#: Shaft speed astern up to which a shaft counts as stopped, as a share of the one that the log hardly exceeds.
_NOT_ASTERN = 0.05

#: Longest time between two readings that say whether she goes ahead, in medians of it.
_LONGEST_GAP = 5.0

#: beginning and end of a stretch of time, s
Span = tuple[float, float]


@dataclass(frozen=True)
class RandomManoeuvre:
    """One random manoeuvre."""

    #: One of {"starboard", "port"}. Side of the first rudder that is not amidships.
    side: Side
    #: Largest rudder angle held, deg.
    delta0_deg: float
    #: Heading at the beginning, 0 to 360 deg.
    base_heading_deg: float
    #: start_utc_ns, end_utc_ns: From a usual pause before the first order to one behind the last.
    start_utc_ns: int
    end_utc_ns: int
    #: Instants at which the rudder came to a new angle, UTC nanoseconds.
    orders_utc_ns: tuple[int, ...]
    #: Range of the heading, deg.
    heading_range_deg: float
    #: Time within it for which heading or rudder were not recorded, s.
    gap_s: float


def find_random(instruments: Instruments, taken: Sequence[tuple[int, int]] = ()) -> list[RandomManoeuvre]:
    """Find every random manoeuvre in a log.

    Parameters
    ----------
    instruments : Instruments
        Series of the log: heading and rudder angle, the way through the water, else over ground, and the shaft speed
        where it is recorded.
    taken : sequence of (int, int)
        Bounds of the manoeuvres that were found before, UTC nanoseconds: nothing of theirs is used again.

    Returns
    -------
    list of RandomManoeuvre
        In order of time; empty where there is none, or heading, rudder or any speed are missing.

    References
    ----------
    Wakita et al. 2022, doi 10.1007/s00773-021-00867-1; Miyauchi et al. 2022, doi 10.1007/s00773-022-00889-3.
    """
    heading, rudder = instruments.get("heading"), instruments.get("rudder_angle")
    if heading is None or rudder is None or len(heading) < _FEWEST_VALUES or len(rudder) < _FEWEST_VALUES:
        return []
    signals = Signals.of(heading, rudder)
    occupied = [tuple((ns - signals.origin_ns) * 1e-9 for ns in bounds) for bounds in taken]
    found = []
    for span in _without(_ahead(signals, instruments), occupied):
        inside = _held_in(signals, span)
        orders = [after for before, after in pairwise(inside) if _is_order(before.rudder, after.rudder)]
        found += [one for part in _unpaused(orders) if (one := _described(signals, span, inside, part)) is not None]
    return found


def _held_in(signals: Signals, span: Span) -> list[HeldRudder]:
    """Return the angles at which the rudder is held, each begun within a stretch of time; none where all are small."""
    first, behind = np.searchsorted(signals.rudder_s, span)
    # most of a voyage is not worth a closer look
    if not bool(np.any(np.abs(signals.rudder[first:behind]) >= _ORDER_RAD)):
        return []
    held = held_stretches(signals.rudder_s, signals.rudder, int(first), int(behind), signals.rudder_noise)
    return held[1:] if held and first and held[0].first == first else held


def _is_order(before: float, after: float) -> bool:
    """Whether the rudder goes far, to a large angle or back from one; angles held before and after, rad."""
    return abs(after - before) >= _ORDER_RAD and max(abs(before), abs(after)) >= _ORDER_RAD


def _unpaused(orders: list[HeldRudder]) -> list[list[HeldRudder]]:
    """Divide orders where the rudder rests much longer than between the others, as long as there are enough."""
    if len(orders) < _FEWEST_ORDERS:
        return []
    pauses = np.diff([one.start_s for one in orders])
    at = np.flatnonzero(pauses > _LONGEST_PAUSE * np.median(pauses))
    if not at.size:
        return [orders]
    edges = [0, *(int(k) + 1 for k in at), len(orders)]
    return [part for first, end in pairwise(edges) for part in _unpaused(orders[first:end])]


def _described(
    signals: Signals, span: Span, inside: Sequence[HeldRudder], orders: Sequence[HeldRudder]
) -> RandomManoeuvre | None:
    """Return what is recorded of a manoeuvre; None where she hardly turned."""
    pause = float(np.median(np.diff([one.start_s for one in orders])))
    begin = max(span[0], orders[0].start_s - pause)
    end = min(span[1], orders[-1].start_s + pause)
    first, behind = np.searchsorted(signals.heading_s, [begin, end + 1e-9])
    heading = signals.heading[first:behind]
    if heading.size < 2 or float(np.ptp(heading)) < _TURNED_RAD:
        return None
    hers = [one.rudder for one in inside if begin <= one.end_s and one.start_s <= end]
    side = next(rudder for rudder in hers if abs(rudder) >= _ORDER_RAD / 2.0)
    return RandomManoeuvre(
        side="starboard" if side > 0.0 else "port",
        delta0_deg=float(np.rad2deg(max(map(abs, hers)))),
        base_heading_deg=float(np.rad2deg(heading[0]) % 360.0),
        start_utc_ns=signals.utc_ns(begin),
        end_utc_ns=signals.utc_ns(end),
        orders_utc_ns=tuple(signals.utc_ns(one.start_s) for one in orders),
        heading_range_deg=float(np.rad2deg(np.ptp(heading))),
        gap_s=signals.gap_s(begin, end),
    )


def _ahead(signals: Signals, instruments: Instruments) -> list[Span]:
    """Return when she makes way ahead, and her shaft does not turn astern, where it is recorded."""
    speed = _way(instruments)
    if speed is None:
        return []
    enough = _SLOWEST_SHARE * float(np.percentile(speed.value, _HARDLY_EXCEEDED))
    spans = _spans(speed.time_utc_ns, speed.value >= enough, signals) if enough > 0.0 else []
    shaft = instruments.get("shaft_speed")
    if shaft is None or not len(shaft):
        return spans
    astern = _NOT_ASTERN * float(np.percentile(np.abs(shaft.value), _HARDLY_EXCEEDED))
    turning = _spans(shaft.time_utc_ns, shaft.value >= -astern, signals)
    return _common(spans, turning)


def _common(spans: Sequence[Span], others: Sequence[Span]) -> list[Span]:
    """Return the stretches of time that two series of them share; each is in order of time, without overlaps."""
    found, k, j = [], 0, 0
    while k < len(spans) and j < len(others):
        begin, end = max(spans[k][0], others[j][0]), min(spans[k][1], others[j][1])
        if begin < end:
            found.append((begin, end))
        if spans[k][1] <= others[j][1]:
            k += 1
        else:
            j += 1
    return found


def _way(instruments: Instruments) -> Series | None:
    """Return the speed ahead: through the water, else the part over ground that lies along the ship."""
    log = instruments.get("speed_through_water")
    if log is not None and len(log):
        return log
    ground, course, heading = (instruments.get(n) for n in ("speed_over_ground", "course_over_ground", "heading"))
    if ground is None or not len(ground):
        return None
    if course is None or heading is None or not len(course) or len(heading) < 2:
        return ground
    # the two are of one receiver and share their rows, see `channels.instruments`
    angle = course.value - np.interp(course.time_utc_ns, heading.time_utc_ns, heading.value)
    along = np.interp(ground.time_utc_ns, course.time_utc_ns, np.cos(angle)) * ground.value
    return Series(ground.time_utc_ns, along)


def _spans(time_utc_ns: Nanoseconds, holds: NDArray[np.bool_], signals: Signals) -> list[Span]:
    """Return from when to when something holds, of three readings at least, and not across a gap."""
    time_s = (time_utc_ns - signals.origin_ns) * 1e-9
    if time_s.size < 3:
        return []
    steps = np.diff(time_s)
    breaks = np.flatnonzero((np.diff(holds.astype(np.int8)) != 0) | (steps > _LONGEST_GAP * np.median(steps))) + 1
    groups = np.split(np.arange(time_s.size), breaks)
    return [(float(time_s[g[0]]), float(time_s[g[-1]])) for g in groups if g.size >= 3 and holds[g[0]]]


def _without(spans: Sequence[Span], occupied: Sequence[tuple[float, ...]]) -> list[Span]:
    """Take stretches of time out of others."""
    left = list(spans)
    for begin, end in occupied:
        pieces = [piece for a, b in left for piece in ((a, min(b, begin)), (max(a, end), b))]
        left = [piece for piece in pieces if piece[1] > piece[0]]
    return sorted(left)
