"""The MMG standard method of a peer: that it is what was published."""

from math import radians

import numpy as np
import pytest

from benchmarks.baselines.mmg_standard import Peer
from benchmarks.identify import peers


@pytest.fixture(scope="module")
def peer() -> Peer:
    return Peer.of(peers.data())


def test_the_circle_is_the_published_one() -> None:
    published = next(one for one in peers.data()["circles"] if one["kind"] == "predicted")
    peer = Peer.of({**peers.data(), "rudder_rate_deg_s": published["rudder_rate_deg_s"]})
    made = peer.circle(radians(35.0))
    assert made.advance_m / peer.length_m == pytest.approx(published["advance"], rel=0.02)
    assert made.tactical_diameter_m / peer.length_m == pytest.approx(published["tactical_diameter"], rel=0.04)


def test_the_propeller_drives_her_at_the_revolutions_of_the_model_tests(peer: Peer) -> None:
    # HSVA's model kept 10.2 1/s with a propeller 6 % smaller
    assert 10.0 < peer.revolutions_per_s < 11.0


def test_overshoots_are_larger_with_less_rudder_for_the_heading(peer: Peer) -> None:
    few, many = (peer.overshoots_deg(radians(10.0), radians(angle), 1) for angle in (10.0, 20.0))
    assert len(few) == 2
    assert many[0] > few[0] > 3.0
    assert few[1] > few[0]


def test_a_zigzag_goes_over_at_its_heading(peer: Peer) -> None:
    rows = peer.zigzag(radians(10.0), radians(20.0), -1, 60.0)
    time, heading, rudder = rows[:, 0], rows[:, 4], rows[:, 7]
    assert (time[0], time[-1]) == (0.0, pytest.approx(60.0, abs=0.06))
    assert np.all(rudder[time < 1.0] == 0.0) and np.min(rudder) == pytest.approx(-radians(20.0))
    # the rudder leaves port where the heading has come to 10 deg there, and starboard where it has on that side
    leaves = int(np.flatnonzero(np.diff(rudder) > 0.0)[0])
    assert heading[leaves] == pytest.approx(-radians(10.0), abs=radians(0.1))
    back = leaves + int(np.flatnonzero(np.diff(rudder[leaves:]) < 0.0)[0])
    assert rudder[back] == pytest.approx(radians(20.0))
    assert heading[back] == pytest.approx(radians(10.0), abs=radians(0.1))
    overshoot = np.rad2deg(-np.min(heading)) - 10.0
    assert overshoot == pytest.approx(peer.overshoots_deg(radians(10.0), radians(20.0), -1)[0], abs=0.05)


def test_cubic_coefficients_of_captive_tests_are_nearly_those_of_strips() -> None:
    # what the comment in cross_flow_cubic.yaml says: v^3 and v r^2 / 4 in sway, v^2 r / 4 and r^3 / 80 in yaw
    sway, yaw = peers.data()["mmg"]["sway"], peers.data()["mmg"]["yaw"]
    assert sway["vrr"] / sway["vvv"] == pytest.approx(1.0 / 4.0, rel=0.03)
    assert yaw["rrr"] / yaw["vvr"] == pytest.approx((1.0 / 80.0) / (1.0 / 4.0), rel=0.12)


def test_every_figure_of_a_peer_has_a_source_and_says_how_it_was_read() -> None:
    for one in peers.data()["circles"]:
        assert one["source"]
        assert "second-hand" in one["read"]
        assert one["side"] in {"starboard", "port"}
