"""A measured spiral by its two ways: which rudder angles it held, and which rates lie beside a prediction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from kempf.flows.jobs.predict.spiral_ways import orders_of, rates_of
from kempf.warehouse.tables.segments import Segment
from tests.warehouse.samples import segment


def spiral(angles: Sequence[float]) -> Segment:
    """Every step has as its rate its number, from 1 on."""
    points: list[dict[str, Any]] = [
        {"rudder_deg": angle, "yaw_rate_deg_s": {"value": float(k), "low": k - 0.5, "high": k + 0.5}}
        for k, angle in enumerate(angles, start=1)
    ]
    return segment("aurora", "log-1", "in-1", kind="spiral", detail={"points": points})


def values(found: Segment) -> dict[str, float]:
    return {name: rate["value"] for name, rate in rates_of(found).items()}


def test_there_and_back_are_two_ways_over_the_same_orders() -> None:
    found = spiral([15.0, 5.0, -5.0, -15.0, -5.2, 4.9, 15.1])
    assert orders_of(found) == (15.0, 5.0, -5.0, -15.0)
    # the way back is numbered by the angles of the way there; the hold at which she turns back counts once
    assert values(found) == {
        **{f"from_starboard_deg_s.{k}": k + 1.0 for k in range(4)},
        **{"from_port_deg_s.0": 7.0, "from_port_deg_s.1": 6.0, "from_port_deg_s.2": 5.0},
    }


def test_an_angle_that_only_the_way_back_holds_is_left_out() -> None:
    assert "from_port_deg_s.1" not in values(spiral([10.0, 0.0, -10.0, 2.0, 10.0]))


def test_of_a_spiral_that_only_comes_from_port_the_angles_are_that_way_s() -> None:
    found = spiral([-15.0, -5.0, 5.0, 15.0])
    assert orders_of(found) == (15.0, 5.0, -5.0, -15.0)
    assert values(found) == {f"from_port_deg_s.{k}": 4.0 - k for k in range(4)}


def test_of_a_spiral_sailed_twice_the_first_two_ways_count() -> None:
    found = spiral([15.0, 5.0, -5.0, -15.0, -5.2, 4.9, 15.1, 5.1, -5.1, -15.1])
    assert orders_of(found) == (15.0, 5.0, -5.0, -15.0)
    assert values(found)["from_starboard_deg_s.1"] == 2.0
    assert len(values(found)) == 7


def test_orders_close_together_share_no_hold() -> None:
    found = spiral([10.0, 0.3, -0.2, -10.0, 0.0, 10.0])
    assert orders_of(found) == (10.0, 0.3, -10.0)
    assert values(found)["from_port_deg_s.1"] == 5.0


def test_without_steps_there_is_nothing_beside() -> None:
    assert orders_of(spiral([])) == () and rates_of(spiral([])) == {}
