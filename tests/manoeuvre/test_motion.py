"""Manoeuvres against the simulator, which shares no code with them, and against what must hold of any ship."""

from dataclasses import replace
from math import degrees, nan, pi, radians

import numpy as np
import pytest

from kempf.pipeline.manoeuvre import motion
from kempf.pipeline.manoeuvre.pull_out import PredictedPullOut
from kempf.pipeline.manoeuvre.spiral import PredictedSpiral
from kempf.pipeline.manoeuvre.turning_circle import PredictedCircle
from kempf.pipeline.manoeuvre.zigzag import PredictedZigzag
from kempf.pipeline.segment.circles.turning_figures import turning_figures
from kempf.pipeline.simulate import manoeuvre as sailed
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.trial import TrialSettings, simulate_trial
from tests.manoeuvre.ships import ship_of, unstable


@pytest.mark.parametrize("name", ["mariner", "container", "usv"])
@pytest.mark.parametrize("turns", [1.5, 12.0])
def test_a_turning_circle_is_that_of_the_simulator(name: str, turns: float) -> None:
    hull = HULLS[name]
    circle = sailed.TurningCircle(25.0, 360.0 * turns)
    trial = simulate_trial(TrialSettings(hull, (sailed.SteadyCourse(10.0), circle)))
    record, path = trial.truth.manoeuvres[1], trial.truth.trajectory
    rows = slice(round(record.start_s / path.step_s), round(record.end_s / path.step_s) + 1)
    v, _, psi, north, east, forward = path.state[rows].T
    time = path.time_s[rows] - record.start_s
    truth = turning_figures(time, north, east, psi, np.hypot(forward, v), np.arctan2(-v, forward), 0.0)
    # by itself one is sailed until the turn is steady
    made = PredictedCircle(radians(25.0), turn_rad=3.0 * pi if turns == 1.5 else None).sailed(ship_of(hull))
    assert made is not None
    for figure in ("advance_m", "transfer_m", "tactical_diameter_m", "steady_yaw_rate_deg_s", "time_to_180_s"):
        assert made.figures[figure] == pytest.approx(getattr(truth, figure), rel=2e-3), figure
    assert made.figures["speed_loss_percent"] == pytest.approx(truth.speed_loss_percent, abs=0.1)


@pytest.mark.parametrize(("heading", "rudder"), [(20.0, 20.0), (10.0, 10.0), (5.0, 15.0)])
def test_zigzags_are_those_of_the_simulator(heading: float, rudder: float) -> None:
    hull = HULLS["ferry"]
    programme = (sailed.SteadyCourse(10.0), sailed.ZigzagTest(heading, rudder, "port", legs=4))
    truth = simulate_trial(TrialSettings(hull, programme)).truth.zigzags[0]
    made = PredictedZigzag(radians(heading), radians(rudder), side=-1).sailed(ship_of(hull))
    assert made is not None
    found = [made.figures[f"overshoots_deg.{k}"] for k in range(len(truth.overshoots_rad))]
    np.testing.assert_allclose(found, np.degrees(truth.overshoots_rad), rtol=2e-3)
    assert made.figures["time_to_second_execute_s"] == pytest.approx(
        truth.executes_s[1] - truth.executes_s[0], abs=1e-3
    )


def test_the_rudder_is_ordered_over_exactly_at_the_heading() -> None:
    ship = ship_of(HULLS["mariner"])
    track = ship.sail(np.array([[0.3, 1.0, 0.2, 1e4], [-0.3, -1.0, -0.2, 1e4]]))
    assert track.how == motion.SAILED
    at = track.rows[track.ends, motion.HEADING]
    np.testing.assert_allclose(at, [0.2, -0.2], atol=1e-12)


def test_finer_steps_and_the_other_side_change_nothing() -> None:
    ship = unstable()
    phases = np.array([[0.5, 1.0, 3.0 * pi, 1e5]])
    coarse, fine = (ship.sail(phases, steps_a_length=n).rows[-1] for n in (50.0, 200.0))
    np.testing.assert_allclose(coarse, fine, rtol=1e-5)
    port = ship.sail(phases * [-1.0, -1.0, -1.0, 1.0]).rows[-1]
    mirrored = np.array([1.0, 1.0, -1.0, -1.0, 1.0, -1.0, -1.0, -1.0, 1.0])
    np.testing.assert_allclose(port, ship.sail(phases).rows[-1] * mirrored, rtol=1e-12)


def test_a_hull_that_turns_by_herself_without_damping_is_no_ship() -> None:
    ship = unstable(drag=0.0)
    assert ship.unstable
    assert not ship_of(HULLS["tanker"]).unstable
    assert PredictedCircle(radians(35.0)).sailed(ship) is None
    assert PredictedPullOut(radians(20.0)).sailed(ship) is None
    assert PredictedSpiral(radians(20.0)).sailed(ship) is None


