"""The figures of a turning circle on tracks whose figures follow from a formula."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.segment.circles.turning_figures import TurningFigures, turning_figures


def spiral_in(side: float, turn_deg: float, *, course_deg: float = 30.0, step_s: float = 0.5) -> TurningFigures:
    """A ship whose yaw rate builds up with a time constant while her speed falls; drift follows the rate."""
    rate, lag, speed, loss, drift = np.deg2rad(1.0), 20.0, 7.0, 0.4, np.deg2rad(9.0)
    t = np.arange(-100.0, np.deg2rad(turn_deg) / rate + lag + step_s, step_s)
    fine = np.arange(-100.0, t[-1] + 0.01, 0.01)

    def states(time):  # type: ignore[no-untyped-def]
        since = np.maximum(time, 0.0)
        build = 1.0 - np.exp(-since / lag)
        heading = np.deg2rad(course_deg) + side * rate * (since - lag * build)
        return heading, speed * (1.0 - loss * build), side * drift * build

    heading, along, beta = states(fine)
    north = np.concatenate([[0.0], np.cumsum(along[:-1] * np.cos(heading[:-1] - beta[:-1]) * 0.01)])
    east = np.concatenate([[0.0], np.cumsum(along[:-1] * np.sin(heading[:-1] - beta[:-1]) * 0.01)])
    heading_t, along_t, beta_t = states(t)
    return turning_figures(t, np.interp(t, fine, north), np.interp(t, fine, east), heading_t, along_t, beta_t, 0.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_steady_figures_of_two_turns(side: float) -> None:
    found = spiral_in(side, 720.0)
    assert found.steady_yaw_rate_deg_s == pytest.approx(side * 1.0, rel=1e-4)
    assert found.steady_drift_deg == pytest.approx(9.0, rel=1e-4)
    assert found.speed_loss_percent == pytest.approx(40.0, abs=0.01)
    assert found.steady_diameter_m == pytest.approx(2 * 7.0 * 0.6 / np.deg2rad(1.0), rel=1e-3)
    assert found.heading_change_deg == pytest.approx(side * 720.0, abs=1.0)


def test_both_sides_mirror_and_the_course_does_not_matter() -> None:
    starboard, port = spiral_in(1.0, 560.0), spiral_in(-1.0, 560.0, course_deg=-200.0)
    for name in ("advance_m", "transfer_m", "tactical_diameter_m", "time_to_90_s", "time_to_180_s"):
        assert getattr(starboard, name) == pytest.approx(getattr(port, name), rel=1e-6)
        assert getattr(starboard, name) > 0


def test_figures_do_not_depend_on_the_sampling() -> None:
    coarse, fine = spiral_in(1.0, 560.0, step_s=1.0), spiral_in(1.0, 560.0, step_s=0.1)
    assert coarse.advance_m == pytest.approx(fine.advance_m, rel=2e-3)
    assert coarse.tactical_diameter_m == pytest.approx(fine.tactical_diameter_m, rel=2e-3)


def test_what_the_record_does_not_reach_is_not_invented() -> None:
    found = spiral_in(1.0, 120.0)
    assert np.isfinite(found.advance_m)
    assert np.isfinite(found.transfer_m)
    for name in ("tactical_diameter_m", "steady_diameter_m", "steady_yaw_rate_deg_s", "speed_loss_percent"):
        assert np.isnan(getattr(found, name)), name
    assert np.isnan(spiral_in(1.0, 300.0).steady_yaw_rate_deg_s)
    assert np.isfinite(spiral_in(1.0, 380.0).steady_yaw_rate_deg_s)


def test_a_track_that_is_none_is_refused() -> None:
    t = np.arange(3.0)
    with pytest.raises(ValueError, match="outside the track"):
        turning_figures(t, t, t, t, t, t, 5.0)
    with pytest.raises(ValueError, match="two instants"):
        turning_figures(t, t, t, t, t[:2], t, 0.0)
