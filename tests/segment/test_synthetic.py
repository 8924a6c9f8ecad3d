"""Zigzags of a simulated ship, whose executes are known."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.segment.zigzags.find_zigzags import find_zigzags
from kempf.pipeline.segment.zigzags.zigzag import Zigzag
from tests.segment.nomoto import START_NS, Instruments, Ship, measure


def run(
    psi0: float,
    delta0: float,
    side: int = 1,
    legs: int = 6,
    *,
    course: float = 0.0,
    instruments: Instruments | None = None,
    rudder_zero: float = 0.0,
    **ship: float,
) -> tuple[list[Zigzag], list[float]]:
    vessel = Ship(heading=course, **ship)  # type: ignore[arg-type]
    vessel.wait(0.0, 100.0)
    executes = vessel.zigzag(psi0, delta0, side, legs)
    vessel.wait(0.0, 60.0)
    heading, rudder = measure(vessel, instruments or Instruments(), rudder_zero)
    return find_zigzags(heading, rudder), executes


def errors(zigzag: Zigzag, executes: list[float]) -> Float:
    found = np.array([(ns - START_NS) / 1e9 for ns in zigzag.executes_utc_ns], dtype=np.float64)
    return np.asarray(found - np.array(executes), dtype=np.float64)


def angle(a: float, b: float) -> float:
    return abs((a - b + 180.0) % 360.0 - 180.0)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(
    ("psi0", "delta0"),
    [(1, 5), (2, 10), (5, 5), (5, 20), (10, 10), (10, 20), (15, 15), (20, 10), (20, 20), (25, 25), (30, 30), (35, 35)],
)
def test_angles_side_and_executes(psi0: float, delta0: float, side: int) -> None:
    found, executes = run(psi0, delta0, side, course=123.0)
    assert len(found) == 1
    zigzag = found[0]
    assert (zigzag.kind, zigzag.psi0_deg, zigzag.delta0_deg) == ("zigzag", psi0, delta0)
    assert zigzag.first_side == ("starboard" if side > 0 else "port")
    assert angle(zigzag.base_heading_deg, 123.0) < 0.15
    assert len(zigzag.executes) == len(executes)
    assert np.max(np.abs(errors(zigzag, executes))) < 0.4


@pytest.mark.parametrize("course", [0.0, 359.0, -181.0, 725.0])
def test_any_base_heading_also_across_north(course: float) -> None:
    found, executes = run(10, 10, course=course)
    assert len(found) == 1
    assert 0.0 <= found[0].base_heading_deg < 360.0
    assert angle(found[0].base_heading_deg, course) < 0.15
    assert np.max(np.abs(errors(found[0], executes))) < 0.4


@pytest.mark.parametrize("period_s", [0.1, 0.5, 1.0])
@pytest.mark.parametrize(("noise", "step"), [(0.0, 0.0), (0.3, 0.0), (0.1, 0.5), (0.2, 1.0)])
@pytest.mark.parametrize("rate", [2.3, 5.0, 20.0])
def test_executes_within_a_second(period_s: float, noise: float, step: float, rate: float) -> None:
    instruments = Instruments(rudder_s=period_s, rudder_noise_deg=noise, rudder_step_deg=step, heading_noise_deg=0.1)
    found, executes = run(10, 10, instruments=instruments, rudder_rate_deg_s=rate)
    assert len(found) == 1
    assert len(found[0].executes) == len(executes)
    assert np.max(np.abs(errors(found[0], executes))) < 1.0
    uncertainty = np.array([e.time_uncertainty_s for e in found[0].executes])
    assert np.all((uncertainty > 0) & (uncertainty <= period_s))


@pytest.mark.parametrize("scale", [0.15, 1.0, 5.0])
def test_everything_scales_with_the_ship(scale: float) -> None:
    found, executes = run(20, 20, scale=scale)
    assert len(found) == 1
    assert (found[0].psi0_deg, found[0].delta0_deg, len(found[0].executes)) == (20, 20, len(executes))
    assert np.max(np.abs(errors(found[0], executes))) < 0.4 * scale


@pytest.mark.parametrize("zero", [-1.5, 1.5])
def test_rudder_indicator_with_a_zero_error(zero: float) -> None:
    found, executes = run(10, 10, rudder_zero=zero)
    assert len(found) == 1
    assert found[0].delta0_deg == 10
    assert found[0].quality.rudder_offset_deg == pytest.approx(zero, abs=0.2)
    assert np.max(np.abs(errors(found[0], executes))) < 0.4


def test_wind_that_turns_the_ship_makes_unlike_legs() -> None:
    vessel = Ship(drift_deg_s=0.1)
    vessel.autopilot(40.0, 400.0)
    executes = vessel.zigzag(10.0, 10.0, 1, 6)
    vessel.wait(0.0, 30.0)
    found = find_zigzags(*measure(vessel, Instruments()))
    assert len(found) == 1
    assert (found[0].psi0_deg, found[0].delta0_deg, len(found[0].executes)) == (10, 10, 6)
    assert np.max(np.abs(errors(found[0], executes))) < 0.5


def test_random_sweep() -> None:
    random = np.random.default_rng(7)
    for _ in range(40):
        delta0 = float(random.choice([5, 10, 15, 20, 30]))
        psi0 = float(random.choice([5, 10, 15, 20, 30]))
        side, legs = int(random.choice([-1, 1])), int(random.integers(3, 10))
        instruments = Instruments(
            heading_s=float(random.choice([0.1, 0.2, 1.0])),
            rudder_s=float(random.choice([0.1, 0.5, 1.0])),
            heading_noise_deg=float(random.uniform(0, 0.2)),
            rudder_noise_deg=float(random.uniform(0, 0.3)),
            seed=int(random.integers(1_000_000)),
        )
        ship = {
            "gain_per_s": float(random.uniform(0.03, 0.1)),
            "time_constant_s": float(random.uniform(5, 25)),
            "rudder_rate_deg_s": float(random.uniform(2.3, 6)),
        }
        found, executes = run(
            psi0, delta0, side, legs, course=float(random.uniform(0, 360)), instruments=instruments, **ship
        )
        if found and found[0].quality.start == "unknown" and delta0 > psi0:
            continue  # the ship reached psi0 before the rudder reached delta0: the first leg was never held
        case = (psi0, delta0, side, legs, instruments, ship)
        assert len(found) == 1, case
        assert (found[0].psi0_deg, found[0].delta0_deg) == (psi0, delta0), case
        assert len(found[0].executes) == legs, case
        assert np.max(np.abs(errors(found[0], executes))) < 1.0, case


def test_overshoots_equal_those_of_the_noise_free_heading() -> None:
    vessel = Ship()
    vessel.wait(0.0, 60.0)
    executes = vessel.zigzag(20.0, 20.0, 1, 5)
    heading = np.array(vessel.log)[:, 0]
    time = np.arange(1, heading.size + 1) * 0.02
    zigzag = find_zigzags(*measure(vessel, Instruments()))[0]
    for overshoot, begin, end, side in zip(
        zigzag.overshoots, executes[1:], [*executes[2:], time[-1]], [1, -1] * 3, strict=False
    ):
        part = (time >= begin) & (time <= end)
        true = float(np.max(side * heading[part]))
        assert overshoot.beyond_nominal_deg == pytest.approx(true - 20.0, abs=0.1)
        assert overshoot.beyond_execute_deg == pytest.approx(true - side * heading[part][0], abs=0.15)
        peak_s = float(time[part][int(np.argmax(side * heading[part]))])
        assert (overshoot.peak_utc_ns - START_NS) / 1e9 == pytest.approx(peak_s, abs=1.0)
        assert overshoot.side == ("starboard" if side > 0 else "port")


def test_phases_follow_each_other() -> None:
    zigzag = run(20, 20)[0][0]
    assert [p.name for p in zigzag.phases[:8]] == [
        "approach", "execute", "yaw_build_up", "steady_yaw", "execute", "overshoot", "counter_rudder", "steady_yaw",
    ]  # fmt: skip
    assert zigzag.phases[0].start_utc_ns == zigzag.start_utc_ns
    assert zigzag.phases[-1].end_utc_ns == zigzag.end_utc_ns
    for before, after in zip(zigzag.phases, zigzag.phases[1:], strict=False):
        assert before.end_utc_ns == after.start_utc_ns
        assert before.end_utc_ns > before.start_utc_ns


def test_speed_after_the_second_execute() -> None:
    vessel = Ship()
    vessel.wait(0.0, 100.0)
    executes = vessel.zigzag(10.0, 10.0, 1, 5)
    heading, rudder = measure(vessel, Instruments())
    seconds = np.arange(0.0, vessel.now)
    value = np.where(seconds < executes[1], 9.0, 8.0 - 0.001 * (seconds - executes[1]))
    speed = Series(START_NS + (seconds * 1e9).astype(np.int64), value)
    found = find_zigzags(heading, rudder, speed)[0].speed
    assert found is not None
    length = vessel.now - executes[1]
    assert found.approach_m_s == pytest.approx(9.0)
    assert found.mean_m_s == pytest.approx(8.0 - 0.0005 * length, abs=0.02)
    assert found.trend_percent == pytest.approx(-0.1 * length / found.mean_m_s, abs=0.3)
    assert find_zigzags(heading, rudder)[0].speed is None


def test_broken_off_after_the_second_execute_is_kept() -> None:
    vessel = Ship()
    vessel.wait(0.0, 100.0)
    executes = vessel.zigzag(20.0, 20.0, -1, 1)
    executes.append(vessel.now)
    vessel.wait(20.0, 60.0)
    vessel.autopilot(0.0, 200.0)
    found = find_zigzags(*measure(vessel, Instruments()))
    assert len(found) == 1
    assert found[0].kind == "zigzag_broken_off"
    assert (found[0].psi0_deg, found[0].delta0_deg, found[0].first_side) == (20, 20, "port")
    assert np.max(np.abs(errors(found[0], executes))) < 0.4
    assert len(found[0].overshoots) == 1


def test_two_zigzags_after_each_other() -> None:
    vessel = Ship()
    vessel.wait(0.0, 60.0)
    first = vessel.zigzag(20.0, 20.0, 1, 5)
    vessel.autopilot(90.0, 300.0)
    second = vessel.zigzag(10.0, 10.0, -1, 5)
    vessel.wait(0.0, 100.0)
    found = find_zigzags(*measure(vessel, Instruments()))
    assert [(z.psi0_deg, z.delta0_deg, z.first_side) for z in found] == [(20, 20, "starboard"), (10, 10, "port")]
    assert np.max(np.abs(errors(found[0], first))) < 0.4
    assert np.max(np.abs(errors(found[1], second))) < 0.4


def test_log_that_begins_with_the_rudder_over() -> None:
    vessel = Ship()
    vessel.wait(0.0, 60.0)
    executes = vessel.zigzag(20.0, 20.0, 1, 8)
    heading, rudder = measure(vessel, Instruments())
    late = START_NS + round((executes[1] + 15.0) * 1e9)
    found = find_zigzags(heading.between(late, 2**62), rudder.between(late, 2**62))
    assert len(found) == 1
    assert found[0].quality.start == "unknown"
    assert any("approach" in reason for reason in found[0].quality.reasons)
    assert np.max(np.abs(errors(found[0], executes[2:]))) < 0.4
    assert (found[0].psi0_deg, found[0].delta0_deg) == (20, 20)


def test_gap_within_a_leg_is_flagged_and_one_over_an_execute_breaks() -> None:
    vessel = Ship()
    vessel.wait(0.0, 60.0)
    executes = vessel.zigzag(20.0, 20.0, 1, 6)
    heading, rudder = measure(vessel, Instruments())

    def without(series: Series, begin: float, end: float) -> Series:
        seconds = series.seconds_since(START_NS)
        keep = (seconds < begin) | (seconds > end)
        return Series(series.time_utc_ns[keep], series.value[keep])

    middle = (executes[2] + executes[3]) / 2
    found = find_zigzags(without(heading, middle - 4, middle + 4), rudder)
    assert len(found) == 1
    assert found[0].quality.gap_s == pytest.approx(8.0, abs=0.5)
    assert any("not recorded" in reason for reason in found[0].quality.reasons)
    long = executes[3] - executes[2]
    broken = find_zigzags(without(heading, middle - 0.8 * long, middle + 0.8 * long), rudder)
    assert all(len(zigzag.executes) < 6 for zigzag in broken)


def test_same_result_every_time() -> None:
    assert run(10, 10)[0] == run(10, 10)[0]


def test_empty_and_short_series_hold_no_zigzag() -> None:
    empty = Series(np.array([], dtype=np.int64), np.array([]))
    assert find_zigzags(empty, empty) == []
    few = Series(np.arange(4, dtype=np.int64), np.zeros(4))
    assert find_zigzags(few, few) == []


def test_an_hour_at_ten_hertz_is_quick() -> None:
    from time import perf_counter

    vessel = Ship()
    vessel.autopilot(10.0, 1200.0)
    vessel.zigzag(20.0, 20.0, 1, 6)
    vessel.autopilot(0.0, 3600.0 - vessel.now)
    series = measure(vessel, Instruments(heading_s=0.1, rudder_s=0.1))
    times = []
    for _ in range(3):
        start = perf_counter()
        assert len(find_zigzags(*series)) == 1
        times.append(perf_counter() - start)
    assert min(times) < 0.5


@pytest.mark.parametrize("before", [(8.0, 25.0, 0.0), (-8.0, 25.0, 0.0), (-10.0, 25.0, 3.0), (15.0, 60.0, 12.0)])
def test_four_legs_from_an_approach_that_was_not_steady_are_kept_and_labelled(
    before: tuple[float, float, float],
) -> None:
    vessel = Ship()
    vessel.wait(0.0, 100.0)
    rudder, held_s, amidships_s = before
    vessel.wait(rudder, held_s)
    vessel.wait(0.0, amidships_s)
    executes = vessel.zigzag(20.0, 20.0, 1, 4)
    vessel.wait(0.0, 60.0)
    (zigzag,) = find_zigzags(*measure(vessel, Instruments()))
    assert (zigzag.kind, zigzag.psi0_deg, zigzag.delta0_deg) == ("zigzag", 20.0, 20.0)
    assert zigzag.quality.start == "turning"
    assert any("not steady" in reason for reason in zigzag.quality.reasons)
    late = np.abs(errors(zigzag, executes))
    assert np.max(late[1:]) < 0.5
    # a rudder that comes amidships for a moment and goes on is one movement
    assert late[0] < amidships_s + 0.5


@pytest.mark.parametrize("factor", [1.05, 1.08, 0.93])
def test_a_rudder_that_reads_some_per_cent_off_changes_no_nominal_heading(factor: float) -> None:
    vessel = Ship()
    vessel.wait(0.0, 100.0)
    vessel.zigzag(20.0, 20.0, 1, 6)
    heading, rudder = measure(vessel, Instruments())
    true = find_zigzags(heading, rudder)[0]
    found = find_zigzags(heading, Series(rudder.time_utc_ns, factor * rudder.value))[0]
    assert (found.psi0_deg, found.delta0_deg) == (20.0, 20.0)
    assert found.delta0_measured_deg == pytest.approx(factor * true.delta0_measured_deg, rel=1e-3)
    pairs = zip(found.overshoots, true.overshoots, strict=True)
    assert all(one.beyond_nominal_deg == pytest.approx(other.beyond_nominal_deg, abs=0.1) for one, other in pairs)
