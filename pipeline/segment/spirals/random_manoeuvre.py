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

from kempf.pipeline.channels.grid import LONGEST_SPEED_GAP_S, gap_limit_s
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Series
from kempf.pipeline.segment.rudder.held_rudder import HeldRudder, held_stretches
from kempf.pipeline.segment.rudder.measured import Signals, said_of_gap
from kempf.schemas.side import Side
from kempf.schemas.units import SECOND_NS

#: Smallest change of the rudder that is an order of such a manoeuvre, and smallest angle that it goes to or comes from,
#: rad: keeping and regaining a course takes less.
_ORDER_RAD = float(np.deg2rad(15.0))

#: Fewest values of heading and of rudder.
_FEWEST_VALUES = 5

#: Fewest orders.
_FEWEST_ORDERS = 6

#: Longest time between two orders, in medians of it: beyond it she sails a circle or a straight course.
_LONGEST_PAUSE = 4.0

#: Smallest share of the time between first and last order with half of `_ORDER_RAD` and more: she is turned about for
#: most of it, while course alterations on a passage are brief against the courses between them.
_BUSY_SHARE = 0.4

#: Smallest range of the heading, rad: orders that do not turn her say nothing.
_TURNED_RAD = float(np.deg2rad(30.0))

#: Slowest way, as a share of the speed that the log hardly exceeds. Hard over a full ship keeps a third of her approach
#: speed; below that she is stopping, or gathering way.
_SLOWEST_SHARE, _HARDLY_EXCEEDED = 0.3, 90.0

#: Shaft speed astern up to which a shaft counts as stopped, as a share of the one that the log hardly exceeds.
_NOT_ASTERN = 0.05

#: Readings in a row that show that she is slow or her shaft turns astern: one alone may be wrong.
_FEWEST_IN_A_ROW = 3

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
    #: start_utc_ns, end_utc_ns: From a usual rest before the first order to one behind the last; of the rest between
    #: two manoeuvres each has half at most.
    start_utc_ns: int
    end_utc_ns: int
    #: Instants at which the rudder came to a new angle, UTC nanoseconds.
    orders_utc_ns: tuple[int, ...]
    #: Range of the heading, deg.
    heading_range_deg: float
    #: Time within it for which heading or rudder were not recorded, s; no gap is too long to interpolate over.
    gap_s: float

    @property
    def reasons(self) -> tuple[str, ...]:
        """What to know of its quality, in sentences."""
        return said_of_gap(self.gap_s)


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
    way = _way(instruments)
    if way is None or not len(way):
        return []
    signals = Signals.of(heading, rudder)
    occupied = [_span(signals, *bounds) for bounds in taken]
    gaps = [gap for series in (heading, rudder) for gap in _gaps(signals, series, gap_limit_s(series))]
    gaps += _gaps(signals, way, LONGEST_SPEED_GAP_S)
    hindered = [*gaps, *_slow(signals, way), *_astern(signals, instruments)]
    whole = _span(signals, int(way.time_utc_ns[0]), int(way.time_utc_ns[-1]))
    manoeuvres = []
    for span in _without(whole, [*occupied, *hindered]):
        inside = _held_in(signals, span)
        orders = [after for before, after in pairwise(inside) if _is_order(before.rudder, after.rudder)]
        for part, room in _unpaused(orders, span):
            manoeuvre = _described(signals, room, inside, part)
            if manoeuvre is not None:
                manoeuvres.append(manoeuvre)
    return manoeuvres


def _span(signals: Signals, first_utc_ns: int, last_utc_ns: int) -> Span:
    """Return two instants in seconds after the origin."""
    return (first_utc_ns - signals.origin_ns) / SECOND_NS, (last_utc_ns - signals.origin_ns) / SECOND_NS


def _held_in(signals: Signals, span: Span) -> list[HeldRudder]:
    """Return the angles at which the rudder is held within a stretch of time; none where all are small."""
    first, behind = np.searchsorted(signals.rudder_s, span)
    # most of a voyage is not worth a closer look
    if not bool(np.any(np.abs(signals.rudder[first:behind]) >= _ORDER_RAD)):
        return []
    return held_stretches(signals.rudder_s, signals.rudder, int(first), int(behind), signals.rudder_noise)


def _is_order(before: float, after: float) -> bool:
    """Whether the rudder goes far, to a large angle or back from one; angles held before and after, rad."""
    return abs(after - before) >= _ORDER_RAD and max(abs(before), abs(after)) >= _ORDER_RAD