def test_what_a_pull_out_leaves_is_where_the_spirals_loop_crosses() -> None:
    ship = unstable()
    spiral, out = PredictedSpiral(radians(20.0)), PredictedPullOut(radians(20.0))
    curve, left = spiral.sailed(ship), out.sailed(ship)
    assert curve is not None
    assert left is not None
    middle = list(spiral.orders_rad).index(0.0)
    rate = curve.figures[f"from_starboard_deg_s.{middle}"]
    assert rate > 0.01
    assert left.figures["residual_yaw_rate_deg_s"] == pytest.approx(rate, rel=0.02)
    assert curve.figures["loop_height_deg_s"] == pytest.approx(2.0 * rate, rel=1e-9)
    assert curve.figures["loop_width_deg"] > 0.1
    assert curve.figures[f"from_port_deg_s.{middle}"] == pytest.approx(-rate)


def test_a_stable_ship_has_no_loop_and_comes_out_of_her_turn() -> None:
    ship = ship_of(HULLS["ferry"])
    curve, out = PredictedSpiral(radians(20.0)).sailed(ship), PredictedPullOut(radians(20.0)).sailed(ship)
    assert curve is not None
    assert out is not None
    assert curve.figures["loop_width_deg"] == curve.figures["loop_height_deg_s"] == 0.0
    assert abs(out.figures["residual_share_percent"]) < 0.1


def test_a_steady_turn_is_what_the_circle_comes_to() -> None:
    ship = ship_of(HULLS["container"])
    track = ship.sail(np.array([[radians(15.0), 0.0, 0.0, 200.0 * ship.waters.own_time_s]]))
    balance = ship.rate_by(radians(15.0))
    assert balance is not None
    last = track.rows[-1]
    assert last[motion.RATE] == pytest.approx(balance.yaw_rate_rad_s, rel=1e-6)
    assert last[motion.LATERAL] == pytest.approx(balance.lateral_m_s, rel=1e-6)
    assert last[motion.FORWARD] == pytest.approx(balance.forward_m_s, rel=1e-6)
    back = ship.rudder_for(balance.yaw_rate_rad_s)
    assert back is not None
    assert degrees(back.rudder_rad) == pytest.approx(15.0, abs=1e-6)


@pytest.mark.parametrize(
    ("effect", "size"), [("rudder_lag", 3.0), ("dead_time", 2.5), ("backlash", 0.05), ("rate_limit", 20.0)]
)
def test_the_felt_rudder_is_that_of_the_effect_on_the_whole_course(effect: str, size: float) -> None:
    from kempf.pipeline.model.effects import RUDDER_COURSES

    plain = ship_of(HULLS["mariner"])
    ship = ship_of(HULLS["mariner"], **{effect: (size,)})
    track = ship.sail(np.array([[0.35, 1.0, 0.2, 1e4], [-0.35, -1.0, -0.1, 1e4], [0.1, 0.0, 0.0, 40.0]]))
    time = np.linspace(0.0, track.rows[-1, motion.TIME], 40_001)
    reading = np.interp(time, track.rows[:, motion.TIME], track.rows[:, motion.RUDDER])
    felt = RUDDER_COURSES[effect](time, reading, np.array([size]))  # type: ignore[index]
    # eq. (16) at the speed of the track, under the rudder of the whole course
    V = np.interp(time, track.rows[:, motion.TIME], track.rows[:, motion.FORWARD])
    a11, a12, a21, a22, b1, b2 = plain.hull
    v = r = heading = 0.0
    for k in range(time.size - 1):
        h, U, delta = time[k + 1] - time[k], 0.5 * (V[k] + V[k + 1]), 0.5 * (felt[k] + felt[k + 1])
        dv, dr = a11 * U * v + a12 * U * r + b1 * U**2 * delta, a21 * U * v + a22 * U * r + b2 * U**2 * delta
        heading += h * (r + 0.5 * h * dr)
        v, r = v + h * dv, r + h * dr
    assert track.rows[-1, motion.HEADING] == pytest.approx(heading, abs=2e-3)
    assert track.rows[-1, motion.RATE] == pytest.approx(r, rel=3e-3, abs=1e-5)


def test_a_neutral_angle_is_held_on_the_approach() -> None:
    ship = ship_of(HULLS["mariner"], neutral_angle=(0.03,))
    track = ship.sail(np.array([[nan, 0.0, 0.0, 300.0]]))
    assert track.rows[0, motion.RUDDER] == pytest.approx(-0.03)
    assert np.max(np.abs(track.rows[:, motion.HEADING])) < 1e-9


