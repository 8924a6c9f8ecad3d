"""Each manoeuvre once: two logs of one voyage hold the same noise of the sea, and twice is not two."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from math import inf

from kempf.warehouse.tables.segments import Segment

#: executes this close in two logs are one, where one log holds all that the other has
_SAME_INSTANT_S = 2.0

#: ... and where each holds a part of its own, so that fewer have to agree; and nominal rudder angles
_SAME_EXECUTE_S, _SAME_RUDDER_DEG = 0.25, 1.0

#: executes and overshoots this close are those of one signal, written twice: repeated runs differ by more somewhere
_SAME_SAMPLE_S, _SAME_ANGLE_DEG = 0.05, 0.005


def once(segments: Sequence[Segment]) -> tuple[list[Segment], dict[str, str]]:
    """Return each manoeuvre once, and why the others are left out; see `twins`."""
    left = twins(segments)
    kept = [segment for segment in sorted(segments, key=_first_choice) if segment.segment_id not in left]
    return kept, {name: f"another log holds the same manoeuvre, {twin}" for name, twin in left.items()}


def twins(segments: Sequence[Segment]) -> dict[str, str]:
    """Return which manoeuvres another log holds better, see `same`, by id, and the id of that one.

    Of twins the one with the most executes stays, of those the longest, of equally long ones the first by log.
    """
    left: dict[str, str] = {}
    stretches = _stretches(segments)
    # only what shares some time is compared: a vessel may have thousands
    kept_in: dict[int, list[Segment]] = {}
    for segment in sorted(segments, key=_first_choice):
        beside = kept_in.setdefault(bisect_right(stretches, segment.start_utc_ns), [])
        twin = next((other for other in beside if same(segment, other)), None)
        if twin is None:
            beside.append(segment)
        else:
            left[segment.segment_id] = twin.segment_id
    return left


def _stretches(segments: Sequence[Segment]) -> list[int]:
    """Return the beginnings of the stretches of time that segments which overlap one another cover, UTC nanoseconds."""
    beginnings: list[int] = []
    latest_end_ns = 0
    for start_ns, end_ns in sorted((segment.start_utc_ns, segment.end_utc_ns) for segment in segments):
        if not beginnings or start_ns >= latest_end_ns:
            beginnings.append(start_ns)
        latest_end_ns = max(latest_end_ns, end_ns)
    return beginnings


def _first_choice(segment: Segment) -> tuple[int, int, str, int]:
    """Return by what segments are sorted: the most executes first."""
    lasts_ns = segment.end_utc_ns - segment.start_utc_ns
    return -len(segment.executes_utc_ns), -lasts_ns, segment.log_id, segment.start_utc_ns


def _overlap(one: Segment, other: Segment) -> bool:
    """Return whether two segments share some time."""
    return one.end_utc_ns > other.start_utc_ns and other.end_utc_ns > one.start_utc_ns


def same(one: Segment, other: Segment) -> bool:
    """Return whether two segments are one manoeuvre: at the same time, executes at the same instants to the same sides.

    One log may hold more of it than the other, or each a part that the other lacks.

    Where neither log has a time of its own, since both count from a start that the profile states or from the moment
    at which the logger was switched on, the time says nothing: runs of a tank share their start. They are one only
    where what was measured is the same, as in two exports of one run.
    """
    # a zigzag that one log holds to its end may be broken off in the other
    if not _overlap(one, other) or one.is_zigzag != other.is_zigzag:
        return False
    apart = _apart_s(one, other), _apart_s(other, one)
    if one.own_time or other.own_time:
        return min(apart) < _SAME_INSTANT_S or _share_a_part(one, other)
    return one.first_side == other.first_side and max(apart) < _SAME_SAMPLE_S and _measured_alike(one, other)


def _share_a_part(one: Segment, other: Segment) -> bool:
    """Return whether two logs hold one manoeuvre from other beginnings to other ends: the executes between agree."""
    if one.log_id == other.log_id or (one.is_zigzag and abs(one.delta0_deg - other.delta0_deg) > _SAME_RUDDER_DEG):
        return False
    start, end = max(one.start_utc_ns, other.start_utc_ns), min(one.end_utc_ns, other.end_utc_ns)
    # what one log ends with the other may show whole, and so an execute more
    margin = round(_SAME_INSTANT_S * 1e9)
    inside = [_between(segment, start + margin, end - margin) for segment in (one, other)]
    if not all(inside):
        return False
    return max(_farthest_s(*inside), _farthest_s(*inside[::-1])) < _SAME_EXECUTE_S


def _between(segment: Segment, start_ns: int, end_ns: int) -> list[tuple[int, int]]:
    """Return the executes from one instant to another."""
    return [execute for execute in _executes(segment) if start_ns <= execute[0] <= end_ns]


def _executes(segment: Segment) -> list[tuple[int, int]]:
    """Return the instant of every execute, and whether the rudder went to starboard, 1, to port, -1, or unknown, 0.

    In a log that begins within a zigzag the first side is that of a leg whose execute it does not hold.
    """
    found = segment.detail.get("executes")
    if found:
        moved = [execute["rudder_after_deg"] - execute["rudder_before_deg"] for execute in found]
        return [(at, 1 if way > 0.0 else -1) for at, way in zip(segment.executes_utc_ns, moved, strict=True)]
    first = {"starboard": 1, "port": -1}.get(segment.first_side, 0)
    return [(at, 0 if k else first) for k, at in enumerate(segment.executes_utc_ns)]


def _apart_s(one: Segment, other: Segment) -> float:
    """Return the longest time between an execute of the one and the nearest to the same side of the other, s."""
    return _farthest_s(_executes(one), _executes(other))


def _farthest_s(executes: Sequence[tuple[int, int]], others: Sequence[tuple[int, int]]) -> float:
    apart = [
        min((abs(theirs - ns) * 1e-9 for theirs, its_way in others if way * its_way >= 0), default=inf)
        for ns, way in executes
    ]
    return max(apart, default=0.0)


def _measured_alike(one: Segment, other: Segment) -> bool:
    """Return whether two segments measured the same, to what another rounding of one signal leaves."""
    mine, others = _measured_deg(one), _measured_deg(other)
    return len(mine) == len(others) and all(abs(a - b) < _SAME_ANGLE_DEG for a, b in zip(mine, others, strict=True))


def _measured_deg(segment: Segment) -> tuple[float, ...]:
    """Return how the ship answered, deg: the overshoots, or of a random manoeuvre how far the heading went."""
    turned = segment.detail.get("heading_range_deg")
    return segment.overshoots_deg if turned is None else (float(turned), segment.delta0_deg)
