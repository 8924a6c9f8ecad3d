"""Zigzags in measured logs: the towing tank, the unmanned boat at sea, and the trial logs of eight ships."""

from __future__ import annotations

import re

import numpy as np
import pytest

from kempf.pipeline.segment.zigzags.find_zigzags import find_zigzags
from kempf.pipeline.segment.zigzags.zigzag import Zigzag
from tests.segment.loading import Log, available, load

TANK = available("data/kvlcc2_hsva/*.dat")
TRIALS = available("trials/*/2*")
CALM = [name for name in TRIALS if "ekaterina" not in name]


def zigzags(name: str) -> tuple[Log, list[Zigzag]]:
    log = load(name)
    return log, find_zigzags(log.heading, log.rudder, log.speed)


def independent_start(log: Log, execute_ns: int) -> float:
    """Read the start of a ramp another way: when it is half way, less half its duration at the gear's median rate.

    The angle before and after are medians over the second before the movement and after it; the rate is the median of
    the steepest steps in the log. Returned in s relative to the execute found.
    """
    seconds = log.rudder.seconds_since(execute_ns)
    rudder = log.rudder.value
    step = log.rudder.period_s
    steps = np.abs(np.diff(rudder))
    rate = float(np.median(steps[steps > 0.5 * np.max(steps)])) / step
    before = float(np.median(rudder[(seconds > -6 * step) & (seconds < -step)]))
    moving = np.flatnonzero((seconds > -step) & (np.abs(rudder - before) > 0.03))
    side = np.sign(rudder[moving[0]] - before)
    after = before
    for index in moving:
        if side * (rudder[index] - after) < 0.2 * rate * step and abs(rudder[index] - before) > 0.05:
            break
        after = float(rudder[index])
    half = (before + after) / 2
    k = int(np.flatnonzero((seconds > -step) & (side * (rudder - half) > 0))[0])
    crossing = np.interp(side * half, side * rudder[k - 1 : k + 1], seconds[k - 1 : k + 1])
    return float(crossing - abs(after - before) / 2 / rate)


@pytest.mark.parametrize("name", TANK)
def test_towing_tank_angles(name: str) -> None:
    _, found = zigzags(name)
    order = re.search(r"Z_(\d+)_(\d+)", name)
    assert order is not None
    assert len(found) == 1
    assert found[0].kind == "zigzag"
    assert (found[0].delta0_deg, found[0].psi0_deg) == (float(order[1]), float(order[2]))
    assert found[0].first_side == ("port" if name.endswith("_P.dat") else "starboard")
    assert min(found[0].base_heading_deg, 360 - found[0].base_heading_deg) < 0.3
    assert found[0].quality.start == "steady"


@pytest.mark.parametrize(
    ("side", "nominal", "execute"), [("S", (9.7, 20.5), (9.1, 19.7)), ("P", (9.7, 17.8), (9.2, 16.9))]
)
def test_towing_tank_overshoots(side: str, nominal: tuple[float, ...], execute: tuple[float, ...]) -> None:
    _, found = zigzags(f"data/kvlcc2_hsva/HSVA_CPMC_KVLCC2_Z_10_10_{side}.dat")
    assert [o.beyond_nominal_deg for o in found[0].overshoots] == pytest.approx(nominal, abs=0.1)
    assert [o.beyond_execute_deg for o in found[0].overshoots] == pytest.approx(execute, abs=0.1)


def test_towing_tank_number_of_legs() -> None:
    legs = [len(zigzags(name)[1][0].executes) for name in TANK]
    # counted by eye on the drawings, in the order of the file names
    assert legs == [9, 11, 6, 3, 3, 11, 8, 9, 8, 8, 10, 11, 12]


def test_towing_tank_executes_against_the_first_sample_that_moves() -> None:
    """The tank's rudder is free of noise at 20 Hz: the first sample that differs brackets the execute."""
    for name in TANK:
        log, found = zigzags(name)
        for execute in found[0].executes:
            seconds = log.rudder.seconds_since(execute.time_utc_ns)
            still = np.abs(np.rad2deg(log.rudder.value) - execute.rudder_before_deg) < 0.3
            near = (seconds > -0.5) & (seconds < 0.5)
            last = float(np.max(seconds[near & still]))
            assert abs(last) < 0.3, name


def test_unmanned_boat() -> None:
    log, found = zigzags("data/usv_open_water/zigzag_30_inter_xy.csv")
    assert len(found) == 1
    assert (found[0].psi0_deg, found[0].delta0_deg) == (30, 30)
    assert found[0].quality.start == "unknown"
    # the last sample at the old angle, read off the file by eye
    read = np.array([8.0, 24.0, 46.0, 62.5, 80.5, 97.0, 116.0, 132.0, 151.0, 167.0, 186.5, 204.0])
    executes = [(ns - int(log.heading.time_utc_ns[0])) / 1e9 for ns in found[0].executes_utc_ns]
    assert np.max(np.abs(np.array(executes) - read)) < 1.0


def test_turning_circle_is_none() -> None:
    assert zigzags("data/usv_open_water/turnningdata_xy.csv")[1] == []


@pytest.mark.parametrize("name", CALM)
def test_trial_day_holds_a_20_20_and_a_10_10(name: str) -> None:
    log, found = zigzags(name)
    printed = [(z.kind, z.psi0_deg, z.delta0_deg, z.first_side, len(z.executes)) for z in found]
    assert printed == [("zigzag", 20, 20, "starboard", 7), ("zigzag", 10, 10, "port", 6)]
    for zigzag in found:
        assert len(zigzag.overshoots) == len(zigzag.executes) - 1
        assert zigzag.quality.switching_scatter_deg < 0.8
        assert zigzag.quality.rudder_scatter_deg < 0.2
        assert zigzag.speed is not None
        late = [independent_start(log, ns) for ns in zigzag.executes_utc_ns]
        assert np.max(np.abs(late)) < 0.6


@pytest.mark.parametrize("name", [name for name in TRIALS if "ekaterina" in name])
def test_ship_that_loses_her_way(name: str) -> None:
    """Seven legs switch at K0 +- 20 and are a zigzag, though the overshoots grow from 13 to 39 deg.

    What follows is none: the autopilot has the rudder hard over and does not catch the ship, so when the 10 deg legs
    are ordered she has no steady course, and only three of them switch about a common heading.
    """
    _, found = zigzags(name)
    assert [(z.psi0_deg, z.delta0_deg, len(z.executes)) for z in found] == [(20, 20, 7)]
    grown = [o.beyond_nominal_deg for o in found[0].overshoots]
    assert grown == sorted(grown)
    assert grown[-1] > 35
    assert any("speed changed" in reason for reason in found[0].quality.reasons)