def _unpaused(orders: list[HeldRudder], room: Span) -> list[tuple[list[HeldRudder], Span]]:
    """Divide orders where the rudder rests much longer than between the others, as long as there are enough.

    The stretch of time that they are in is divided in the middle of such a rest.
    """
    if len(orders) < _FEWEST_ORDERS:
        return []
    pauses = np.diff([order.start_s for order in orders])
    at = [int(k) for k in np.flatnonzero(pauses > _LONGEST_PAUSE * np.median(pauses))]
    if not at:
        return [(orders, room)]
    middles = [0.5 * (orders[k].start_s + orders[k + 1].start_s) for k in at]
    counts, bounds = [0, *(k + 1 for k in at), len(orders)], [room[0], *middles, room[1]]
    parts = zip(pairwise(counts), pairwise(bounds), strict=True)
    return [part for (first, end), hers in parts for part in _unpaused(orders[first:end], hers)]


def _described(
    signals: Signals, room: Span, inside: Sequence[HeldRudder], orders: Sequence[HeldRudder]
) -> RandomManoeuvre | None:
    """Return what is recorded of a manoeuvre; None where she hardly turned, or her rudder mostly lay amidships."""
    pause = float(np.median(np.diff([order.start_s for order in orders])))
    begin = max(room[0], orders[0].start_s - pause)
    end = min(room[1], orders[-1].start_s + pause)
    first, behind = np.searchsorted(signals.heading_s, [begin, end + 1e-9])
    heading = signals.heading[first:behind]
    if heading.size < 2 or float(np.ptp(heading)) < _TURNED_RAD or _busy_share(signals, orders) < _BUSY_SHARE:
        return None
    hers = [hold.rudder for hold in inside if begin <= hold.end_s and hold.start_s <= end]
    side = next(rudder for rudder in hers if abs(rudder) >= _ORDER_RAD / 2.0)
    return RandomManoeuvre(
        side="starboard" if side > 0.0 else "port",
        delta0_deg=float(np.rad2deg(max(map(abs, hers)))),
        base_heading_deg=float(np.rad2deg(heading[0]) % 360.0),
        start_utc_ns=signals.utc_ns(begin),
        end_utc_ns=signals.utc_ns(end),
        orders_utc_ns=tuple(signals.utc_ns(order.start_s) for order in orders),
        heading_range_deg=float(np.rad2deg(np.ptp(heading))),
        gap_s=signals.gap_s(begin, end),
    )


def _busy_share(signals: Signals, orders: Sequence[HeldRudder]) -> float:
    """Return the share of the time between first and last order in which the rudder is not about amidships."""
    first, behind = np.searchsorted(signals.rudder_s, [orders[0].start_s, orders[-1].start_s])
    return float(np.mean(np.abs(signals.rudder[first:behind]) >= _ORDER_RAD / 2.0))


def _slow(signals: Signals, way: Series) -> list[Span]:
    """Return when she is seen to make hardly any way ahead."""
    enough = _SLOWEST_SHARE * float(np.percentile(way.value, _HARDLY_EXCEEDED))
    return _seen(signals, way, (way.value < enough) | (enough <= 0.0))


def _astern(signals: Signals, instruments: Instruments) -> list[Span]:
    """Return when the shaft is seen to turn astern."""
    shaft = instruments.get("shaft_speed")
    if shaft is None or not len(shaft):
        return []
    stopped = _NOT_ASTERN * float(np.percentile(np.abs(shaft.value), _HARDLY_EXCEEDED))
    return _seen(signals, shaft, shaft.value < -stopped)


def _gaps(signals: Signals, series: Series, longest_s: float) -> list[Span]:
    """Return the gaps of a channel that a model does not interpolate over."""
    time_s = series.seconds_since(signals.origin_ns)
    at = np.flatnonzero(np.diff(time_s) > longest_s)
    return [(float(time_s[k]), float(time_s[k + 1])) for k in at]


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
    # each at its own instants
    angle = course.value - np.interp(course.time_utc_ns, heading.time_utc_ns, heading.value)
    along = np.interp(ground.time_utc_ns, course.time_utc_ns, np.cos(angle)) * ground.value
    return Series(ground.time_utc_ns, along)


def _seen(signals: Signals, series: Series, holds: NDArray[np.bool_]) -> list[Span]:
    """Return when several readings in a row show something, up to the readings beside them that do not."""
    time_s = series.seconds_since(signals.origin_ns)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(np.int8)))
    first, behind = edges[::2], edges[1::2]
    long = behind - first >= _FEWEST_IN_A_ROW
    begins, ends = time_s[np.maximum(first - 1, 0)][long], time_s[np.minimum(behind, time_s.size - 1)][long]
    return [(float(begin), float(end)) for begin, end in zip(begins, ends, strict=True)]


def _without(whole: Span, spans: Sequence[Span]) -> list[Span]:
    """Return what is left of a stretch of time without others."""
    left, begin = [], whole[0]
    for first, last in sorted(spans):
        if first > begin:
            left.append((begin, min(first, whole[1])))
        begin = max(begin, last)
    left.append((begin, whole[1]))
    return [span for span in left if span[1] > span[0]]
