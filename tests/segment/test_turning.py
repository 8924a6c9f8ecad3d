"""Turning circles, pull-outs and spirals that were sailed, and steering that is none of them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from kempf.pipeline.channels.instruments import Instruments as Channels
from kempf.pipeline.channels.series import Series
from kempf.pipeline.segment.circles.circle_drift import current_by_log
from kempf.pipeline.segment.circles.imo_turning import judge_circle
from kempf.pipeline.segment.circles.turn_track import TurnTrack
from kempf.pipeline.segment.circles.turning_circle import MeasuredCircle
from kempf.pipeline.segment.find_circles_and_spirals import find_circles_and_spirals
from kempf.pipeline.segment.particulars import Particulars
from kempf.pipeline.segment.spirals.pull_out import PullOut
from kempf.pipeline.segment.spirals.spiral import Spiral, SpiralPoint
from kempf.pipeline.segment.zigzags.find_zigzags import find_zigzags
from kempf.pipeline.simulate.disturbances import CALM, Disturbance, Environment
from kempf.pipeline.simulate.manoeuvre import RudderHold, SteadyCourse
from kempf.pipeline.simulate.manoeuvre import TurningCircle as Turn
from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT
from tests.segment.nomoto import Instruments, Ship, measure
from tests.segment.sailed import START_NS, direct_spiral, instruments, sailed, true_circle

STREAM = Environment(current_north=Disturbance(0.5), current_east=Disturbance(-0.4))
LENGTHS = ("advance_m", "transfer_m", "tactical_diameter_m")

#: Norrbin's ship: K delta = -a r + c r^3, unstable between the folds.
UNSTABLE = {"straight": -0.5, "cubic": 1.0, "gain_per_s": 0.06}


def circle_of(found: list[MeasuredCircle | PullOut | Spiral]) -> MeasuredCircle:
    (circle,) = found
    assert isinstance(circle, MeasuredCircle)
    return circle


def tiny(ship: Ship, instruments: Instruments | None = None) -> list[MeasuredCircle | PullOut | Spiral]:
    heading, rudder = measure(ship, instruments or Instruments())
    return find_circles_and_spirals(Channels({"heading": heading, "rudder_angle": rudder}, {}, ()))


@pytest.mark.parametrize(("hull", "rudder"), [("ferry", 35.0), ("mariner", -20.0), ("usv", 20.0)])
@pytest.mark.parametrize("environment", [CALM, STREAM])
def test_figures_hold_the_truth_through_the_water(hull: str, rudder: float, environment: Environment) -> None:
    trial = sailed((SteadyCourse(60.0 if hull == "usv" else 300.0), Turn(rudder, 900.0)), hull, environment, seed=3)
    execute_s = trial.truth.manoeuvres[1].start_s
    circle = circle_of(find_circles_and_spirals(instruments(trial)))
    assert circle.execute_utc_ns is not None
    assert (circle.execute_utc_ns - START_NS) / 1e9 == pytest.approx(execute_s, abs=0.3)
    assert (circle.side, circle.delta0_deg) == ("starboard" if rudder > 0 else "port", abs(rudder))
    assert circle.base_heading_deg == pytest.approx(70.0, abs=0.5)
    assert abs(circle.heading_change_deg) == pytest.approx(900.0, abs=10.0)
    assert circle.measured.track == "positions"
    assert circle.measured.corrected is (environment is STREAM)
    figures, truth = circle.measured.figures, true_circle(trial, execute_s)
    for name in LENGTHS:
        figure = figures[name]
        assert figure.value is not None
        # three standard errors: eighteen figures are asked
        assert abs(figure.value - truth[name]) < 3.0 * figure.std, name
        assert figure.std < (0.25 if hull == "usv" else 0.1) * figure.value, name
    path = trial.truth.trajectory
    whole = np.abs(path.column("psi")[-1] - path.column("psi")) <= 2.0 * np.pi
    rate = float(np.rad2deg(np.mean(path.column("r")[whole])))
    assert figures["steady_yaw_rate_deg_s"].value == pytest.approx(rate, rel=0.02)
    assert figures["steady_diameter_m"].value == pytest.approx(figures["steady_diameter_of_track_m"].value, rel=0.06)
    speed = np.hypot(path.column("V"), path.column("v"))
    lost = 100.0 * (1.0 - float(np.mean(speed[whole])) / float(speed[int(execute_s / path.step_s)]))
    assert figures["speed_loss_percent"].value == pytest.approx(lost, abs=3.0)
    drift = abs(float(np.rad2deg(np.mean(np.arctan2(path.column("v"), path.column("V"))[whole]))))
    assert figures["steady_drift_deg"].value == pytest.approx(drift, abs=1.5)


@pytest.mark.parametrize(("hull", "rudder", "turn_deg"), [("ferry", 35.0, 380.0), ("mariner", -35.0, 340.0)])
def test_of_one_turn_the_water_log_shows_the_current(hull: str, rudder: float, turn_deg: float) -> None:
    trial = sailed((SteadyCourse(300.0), Turn(rudder, turn_deg)), hull, STREAM, seed=3)
    truth = true_circle(trial, trial.truth.manoeuvres[1].start_s)
    circle = circle_of(find_circles_and_spirals(instruments(trial)))
    assert circle.measured.corrected
    assert any("water log shows a current of" in reason for reason in circle.quality.reasons)
    assert circle.measured.drift is not None
    off = np.hypot(circle.measured.drift.north_m_s - 0.5, circle.measured.drift.east_m_s + 0.4)
    assert off < 3.0 * np.sqrt(2.0) * circle.measured.drift.std_m_s < 0.5
    for name in LENGTHS:
        figure = circle.measured.figures[name]
        assert figure.value is not None
        assert abs(figure.value - truth[name]) < 3.0 * figure.std, name
    # over ground the tactical diameter is not hers
    assert circle.measured.over_ground["tactical_diameter_m"] != pytest.approx(truth["tactical_diameter_m"], rel=0.03)
    without = circle_of(find_circles_and_spirals(instruments(trial, without=("speed_through_water",))))
    assert not without.measured.corrected
    assert without.measured.drift is None


@pytest.mark.parametrize(("hull", "hold_s"), [("ferry", 80.0), ("mariner", 120.0), ("container", 100.0)])
@pytest.mark.parametrize("environment", [CALM, PAPER_ENVIRONMENT])
def test_a_stable_ship_that_lags_behind_short_steps_has_no_loop(
    hull: str, hold_s: float, environment: Environment
) -> None:
    steps = direct_spiral((20.0, 15.0, 10.0, 5.0, 0.0, -5.0, -10.0, -15.0, -20.0), hold_s)
    trial = sailed((SteadyCourse(200.0), *steps, SteadyCourse(200.0)), hull, environment, seed=4)
    (spiral,) = find_circles_and_spirals(instruments(trial))
    assert isinstance(spiral, Spiral)
    assert (spiral.loop, spiral.n_ways) == ("none seen", 2)
    # at the same rudder she comes to the same rate from either side
    by_rudder: dict[int, list[SpiralPoint]] = {}
    for point in spiral.points[1:-1]:
        by_rudder.setdefault(round(point.rudder_deg), []).append(point)
    pairs = [pair for pair in by_rudder.values() if len(pair) == 2]
    assert len(pairs) == 7
    for one, other in pairs:
        off = abs((one.yaw_rate_deg_s.value or 0.0) - (other.yaw_rate_deg_s.value or 0.0))
        assert off < 3.0 * np.hypot(one.yaw_rate_deg_s.std, other.yaw_rate_deg_s.std)


@pytest.mark.parametrize(("hull", "hold_s"), [("ferry", 220.0), ("mariner", 340.0), ("container", 320.0)])
def test_the_rate_that_is_left_is_the_one_that_she_comes_to(hull: str, hold_s: float) -> None:
    pull_out = RudderHold(0.0, hold_s)
    programme = (SteadyCourse(200.0), Turn(15.0, 400.0), pull_out, SteadyCourse(400.0), Turn(-15.0, 400.0), pull_out)
    trial = sailed((*programme, SteadyCourse(200.0)), hull, PAPER_ENVIRONMENT, seed=1)
    found = [one for one in find_circles_and_spirals(instruments(trial)) if isinstance(one, PullOut)]
    assert [one.verdict for one in found] == ["no instability seen"] * 2
    for one in found:
        left, initial = one.figures["residual_yaw_rate_deg_s"], one.figures["initial_yaw_rate_deg_s"]
        assert left.value is not None and initial.value is not None
        # the wind turns her by less than a tenth of a degree a second
        assert abs(left.value) < 0.1 + 2.0 * left.std < 0.4 * abs(initial.value)


def test_noise_of_the_log_is_no_current() -> None:
    """She loses three eighths of her speed in the turn, and her log is good to 0.2 m/s."""
    execute_s, rate, lasted_s = 60.0, np.deg2rad(1.5), 60.0 + 365.0 / 1.5
    time_s = np.arange(0.0, lasted_s, 1.0)
    since = np.maximum(time_s - execute_s, 0.0)
    ahead, across = 8.0 - 3.0 * (1.0 - np.exp(-since / 40.0)), -1.5 * (1.0 - np.exp(-since / 20.0))
    heading = rate * since
    north = ahead * np.cos(heading) - across * np.sin(heading) + 0.3
    east = ahead * np.sin(heading) + across * np.cos(heading) - 0.2
    path = TurnTrack(
        time_s=time_s,
        north_m=np.cumsum(north),
        east_m=np.cumsum(east),
        heading_rad=heading,
        speed_m_s=np.hypot(north, east),
        drift_rad=heading - np.unwrap(np.arctan2(east, north)),
        log_m_s=ahead,
        source="positions",
        distance_std_m=1.0,
        bridged_share=0.0,
    )
    off, std = [], []
    for seed in range(40):
        noise = np.random.default_rng(seed).normal(0.0, 0.2, time_s.size)
        found = current_by_log(replace(path, log_m_s=1.02 * ahead - 0.1 + noise), execute_s, 0.0)
        assert found is not None
        off.append((found.north_m_s - 0.3, found.east_m_s + 0.2))
        std.append(found.std_m_s)
    assert np.max(np.abs(np.mean(off, axis=0))) < 0.02
    assert np.max(np.std(off, axis=0)) < 1.5 * np.mean(std) < 0.1
    assert current_by_log(replace(path, log_m_s=np.full(time_s.size, np.nan)), execute_s, 0.0) is None


def test_without_a_log_the_drift_is_said_and_left_in() -> None:
    trial = sailed((SteadyCourse(300.0), Turn(35.0, 900.0)), "ferry", STREAM)
    circle = circle_of(find_circles_and_spirals(instruments(trial, without=("speed_through_water",))))
    assert not circle.measured.corrected
    assert any("no water log shows a current" in reason for reason in circle.quality.reasons)
    truth = true_circle(trial, trial.truth.manoeuvres[1].start_s)
    for name in LENGTHS:
        over_ground, less_drift = circle.measured.over_ground[name], circle.measured.less_drift[name]
        assert circle.measured.figures[name].value == over_ground
        assert less_drift is not None
        assert less_drift == pytest.approx(truth[name], rel=0.04)
    assert circle.measured.over_ground["tactical_diameter_m"] != pytest.approx(truth["tactical_diameter_m"], rel=0.04)


def test_velocities_without_positions_give_the_same_circle() -> None:
    trial = sailed((SteadyCourse(300.0), Turn(-35.0, 900.0)), "ferry")
    positions = circle_of(find_circles_and_spirals(instruments(trial)))
    velocities = circle_of(find_circles_and_spirals(instruments(trial, without=("latitude", "longitude"))))
    assert velocities.measured.track == "speed and course over ground"
    for name in LENGTHS:
        one, other = positions.measured.figures[name].value, velocities.measured.figures[name].value
        assert other == pytest.approx(one, rel=0.02)


def test_the_log_alone_and_the_compass_alone() -> None:
    trial = sailed((SteadyCourse(300.0), Turn(20.0, 560.0)), "ferry")
    gnss = ("latitude", "longitude", "speed_over_ground", "course_over_ground")
    logged = circle_of(find_circles_and_spirals(instruments(trial, without=gnss)))
    assert logged.measured.track == "speed through the water and heading"
    assert logged.measured.figures["advance_m"].value is not None
    assert logged.measured.figures["advance_m"].low is None
    assert logged.measured.figures["steady_drift_deg"].value is None
    alone = circle_of(find_circles_and_spirals(instruments(trial, without=(*gnss, "speed_through_water"))))
    assert alone.measured.track == "heading alone"
    assert alone.measured.figures["steady_yaw_rate_deg_s"].value == pytest.approx(
        logged.measured.figures["steady_yaw_rate_deg_s"].value, rel=1e-3
    )
    for name in (*LENGTHS, "steady_diameter_m", "speed_loss_percent"):
        assert alone.measured.figures[name].value is None
        assert alone.measured.figures[name].why


def test_half_a_turn_is_a_circle_and_says_what_it_lacks() -> None:
    trial = sailed((SteadyCourse(300.0), Turn(35.0, 200.0)), "ferry")
    circle = circle_of(find_circles_and_spirals(instruments(trial)))
    assert circle.measured.figures["tactical_diameter_m"].value is not None
    assert circle.measured.figures["steady_diameter_m"].value is None
    assert circle.measured.figures["steady_diameter_m"].why == "the heading changed by less than a whole turn"
    assert any("less than 600 deg" in reason for reason in circle.quality.reasons)
    assert find_circles_and_spirals(instruments(sailed((SteadyCourse(300.0), Turn(35.0, 150.0)), "ferry"))) == []


def test_the_criteria_ask_for_the_full_rudder_a_length_and_an_approach() -> None:
    trial = sailed((SteadyCourse(300.0), Turn(35.0, 560.0)), "ferry")
    circle = circle_of(find_circles_and_spirals(instruments(trial)))
    judged = {c.name: c for c in judge_circle(circle, Particulars(140.0, 10.0))}
    truth = true_circle(trial, trial.truth.manoeuvres[1].start_s)
    assert judged["advance"].value_lengths == pytest.approx(truth["advance_m"] / 140.0, rel=0.03)
    assert [judged[name].passed for name in ("advance", "tactical diameter")] == [True, True]
    assert judge_circle(circle, Particulars(101.0, 10.0))[0].passed is (truth["advance_m"] / 101.0 <= 4.5)
    assert "length" in judge_circle(circle, Particulars(None, 10.0))[0].why
    assert "m long" in judge_circle(circle, Particulars(99.0, 10.0))[0].why
    assert "below 90 %" in judge_circle(circle, Particulars(140.0, 12.0))[0].why
    small = circle_of(find_circles_and_spirals(instruments(sailed((SteadyCourse(300.0), Turn(20.0, 560.0)), "ferry"))))
    assert "asks for 35 deg" in judge_circle(small, Particulars(140.0, 10.0))[0].why


def test_a_log_that_begins_in_the_turn_has_no_advance() -> None:
    whole = instruments(sailed((SteadyCourse(300.0), Turn(35.0, 900.0)), "ferry"))
    late_ns = START_NS + 330_000_000_000
    cut = Channels({k: s.between(late_ns, s.time_utc_ns[-1]) for k, s in whole.series.items()}, {}, ())
    circle = circle_of(find_circles_and_spirals(cut))
    assert circle.quality.start == "unknown"
    assert circle.execute_utc_ns is None
    assert circle.measured.figures["advance_m"].value is None
    assert circle.measured.figures["speed_loss_percent"].value is None
    complete = circle_of(find_circles_and_spirals(whole))
    assert circle.measured.figures["steady_yaw_rate_deg_s"].value == pytest.approx(
        complete.measured.figures["steady_yaw_rate_deg_s"].value, rel=0.01
    )


def test_zigzags_are_not_touched_and_nothing_is_found_twice() -> None:
    ship = Ship()
    ship.wait(0.0, 100.0)
    ship.zigzag(20.0, 20.0, 1, 6)
    ship.wait(0.0, 100.0)
    ship.wait(25.0, 500.0)
    ship.wait(0.0, 100.0)
    heading, rudder = measure(ship, Instruments())
    zigzags = find_zigzags(heading, rudder)
    found = find_circles_and_spirals(Channels({"heading": heading, "rudder_angle": rudder}, {}, ()), zigzags)
    assert [z.kind for z in zigzags] == ["zigzag"]
    assert [type(one) for one in found] == [MeasuredCircle, PullOut]
    spans = [(z.start_utc_ns, z.end_utc_ns) for z in [*zigzags, *found]]
    assert all(end <= start for (_, end), (start, _) in pairwise(sorted(spans)))


def test_pull_outs_of_a_stable_ship_end_alike() -> None:
    steps = [(SteadyCourse(300.0), Turn(side * 20.0, 400.0), RudderHold(0.0, 200.0)) for side in (1.0, -1.0)]
    trial = sailed((*steps[0], *steps[1]), "ferry")
    found = find_circles_and_spirals(instruments(trial))
    assert [type(one) for one in found] == [MeasuredCircle, PullOut] * 2
    first, second = (one for one in found if isinstance(one, PullOut))
    assert (first.side, second.side) == ("starboard", "port")
    assert first.verdict == second.verdict == "no instability seen"
    assert first.partner_start_utc_ns == second.start_utc_ns
    release_s = trial.truth.manoeuvres[2].start_s
    assert (first.start_utc_ns - START_NS) / 1e9 == pytest.approx(release_s, abs=1.0)
    for one in (first, second):
        residual = one.figures["residual_yaw_rate_deg_s"]
        assert residual.value == pytest.approx(0.0, abs=max(3.0 * residual.std, 0.01))
        assert abs(one.figures["initial_yaw_rate_deg_s"].value or 0.0) > 1.0


def test_pull_outs_of_an_unstable_ship_do_not() -> None:
    ship = Ship(**UNSTABLE)
    for side in (1.0, -1.0):
        ship.wait(side * 20.0, 200.0)
        ship.wait(0.0, 300.0)
    found = [one for one in tiny(ship) if isinstance(one, PullOut)]
    assert [one.verdict for one in found] == ["unstable", "unstable"]
    left = np.sqrt(0.5)  # where a r = c r^3
    values = [one.figures["residual_yaw_rate_deg_s"].value for one in found]
    assert values == pytest.approx([left, -left], abs=0.02)


def test_one_pull_out_is_not_judged_and_a_short_one_is_none() -> None:
    ship = Ship()
    ship.wait(0.0, 100.0)
    ship.wait(20.0, 150.0)
    ship.wait(0.0, 150.0)
    (one,) = tiny(ship)
    assert isinstance(one, PullOut)
    assert one.verdict == "not judged"
    hasty = Ship()
    hasty.wait(0.0, 100.0)
    hasty.wait(20.0, 150.0)
    hasty.wait(0.0, 10.0)
    hasty.wait(-10.0, 60.0)
    assert tiny(hasty) == []


def test_spiral_of_a_stable_ship_has_no_loop() -> None:
    angles = (15.0, 10.0, 5.0, 2.0, 0.0, -2.0, -5.0, -10.0, -15.0)
    trial = sailed((SteadyCourse(120.0), *direct_spiral(angles, 150.0)), "ferry")
    (spiral,) = find_circles_and_spirals(instruments(trial))
    assert isinstance(spiral, Spiral)
    assert (spiral.loop, spiral.n_ways, spiral.side) == ("none seen", 2, "starboard")
    assert [p.rudder_deg for p in spiral.points] == pytest.approx([*angles, *angles[-2::-1]], abs=0.2)
    path = trial.truth.trajectory
    for point, record in zip(spiral.points, trial.truth.manoeuvres[1:], strict=True):
        row = int(record.end_s / path.step_s) - 5
        rate = point.yaw_rate_deg_s
        assert rate.value == pytest.approx(float(np.rad2deg(path.column("r")[row])), abs=max(3.0 * rate.std, 0.01))
        assert point.steady


def test_spiral_of_an_unstable_ship_shows_her_loop() -> None:
    ship = Ship(**UNSTABLE)
    angles = (15.0, 10.0, 6.0, 4.0, 2.0, 0.0, -2.0, -4.0, -6.0, -10.0, -15.0)
    for angle in (*angles, *angles[-2::-1]):
        ship.wait(angle, 250.0)
    (spiral,) = tiny(ship)
    assert isinstance(spiral, Spiral)
    assert spiral.loop == "seen"
    fold = np.sqrt(0.5 / 3.0)
    width = 2.0 * (0.5 * fold - fold**3) / 0.06
    figure = spiral.figures["loop_width_deg"]
    assert figure.low is not None
    assert figure.high is not None
    assert figure.low <= width <= figure.high
    assert spiral.figures["loop_height_deg_s"].value == pytest.approx(2.0 * np.sqrt(0.5), rel=0.1)


def test_ways_that_hold_no_angle_in_common_cannot_show_a_loop() -> None:
    ship = Ship()
    for angle in (15.0, 9.0, 3.0, -3.0, -9.0, -15.0, -6.0, 0.0, 6.0, 12.0):
        ship.wait(angle, 180.0)
    (spiral,) = tiny(ship)
    assert isinstance(spiral, Spiral)
    assert (spiral.loop, spiral.n_ways) == ("not judged", 2)
    assert spiral.reasons == ("The two ways hold no rudder angle in common: a loop cannot be seen.",)


def test_one_way_of_a_spiral_cannot_show_a_loop() -> None:
    ship = Ship()
    for angle in (20.0, 10.0, 5.0, 0.0, -5.0, -10.0, -20.0):
        ship.wait(angle, 180.0)
    (spiral,) = tiny(ship)
    assert isinstance(spiral, Spiral)
    assert spiral.loop == "not judged"
    assert spiral.figures["loop_width_deg"].why == "the rudder went one way only"


def test_course_changes_are_nothing() -> None:
    ship = Ship()
    for course in (0.0, 90.0, -70.0, 100.0, 0.0, 160.0):
        ship.autopilot(course, 300.0)
    for sign in (1, -1, 1):
        goal = ship.heading + sign * 150.0
        ship.steer(sign * 15.0, lambda sign=sign, goal=goal: sign * (goal - ship.heading) <= 10.0)  # type: ignore[misc]
        ship.steer(-sign * 15.0, lambda sign=sign: sign * ship.yaw_rate <= 0.0)  # type: ignore[misc]
        ship.wait(0.0, 120.0)
    assert tiny(ship) == []


def test_a_rudder_of_the_wrong_sign_turns_no_circle() -> None:
    ship = Ship(gain_per_s=-0.06)
    ship.wait(0.0, 100.0)
    ship.wait(25.0, 600.0)
    assert tiny(ship) == []


def test_coarse_and_slow_instruments() -> None:
    ship = Ship()
    ship.wait(0.0, 200.0)
    ship.wait(20.0, 600.0)
    coarse = Instruments(heading_s=1.0, rudder_s=2.0, heading_noise_deg=0.3, rudder_noise_deg=0.4, rudder_step_deg=1.0)
    circle = circle_of(tiny(ship, coarse))
    assert circle.delta0_deg == 20.0
    assert circle.execute_utc_ns is not None
    assert (circle.execute_utc_ns - 1_750_000_000_000_000_000) / 1e9 == pytest.approx(200.0, abs=2.0)


def test_a_rudder_that_creeps_is_never_held() -> None:
    """Slowly over from side to side: she turns through whole circles, and nobody ordered an angle."""
    ship = Ship()
    ship.wait(0.0, 60.0)
    begin = ship.now
    while ship.now < 4000.0:
        ship.wait(20.0 * float(np.sin(2 * np.pi * (ship.now - begin) / 1500.0)), 0.5)
    assert tiny(ship) == []


def test_speeds_of_nought_and_a_compass_that_fails_stop_nothing() -> None:
    ship = Ship()
    ship.wait(0.0, 100.0)
    ship.wait(25.0, 600.0)
    heading, rudder = measure(ship, Instruments())
    still = Series(heading.time_utc_ns, np.zeros(len(heading)))
    channels = {"heading": heading, "rudder_angle": rudder, "speed_over_ground": still, "course_over_ground": still}
    for one in find_circles_and_spirals(Channels(channels, {}, ())):
        assert isinstance(one, MeasuredCircle)
        assert one.measured.figures["speed_loss_percent"].value is None
    early = heading.between(START_NS, START_NS + 150_000_000_000)
    assert find_circles_and_spirals(Channels({"heading": early, "rudder_angle": rudder}, {}, ())) == []
