"""Every kind of fault is named, alone where a third channel confirms it, as one of two where none does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.channels.doctor.corrections import setting
from kempf.pipeline.channels.doctor.examine import CHECKS, ask, examine, examine_window
from kempf.pipeline.channels.doctor.faults import AXES, BOW_AND_COURSE, UNITS, Fault
from kempf.pipeline.channels.doctor.log import EARTH_M, Log
from kempf.pipeline.channels.series import Series
from kempf.schemas.units import SECOND_NS
from tests.doctor import closed_form_ship

SWAP = Fault("swap", ("latitude", "longitude"))
GNSS = ("speed_over_ground", "course_over_ground")


def late(log: Log, name: str, by_s: float, rate: float = 0.0) -> Log:
    one = log.series[name]
    since = (one.time_utc_ns - one.time_utc_ns[0]) * (1.0 + rate) + by_s * SECOND_NS
    return log.with_series({name: Series(one.time_utc_ns[0] + np.rint(since).astype(np.int64), one.value)})


def changed(log: Log, name: str, factor: float = 1.0, add: float = 0.0) -> Log:
    one = log.series[name]
    return log.with_series({name: Series(one.time_utc_ns, one.value * factor + add)})


def test_a_sound_log_is_clean_and_every_channel_tested() -> None:
    found = examine(closed_form_ship.log())
    assert (found.verdict, found.findings, found.untested) == ("clean", (), ())
    assert {o.check for o in found.outcomes if o.state != "agree"} <= {
        "heading_track",
        "heading_track_clock",
        "legs_track",
    }
    assert len(CHECKS) == 10


FAULTS = {
    "rate sign": (lambda log: changed(log, "yaw_rate", -1.0), Fault("sign", ("yaw_rate",))),
    "rate unit": (
        lambda log: changed(log, "yaw_rate", 1 / 60),
        Fault("unit", ("yaw_rate",), 60.0, "deg/s taken for deg/min"),
    ),
    "rate scale": (
        lambda log: changed(log, "yaw_rate", 0.4),
        Fault("scale", ("yaw_rate",), 2.5, "scale"),
    ),
    "heading sign": (lambda log: changed(log, "heading", -1.0, 2 * np.pi), Fault("sign", ("heading",))),
    "heading from east": (
        lambda log: changed(log, "heading", -1.0, np.pi / 2),
        Fault("offset", ("heading",), np.pi / 2, "counted anticlockwise from east"),
    ),
    "compass turned": (lambda log: changed(log, "heading", 1.0, -1.2), Fault("offset", ("heading",), 1.2, "turned")),
    "course turned": (
        lambda log: changed(log, "course_over_ground", 1.0, 0.8),
        Fault("offset", ("course_over_ground",), -0.8, "turned"),
    ),
    "rudder to port": (lambda log: changed(log, "rudder_angle", -1.0), Fault("sign", ("rudder_angle",))),
    "order's zero": (
        lambda log: changed(log, "rudder_order", 1.0, 0.7),
        Fault("offset", ("rudder_order",), -0.7, "zero elsewhere"),
    ),
    "knots": (
        lambda log: changed(log, "speed_over_ground", 3600 / 1852),
        Fault("unit", ("speed_over_ground",), 1852 / 3600, "kn taken for m/s"),
    ),
    "log in km/h": (
        lambda log: changed(log, "speed_through_water", 3.6),
        Fault("unit", ("speed_through_water",), 1 / 3.6, "km/h taken for m/s"),
    ),
    "west positive": (lambda log: changed(log, "longitude", -1.0), Fault("sign", ("longitude",))),
    "swapped": (SWAP.corrected, SWAP),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_the_odd_one_out_is_named_alone_with_its_size(name: str) -> None:
    spoil, expected = FAULTS[name]
    # what a column was taken for is in the profile; a radian of rate cannot have been taken for two things
    units = {"yaw_rate": "deg/min", "speed_over_ground": "m/s", "speed_through_water": "m/s"}
    found = examine(replace(spoil(closed_form_ship.log()), units=units))
    assert [f.key for f in found.findings[0].faults] == [expected.key]
    assert len(found.findings) == 1
    fault = found.findings[0].faults[0]
    assert fault.value == pytest.approx(expected.value, abs=max(4.0 * fault.std, 0.05 * abs(expected.value)))
    assert found.findings[0].evidence


@pytest.mark.parametrize("fault", AXES, ids=["inertial unit", "with its velocity"])
def test_axes_down_taken_for_axes_up_are_no_wrong_rudder(fault: Fault) -> None:
    log = closed_form_ship.log()
    velocity = log.velocity("course")
    assert velocity is not None
    north, east = (Series(velocity.time_utc_ns, v) for v in (velocity.value.real, velocity.value.imag))
    log = log.with_series({**dict.fromkeys(GNSS), "velocity_north": north, "velocity_east": east})
    assert examine(log).verdict == "clean"
    mirrored = fault.corrected(log)
    (finding,) = examine(mirrored).findings
    assert [f.key for f in finding.faults] == [fault.key]
    # what is in the other axes twice is in the right ones
    assert fault.corrected(mirrored).series["heading"].value == pytest.approx(log.series["heading"].value)
    assert examine(fault.corrected(mirrored)).verdict == "clean"


def test_a_body_fixed_velocity_that_counts_to_port_contradicts_the_fixes() -> None:
    log, psi = closed_form_ship.log(), closed_form_ship.truth()["heading"]
    velocity = log.velocity("course")
    assert velocity is not None
    value = velocity.value * np.exp(-1j * psi)
    ahead, across = (Series(velocity.time_utc_ns, v) for v in (value.real, value.imag))
    log = log.with_series({**dict.fromkeys(GNSS), "velocity_forward": ahead, "velocity_starboard": across})
    sound = examine(log)
    assert sound.verdict == "clean"
    (figure,) = next(outcome for outcome in sound.outcomes if outcome.check == "across_body").figures
    assert figure.value == pytest.approx(1.0, abs=4.0 * figure.std)
    # an antenna far ahead of the point about which she turns goes to the other side than she drifts
    latitude, longitude = log.series["latitude"], log.series["longitude"]
    ahead_m = 60.0 * np.exp(1j * np.interp(latitude.time_utc_ns, velocity.time_utc_ns, np.unwrap(psi)))
    shrink = np.cos(np.median(latitude.value))
    moved = {
        "latitude": Series(latitude.time_utc_ns, latitude.value + ahead_m.real / EARTH_M),
        "longitude": Series(longitude.time_utc_ns, longitude.value + ahead_m.imag / EARTH_M / shrink),
    }
    assert examine(log.with_series(moved)).verdict == "clean"
    (finding,) = examine(changed(log, "velocity_starboard", -1.0)).findings
    assert [f.key for f in finding.faults] == [("sign", ("velocity_starboard",), "")]
    assert [outcome.check for outcome in finding.evidence] == ["across_body"]


def test_bow_and_course_swapped_are_no_late_compass() -> None:
    sound = closed_form_ship.log()
    (finding,) = examine(BOW_AND_COURSE.corrected(sound)).findings
    assert [f.key for f in finding.faults] == [BOW_AND_COURSE.key]
    (finding,) = examine(late(sound, "heading", 9.0)).findings
    assert {(f.kind, f.channels) for f in finding.faults} == {("latency", ("heading",)), ("latency", ("yaw_rate",))}


def test_frames_taken_for_each_other() -> None:
    log, psi = closed_form_ship.log(), closed_form_ship.truth()["heading"]
    velocity = log.velocity("course")
    assert velocity is not None
    time, bare = velocity.time_utc_ns, log.with_series(dict.fromkeys(GNSS))
    for names, value in (
        (("velocity_forward", "velocity_starboard"), velocity.value),
        (("velocity_north", "velocity_east"), velocity.value * np.exp(-1j * psi)),
    ):
        spoilt = bare.with_series({names[0]: Series(time, value.real), names[1]: Series(time, value.imag)})
        (finding,) = examine(spoilt).findings
        assert [(f.kind, f.channels) for f in finding.faults] == [("frame", names)]


@pytest.mark.parametrize(("by_s", "rate"), [(6.0, 0.0), (0.0, 0.01)])
def test_clocks(by_s: float, rate: float) -> None:
    spoilt = late(closed_form_ship.log(), "yaw_rate", by_s, rate)
    (finding,) = examine(spoilt).findings
    faults = {f.channels: f for f in finding.faults}
    fault = faults["yaw_rate",]
    assert (fault.kind, len(faults) <= 2) == ("clock_scale" if rate else "latency", True)
    assert fault.value == pytest.approx(rate or by_s, rel=0.05)


def test_two_channels_make_one_of_these() -> None:
    (finding,) = examine(changed(closed_form_ship.log("heading", "yaw_rate"), "yaw_rate", -1.0)).findings
    assert {f.channels for f in finding.faults} == {("heading",), ("yaw_rate",)}


def test_two_faults_at_once_are_both_found() -> None:
    spoilt = changed(changed(closed_form_ship.log(), "rudder_angle", -1.0), "speed_over_ground", 3600 / 1852)
    spoilt = replace(spoilt, units={"speed_over_ground": "m/s"})
    found = {f.channels for x in examine(spoilt).findings for f in x.faults}
    assert found == {("rudder_angle",), ("speed_over_ground",)}


def test_what_nothing_confirms_cannot_be_tested() -> None:
    found = examine(closed_form_ship.log("heading"))
    assert (found.verdict, found.untested) == ("untested", ("heading",))
    still = {n: Series(s.time_utc_ns[:120], s.value[:120] * 0.0) for n, s in closed_form_ship.log().series.items()}
    assert not examine(Log(still)).findings


def test_a_compass_that_stands_still_is_named_without_a_line() -> None:
    log = changed(closed_form_ship.log("heading", "yaw_rate"), "heading", 0.0)
    (finding,) = examine(log).findings
    assert [(f.kind, f.channels, setting(f)) for f in finding.faults] == [("stuck", ("heading",), "")]
    assert "heading_standstill" in {outcome.check for outcome in finding.evidence}


def held(log: Log, name: str, from_s: float, to_s: float) -> Log:
    one = log.series[name]
    seconds = one.seconds_since(closed_form_ship.START_NS)
    value = one.value.copy()
    value[(seconds >= from_s) & (seconds <= to_s)] = np.interp(from_s, seconds, value)
    return log.with_series({name: Series(one.time_utc_ns, value)})


@pytest.mark.parametrize("name", ["heading", "yaw_rate"])
def test_a_channel_that_stands_still_for_a_while_is_named(name: str) -> None:
    (finding,) = examine(held(closed_form_ship.log(), name, 270.0, 330.0)).findings
    (fault,) = finding.faults
    assert (fault.kind, fault.channels) == ("stuck", (name,))
    assert fault.value == pytest.approx(60.0, abs=1.0)
    assert fault.start_utc_ns == closed_form_ship.START_NS + 270 * SECOND_NS


def test_a_coarse_compass_on_a_straight_course_is_sound() -> None:
    log = closed_form_ship.log("heading", "yaw_rate", "speed_over_ground", "course_over_ground")
    random = np.random.Generator(np.random.PCG64(2))
    for name, value in (("heading", 0.7), ("course_over_ground", 0.7), ("yaw_rate", np.deg2rad(0.03))):
        noise = 0.0 if name == "heading" else 2e-3 * random.standard_normal(len(log.series[name]))
        log = log.with_series({name: Series(closed_form_ship.time_ns(), np.full(len(log.series[name]), value) + noise)})
    assert examine(log).findings == ()


def test_a_window_says_what_the_whole_says() -> None:
    sound = closed_form_ship.log().between(closed_form_ship.START_NS, closed_form_ship.START_NS + 900 * SECOND_NS)
    assert examine_window(sound).findings == examine(sound).findings == ()
    for name, (spoil, _) in FAULTS.items():
        window = spoil(sound)
        assert examine_window(window).findings == examine(window).findings, name


def test_a_contradiction_that_no_fault_explains_names_none() -> None:
    log = closed_form_ship.log("heading", "yaw_rate")
    random = np.random.Generator(np.random.PCG64(1))
    walk = 0.01 * np.cumsum(random.standard_normal(len(log.series["yaw_rate"])))
    found = examine(log.with_series({"yaw_rate": Series(log.series["yaw_rate"].time_utc_ns, walk)}))
    assert [x.faults for x in found.findings] in ([()], [])


def test_a_correction_undoes_its_fault() -> None:
    log = closed_form_ship.log()
    for fault in (
        Fault("sign", ("yaw_rate",)),
        Fault("unit", ("yaw_rate",), 60.0),
        Fault("latency", ("heading",), 2.5),
    ):
        back = replace(fault, value=1 / 60 if fault.kind == "unit" else -fault.value)
        again = back.corrected(fault.corrected(log)).series[fault.channels[0]]
        assert np.allclose(again.value, log.series[fault.channels[0]].value)
        assert np.array_equal(again.time_utc_ns, log.series[fault.channels[0]].time_utc_ns)


def test_every_unit_has_its_inverse() -> None:
    for factors in UNITS.values():
        for name, factor in factors.items():
            unit, taken_for = name.split(" taken for ")
            assert factors[f"{taken_for} taken for {unit}"] * factor == pytest.approx(1.0)


def test_it_says_the_same_twice() -> None:
    log = changed(closed_form_ship.log(), "heading", -1.0)
    assert [o.figures for some in ask(log) for o in some] == [o.figures for some in ask(log) for o in some]


@pytest.mark.parametrize("degrees", [8.0, -30.0])
def test_a_leap_of_the_compass_is_named_and_taken_out(degrees: float) -> None:
    log = closed_form_ship.log()
    heading = log.series["heading"]
    behind = np.arange(len(heading)) >= 700
    spoilt = log.with_series({"heading": Series(heading.time_utc_ns, heading.value + np.deg2rad(degrees) * behind)})
    (finding,) = examine(spoilt).findings
    (fault,) = finding.faults
    assert (fault.kind, fault.channels, setting(fault)) == ("leap", ("heading",), "")
    assert np.rad2deg(fault.value) == pytest.approx(degrees, abs=0.5)
    assert abs(fault.start_utc_ns - int(heading.time_utc_ns[700])) <= 2 * SECOND_NS
    assert examine(fault.corrected(spoilt)).findings == ()


@pytest.mark.parametrize("shown", [0.0, 5.43219])
def test_a_log_that_stops_or_repeats_itself_is_stuck(shown: float) -> None:
    log = closed_form_ship.log()
    water = log.series["speed_through_water"]
    still = (np.arange(len(water)) > 800) & (np.arange(len(water)) < 1900)
    spoilt = log.with_series({"speed_through_water": Series(water.time_utc_ns, np.where(still, shown, water.value))})
    (finding,) = examine(spoilt).findings
    assert [(f.kind, f.channels) for f in finding.faults] == [("stuck", ("speed_through_water",))]
    assert "constant" in finding.evidence[0].words


def test_a_coarse_log_that_repeats_itself_on_a_straight_course_is_sound() -> None:
    log = closed_form_ship.log()
    water = log.series["speed_through_water"]
    coarse = np.round(water.value / 0.5) * 0.5
    found = examine(log.with_series({"speed_through_water": Series(water.time_utc_ns, coarse)}))
    assert not any("standstill" in o.check for o in found.outcomes if o.state == "disagree")


def test_both_speeds_in_one_wrong_unit_are_one_fault() -> None:
    spoilt = changed(
        changed(closed_form_ship.log(), "speed_over_ground", 3600 / 1852), "speed_through_water", 3600 / 1852
    )
    (finding,) = examine(spoilt).findings
    assert [(f.kind, f.channels, f.name) for f in finding.faults] == [
        ("unit", ("speed_over_ground", "speed_through_water"), "kn taken for m/s")
    ]


def test_a_heading_in_radians_is_named_also_where_it_passes_north() -> None:
    log = closed_form_ship.log()
    heading = log.series["heading"]
    # written from 0 to 6.28 and read as degrees: what is 360 deg in the log is 6.28 deg, and nothing is unwrapped
    shown = np.deg2rad(np.mod(heading.value, 2.0 * np.pi))
    (finding,) = examine(log.with_series({"heading": Series(heading.time_utc_ns, shown)})).findings
    assert [(f.kind, f.channels, f.name) for f in finding.faults] == [("unit", ("heading",), "rad taken for deg")]
