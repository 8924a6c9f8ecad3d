"""Manoeuvres that two logs hold, whole or in part: each counts once."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations
from typing import Any

import pytest

from kempf.warehouse.queries.deduplicate import once
from kempf.warehouse.tables.segments import Segment
from tests.warehouse.samples import segment

BEGIN_NS, SECOND_NS = 10**18, 10**9
#: of one zigzag; to starboard, then to port, and so on
EXECUTES_S = (60.0, 95.0, 170.0, 275.0, 380.0, 490.0)


def moves(first: int, last: int) -> list[dict[str, float]]:
    """How the rudder goes over, to starboard first."""
    return [
        {"rudder_before_deg": 20.0 * (-1) ** k * -bool(k), "rudder_after_deg": 20.0 * (-1) ** k}
        for k in range(first, last + 1)
    ]


def part(log: str, first: int, last: int, late_s: float = 0.0, **changes: Any) -> Segment:
    """The executes from one to another as a log shows them that begins and ends 12 s before and after them.

    The first side is that of the first leg, also where the log begins after its execute.
    """
    executes = tuple(BEGIN_NS + round((at + late_s) * SECOND_NS) for at in EXECUTES_S[first : last + 1])
    made = replace(
        segment("aurora", log * 64, log, BEGIN_NS),
        segment_id=f"seg-{log}",
        first_side="starboard" if first % 2 or not first else "port",
        start_utc_ns=executes[0] - 12 * SECOND_NS,
        end_utc_ns=executes[-1] + 12 * SECOND_NS,
        executes_utc_ns=executes,
        overshoots_deg=tuple(8.0 + at for at in range(first, last)),
        detail={"executes": moves(first, last)},
    )
    return replace(made, **changes)


@pytest.mark.parametrize(
    "other",
    [
        part("b", 1, 5, 0.01),
        part("b", 3, 5, -0.1),
        # a minute more of approach makes it the longer one, with fewer executes
        part("b", 0, 3, start_utc_ns=BEGIN_NS - 600 * SECOND_NS),
        part("b", 2, 4, 1.5),
        part("b", 1, 5, kind="zigzag_broken_off"),
    ],
)
def test_parts_of_one_run_are_one_and_that_with_more_executes_stays(other: Segment) -> None:
    whole = part("a", 0, 4)
    for order in permutations([whole, other]):
        kept, left = once(order)
        (stays,) = kept
        assert len(stays.executes_utc_ns) == max(len(one.executes_utc_ns) for one in order)
        assert list(left.values()) == [f"another log holds the same manoeuvre, {stays.segment_id}"]


def test_of_as_many_executes_the_longer_stays() -> None:
    longer = part("b", 1, 5, end_utc_ns=BEGIN_NS + 900 * SECOND_NS)
    for order in permutations([part("a", 0, 4), longer]):
        assert once(order)[0] == [longer]


@pytest.mark.parametrize(
    "other",
    [
        # not the same instants
        part("b", 1, 5, 0.4),
        # the rudder went to the other side, or farther
        part("b", 1, 5, detail={"executes": moves(2, 6)}),
        part("b", 1, 5, delta0_deg=10.0),
        # of the time that both hold the one shows an execute that the other does not
        replace(part("b", 2, 5), start_utc_ns=part("b", 1, 5).start_utc_ns),
        part("b", 5, 5),
        # one behind the other in one log
        replace(part("a", 1, 5), segment_id="seg-b"),
    ],
)
def test_other_runs_stay_apart(other: Segment) -> None:
    for order in permutations([part("a", 0, 4), other]):
        assert len(once(order)[0]) == 2


def test_parts_of_runs_that_share_a_stated_start_stay_apart() -> None:
    runs = [part("a", 0, 4), part("b", 1, 5), part("c", 0, 5)]
    stated = [replace(run, detail={**run.detail, "own_time": False}) for run in runs]
    assert len(once(stated)[0]) == 3
    assert len(once(runs)[0]) == 1
