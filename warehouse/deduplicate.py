"""Each manoeuvre once: two logs of one voyage hold the same noise of the sea, and twice is not two."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from kempf.warehouse.segments import Segment

#: executes this close in two logs are one
_SAME_INSTANT_S = 2.0


def once(found: Sequence[Segment], twins: Callable[[Segment, Segment], bool]) -> tuple[list[Segment], dict[str, str]]:
    """Return each manoeuvre once, and why the others are left out.

    Of twins the longest stays, of equally long ones the first by log.

    Parameters
    ----------
    twins : callable
        `_overlap` or `same`; is given the later choice first.
    """
    kept: list[Segment] = []
    left: dict[str, str] = {}
    for one in sorted(found, key=lambda s: (s.start_utc_ns - s.end_utc_ns, s.log_id, s.start_utc_ns)):
        twin = next((other for other in kept if twins(one, other)), None)
        if twin is None:
            kept.append(one)
        else:
            left[one.segment_id] = f"another log holds the same manoeuvre, {twin.segment_id}"
    return kept, left


def _overlap(one: Segment, other: Segment) -> bool:
    """Tell whether two segments share some time."""
    return one.end_utc_ns > other.start_utc_ns and other.end_utc_ns > one.start_utc_ns


def same(one: Segment, other: Segment) -> bool:
    """Tell whether two segments are one manoeuvre: at the same time, to the same side, executes at the same instants.

    The time alone does not decide: logs of a tank count from one stated start.
    """
    if not _overlap(one, other):
        return False
    late = [float(min(abs(theirs - ns) for theirs in other.executes_utc_ns)) * 1e-9 for ns in one.executes_utc_ns]
    return one.first_side == other.first_side and max(late, default=0.0) < _SAME_INSTANT_S