def test_a_late_helmsman_makes_the_overshoot_larger() -> None:
    ship = ship_of(HULLS["mariner"])
    zigzag = PredictedZigzag(radians(10.0), radians(10.0))
    late = replace(zigzag, switched_rad=(radians(12.0),))
    prompt, delayed = zigzag.sailed(ship), late.sailed(ship)
    assert prompt is not None
    assert delayed is not None
    assert delayed.figures["overshoots_deg.0"] > prompt.figures["overshoots_deg.0"] + 2.0


def test_a_head_wind_costs_speed_and_a_following_one_gives_it_back() -> None:
    ship = ship_of(HULLS["mariner"])
    by_wind, wind = 0.02, 10.0
    surge = ship.surge.copy()
    surge[4] = by_wind
    own = ship.waters.approach_m_s

    def speed(true_wind_m_s: float, whence: float) -> float:
        waters = replace(ship.waters, true_wind_m_s=true_wind_m_s, true_wind_from_rad=whence)
        track = replace(ship, waters=waters, surge=surge).sail(np.array([[nan, 0.0, 0.0, 3000.0]]))
        return float(track.column(motion.FORWARD)[-1])

    against, along = speed(wind, 0.0), speed(wind, pi)
    assert speed(0.0, 0.0) == pytest.approx(own)
    assert against == pytest.approx(own * (1.0 - by_wind * ((wind + against) ** 2 - against**2) / own**2), rel=1e-6)
    assert along == pytest.approx(own * (1.0 + by_wind * ((wind - along) ** 2 + along**2) / own**2), rel=1e-6)


def test_a_wind_that_changes_acts_when_it_blows() -> None:
    ship = ship_of(HULLS["mariner"])
    surge = ship.surge.copy()
    surge[4] = 0.05

    def speeds(**wind: object) -> np.ndarray:
        one = replace(ship, waters=replace(ship.waters, **wind), surge=surge)  # type: ignore[arg-type]
        track = one.sail(np.array([[nan, 0.0, 0.0, 600.0]]))
        return np.interp([290.0, 590.0], track.column(motion.TIME), track.column(motion.FORWARD))

    steady = speeds(true_wind_m_s=10.0, true_wind_from_rad=0.0)
    calm_first = np.array([[0.0, 0.0, 0.0], [300.0, 0.0, 0.0], [301.0, 10.0, 0.0]])
    early, late = speeds(air=calm_first)
    assert early == pytest.approx(ship.waters.approach_m_s, rel=1e-6)
    assert late == pytest.approx(steady[0], rel=2e-3)
    same = np.array([[0.0, 10.0, 0.0], [600.0, 10.0, 0.0]])
    np.testing.assert_allclose(speeds(air=same), steady, rtol=1e-3)


def test_a_slow_gear_makes_the_advance_longer_by_the_way_that_it_takes() -> None:
    ship = ship_of(HULLS["mariner"])
    fast, slow = (
        PredictedCircle(radians(35.0)).sailed(replace(ship, rudder_rate_rad_s=radians(rate))) for rate in (10.0, 2.5)
    )
    assert fast is not None
    assert slow is not None
    # half the time that the rudder is late, at the speed of the approach
    longer = 0.5 * (35.0 / 2.5 - 35.0 / 10.0) * ship.waters.approach_m_s
    assert slow.figures["advance_m"] - fast.figures["advance_m"] == pytest.approx(longer, rel=0.15)


def test_circle_pull_out_and_spiral_come_to_the_same_steady_turn() -> None:
    ship = ship_of(HULLS["ferry"])
    circle, out, spiral = (
        one.sailed(ship) for one in (PredictedCircle(0.35), PredictedPullOut(0.35), PredictedSpiral(0.35))
    )
    assert circle is not None
    assert out is not None
    assert spiral is not None
    rate = circle.figures["steady_yaw_rate_deg_s"]
    assert out.figures["steady_yaw_rate_deg_s"] == pytest.approx(rate, rel=1e-3)
    assert spiral.figures["from_starboard_deg_s.0"] == pytest.approx(rate, rel=1e-3)


def test_a_spiral_goes_on_where_more_rudder_turns_her_no_faster() -> None:
    ship = unstable()
    # a turn costs her so much speed that the yaw rate falls again before hard over
    slow = replace(ship, surge=np.array([6.0, 0.0, 0.3, 6.0, 0.0]))
    made = PredictedSpiral(radians(35.0)).sailed(slow)
    assert made is not None
    rates = [made.figures[f"from_starboard_deg_s.{k}"] for k in range(4)]
    assert rates[0] < max(rates[1:])
    hard = PredictedCircle(radians(35.0)).sailed(slow)
    assert hard is not None
    assert rates[0] == pytest.approx(hard.figures["steady_yaw_rate_deg_s"], rel=5e-3)
