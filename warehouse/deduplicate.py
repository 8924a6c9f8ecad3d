"""Each manoeuvre once: two logs of one voyage hold the same noise of the sea, and twice is not two."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from kempf.warehouse.segments import Segment

#: executes this close in two logs are one
_SAME_INSTANT_S = 2.0

#: executes and overshoots this close are those of one signal, written twice: repeated runs differ by more somewhere
_SAME_SAMPLE_S, _SAME_ANGLE_DEG = 0.05, 0.005


def once(
    segments: Sequence[Segment], twins: Callable[[Segment, Segment], bool]
) -> tuple[list[Segment], dict[str, str]]:
    """Return each manoeuvre once, and why the others are left out.

    Of twins the longest stays, of equally long ones the first by log.

    Parameters
    ----------
    twins : callable
        `_overlap` or `same`; is given the later choice first.
    """
    kept: list[Segment] = []
    left: dict[str, str] = {}
    for segment in sorted(segments, key=lambda s: (s.start_utc_ns - s.end_utc_ns, s.log_id, s.start_utc_ns)):
        twin = next((other for other in kept if twins(segment, other)), None)
        if twin is None:
            kept.append(segment)
        else:
            left[segment.segment_id] = f"another log holds the same manoeuvre, {twin.segment_id}"
    return kept, left


def _overlap(one: Segment, other: Segment) -> bool:
    """Return whether two segments share some time."""
    return one.end_utc_ns > other.start_utc_ns and other.end_utc_ns > one.start_utc_ns


def same(one: Segment, other: Segment) -> bool:
    """Return whether two segments are one manoeuvre: at the same time, executes at the same instants.

    Where neither log has a time of its own, since both count from a start that the profile states or from the moment
    at which the logger was switched on, the time says nothing: runs of a tank share their start. They are one only
    where what was measured is the same, as in two exports of one run.
    """
    # a zigzag that one log holds to its end may be broken off in the other
    if not _overlap(one, other) or one.first_side != other.first_side or one.is_zigzag != other.is_zigzag:
        return False
    late = _apart_s(one, other)
    if one.own_time or other.own_time:
        return late < _SAME_INSTANT_S
    return max(late, _apart_s(other, one)) < _SAME_SAMPLE_S and _measured_alike(one, other)


def _apart_s(one: Segment, other: Segment) -> float:
    """Return the longest time between an execute of the one and the nearest of the other, s."""
    apart = [float(min(abs(theirs - ns) for theirs in other.executes_utc_ns)) * 1e-9 for ns in one.executes_utc_ns]
    return max(apart, default=0.0)


def _measured_alike(one: Segment, other: Segment) -> bool:
    """Return whether two segments measured the same, to what another rounding of one signal leaves."""
    mine, others = _measured_deg(one), _measured_deg(other)
    return len(mine) == len(others) and all(abs(a - b) < _SAME_ANGLE_DEG for a, b in zip(mine, others, strict=True))


def _measured_deg(segment: Segment) -> tuple[float, ...]:
    """Return how the ship answered, deg: the overshoots, or of a random manoeuvre how far the heading went."""
    turned = segment.detail.get("heading_range_deg")
    return segment.overshoots_deg if turned is None else (float(turned), segment.delta0_deg)
