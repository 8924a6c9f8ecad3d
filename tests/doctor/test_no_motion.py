"""Nothing is held against the channels of a ship that does not move, drifts, turns to one side only or gathers way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.channels.doctor.examine import ChannelFinding, Examination, examine
from kempf.pipeline.channels.doctor.log import EARTH_M, Log
from kempf.pipeline.channels.doctor.outcome import STILL, CheckFigure, Outcome
from kempf.pipeline.channels.doctor.verdict import as_json
from kempf.pipeline.channels.series import Float, Series
from kempf.schemas.units import SECOND_NS
from tests.doctor import closed_form_ship

STEP_S = 0.5


def remembering(random: np.random.Generator, count: int, tau_s: float, std: float) -> Float:
    """Noise that forgets exponentially."""
    keep = np.exp(-STEP_S / tau_s)
    value = np.empty(count)
    value[0] = std * random.standard_normal()
    for k, new in enumerate(random.standard_normal(count - 1), start=1):
        value[k] = keep * value[k - 1] + std * np.sqrt(1.0 - keep**2) * new
    return value


def series(value: Float) -> Series:
    time = closed_form_ship.START_NS + np.arange(value.size) * round(STEP_S * SECOND_NS)
    return Series(time, np.ascontiguousarray(value))


def afloat(seed: int, drift_m_s: float) -> Log:
    """A boat that swings as the wind has it, moored or drifting, with a GNSS behind its filter."""
    random = np.random.Generator(np.random.PCG64(seed))
    count = 3000
    wander = remembering(random, count, 120.0, 0.2 * drift_m_s) + 1j * remembering(
        random, count, 120.0, 0.2 * drift_m_s
    )
    way = drift_m_s * np.exp(1j * random.uniform(0.0, 6.28)) + wander
    yaw = np.convolve(
        remembering(random, count, 100.0, float(np.deg2rad(random.choice([1.0, 10.0, 40.0])))), np.ones(20) / 20, "same"
    )
    seen = way + remembering(random, count, 5.0, 0.05) + 1j * remembering(random, count, 5.0, 0.05)
    place = (
        np.cumsum(way) * STEP_S + remembering(random, count, 100.0, 1.5) + 1j * remembering(random, count, 100.0, 1.5)
    )
    helm = np.deg2rad(15.0) * np.sign(np.sin(2.0 * np.pi * np.arange(count) * STEP_S / random.uniform(60.0, 300.0)))
    bias, noise = np.deg2rad(0.2), np.deg2rad(0.1)
    return Log(
        {
            "heading": series(1.0 + yaw + np.deg2rad(0.3) * random.standard_normal(count)),
            "yaw_rate": series(np.gradient(yaw, STEP_S) + bias + noise * random.standard_normal(count)),
            "rudder_angle": series(helm),
            "speed_over_ground": series(np.abs(seen)),
            "course_over_ground": series(np.unwrap(np.angle(seen))),
            "latitude": series(0.9 + place.real / EARTH_M),
            "longitude": series(0.3 + place.imag / EARTH_M / np.cos(0.9)),
        },
        12.0,
    )


@pytest.mark.parametrize("seed", range(6))
def test_a_moored_ship_is_not_testable(seed: int) -> None:
    found = examine(afloat(seed, 0.0))
    assert found.verdict == "untested"
    assert found.still
    assert {o.words for o in found.outcomes if not o.alone} == {STILL}


@pytest.mark.parametrize("seed", range(6))
def test_a_drifting_ship_accuses_nobody(seed: int) -> None:
    found = examine(afloat(seed, 0.3 + 0.15 * seed))
    assert found.findings == ()
    assert not found.still


def turning(rudder_deg: Float, seed: int, start_m_s: float = 6.0) -> Log:
    """A ship by Nomoto's equation with a damping that grows with the rate, which the doctor's equation lacks."""
    random = np.random.Generator(np.random.PCG64(seed))
    speed = np.empty(rudder_deg.size)
    rate, own = np.zeros(rudder_deg.size), start_m_s
    for k in range(rudder_deg.size):
        speed[k] = own
        own += STEP_S * (6.0 - own - 60.0 * rate[k] ** 2 * 20.0) / 60.0
        if k + 1 < rudder_deg.size:
            share = speed[k] / 6.0
            pull = 0.06 * share**2 * np.deg2rad(rudder_deg[k]) - share * rate[k] - 40.0 * abs(rate[k]) * rate[k]
            rate[k + 1] = rate[k] + STEP_S * pull / 20.0
    psi = np.cumsum(rate) * STEP_S
    velocity = speed * np.exp(1j * (psi - 6.0 * rate))
    noise = {name: random.standard_normal(rate.size) for name in "hrsc"}
    return Log(
        {
            "heading": series(psi + 2e-3 * noise["h"]),
            "yaw_rate": series(rate + 5e-4 * noise["r"]),
            "rudder_angle": series(np.deg2rad(rudder_deg)),
            "speed_over_ground": series(np.abs(velocity) + 0.05 * noise["s"]),
            "course_over_ground": series(np.unwrap(np.angle(velocity)) + 8e-3 * noise["c"]),
        },
        90.0,
    )


def put_over(side: float, sign: float = 1.0) -> Float:
    """Rudder of a turning circle behind a straight run on which she is steered, deg."""
    count = 1600
    random = np.random.Generator(np.random.PCG64(9))
    helm = 1.5 * remembering(random, count, 8.0, 1.0)
    helm[300:] = side * 30.0
    return sign * helm


def zigzag(count: int = 1600) -> Float:
    return 15.0 * np.sign(np.sin(2.0 * np.pi * np.arange(count) * STEP_S / 160.0))


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("start", [0.0, 6.0])
def test_a_circle_to_one_side_does_not_test_the_rudder(side: float, start: float) -> None:
    found = examine(turning(put_over(side), 3, start))
    assert found.findings == ()
    states = {o.check: (o.state, o.words) for o in found.outcomes if o.check.startswith("rudder_angle_")}
    assert states
    assert {state for state, _ in states.values()} == {"untestable"}
    assert any("one side only" in words for _, words in states.values())
    # in a steady turn heading and yaw rate are compared by the turn itself
    assert next(o for o in found.outcomes if o.check == "heading_rate").state == "agree"


@pytest.mark.parametrize("start", [0.0, 6.0])
def test_a_zigzag_shows_the_sign_of_the_rudder(start: float) -> None:
    log = turning(zigzag(), 4, start)
    assert examine(log).findings == ()
    rudder = log.series["rudder_angle"]
    (finding,) = examine(log.with_series({"rudder_angle": Series(rudder.time_utc_ns, -rudder.value)})).findings
    assert [(f.kind, f.channels) for f in finding.faults] == [("sign", ("rudder_angle",))]


def test_gathering_way_is_left_out() -> None:
    log = turning(zigzag(), 5, 0.0)
    rudder = log.series["rudder_angle"]
    # at rest the rudder is tried the other way round: the propeller turns her, or a tug
    wrong = rudder.value.copy()
    wrong[:40] *= -1.0
    assert examine(log.with_series({"rudder_angle": Series(rudder.time_utc_ns, wrong)})).findings == ()


def test_what_one_stretch_says_is_not_held_against_the_rudder() -> None:
    log = turning(zigzag(2400), 6)
    rudder = log.series["rudder_angle"]
    wrong = rudder.value.copy()
    wrong[:1700] *= -1.0
    found = examine(log.with_series({"rudder_angle": Series(rudder.time_utc_ns, wrong)}))
    assert not any(f.channels == ("rudder_angle",) for x in found.findings for f in x.faults)


def test_every_correction_that_is_named_takes_its_contradiction_away() -> None:
    log = closed_form_ship.log()
    rate, speed = log.series["yaw_rate"], log.series["speed_over_ground"]
    spoilt = log.with_series(
        {
            "yaw_rate": Series(rate.time_utc_ns, -rate.value),
            "speed_over_ground": Series(speed.time_utc_ns, speed.value * 3600.0 / 1852.0),
        }
    )
    spoilt = replace(spoilt, units={"speed_over_ground": "m/s"})
    found = examine(spoilt)
    assert len(found.findings) == 2
    corrected = spoilt
    for finding in found.findings:
        for fault in finding.faults:
            after = {o.check: o.state for o in examine(fault.corrected(corrected)).outcomes}
            assert all(after[one.check] == "agree" for one in finding.evidence)
        corrected = finding.faults[0].corrected(corrected)
    assert examine(corrected).verdict == "clean"


def test_what_no_single_correction_takes_away_is_said_with_its_figures() -> None:
    figure = CheckFigure("ratio", 3.0, 0.1, 0.8, 1.25)
    outcome = Outcome("heading_rate", ("heading", "yaw_rate"), "disagree", "three times too much", (figure,))
    content = as_json(Examination((ChannelFinding((), (outcome,)),), (outcome,), ()), {}, "delimited")
    (finding,) = content["findings"]
    assert "no single correction takes the contradiction away" in finding["words"]
    assert finding["evidence"][0]["figures"][0]["value"] == 3.0


def test_the_scale_of_the_rudder_is_said_not_to_be_seen() -> None:
    found = as_json(examine(closed_form_ship.log()), {}, "delimited")
    assert any("scale of rudder_angle" in words for words in found["cannot_see"])
    assert as_json(examine(closed_form_ship.log("heading", "yaw_rate")), {}, "delimited")["cannot_see"] == []
    assert found["moves"] is True
