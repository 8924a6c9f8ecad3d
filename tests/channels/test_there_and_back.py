"""Readings that leap away and back: found where the rest of the channel shows that nothing moves like that."""

import numpy as np
import polars as pl
import pytest

from kempf.pipeline.channels.instruments import from_readings
from kempf.pipeline.channels.series import Series
from kempf.pipeline.channels.there_and_back import leaps
from kempf.schemas.units import SECOND_NS

RNG_SEED = 4
#: -999 deg/min, which lies within the channel's range
DROPOUT = float(np.deg2rad(-999.0 / 60.0))


def series(value, period_s=1.0):
    value = np.asarray(value, dtype=np.float64)
    return Series(np.round(np.arange(value.size) * period_s * SECOND_NS).astype(np.int64), value)


def turning(n=800, period_s=1.0, noise=0.02):
    """A ship that swings to and fro by 1.5 deg/s in legs of 100 s."""
    time = period_s * np.arange(n)
    swing = np.deg2rad(1.5 * np.sin(2.0 * np.pi * time / 200.0))
    return swing + np.deg2rad(noise) * np.random.default_rng(RNG_SEED).standard_normal(n)


@pytest.mark.parametrize("at", [[401], [401, 402], [401, 403], [10, 11, 97, 131, 402, 610, 789]])
def test_dropouts_of_the_rate_of_turn_are_found(at):
    rate = turning()
    rate[at] = DROPOUT
    assert np.flatnonzero(leaps(series(rate), "yaw_rate")).tolist() == at


@pytest.mark.parametrize(
    "rate",
    [
        turning(),
        turning(noise=0.3),
        np.round(np.rad2deg(turning()) * 60.0) / 60.0,
        turning(n=4000, period_s=0.1),
        # four turns of the ship between two readings: no motion shows in them
        turning(n=100, period_s=60.0),
        np.deg2rad(0.05) * np.random.default_rng(RNG_SEED).standard_normal(20_000),
        # waves turn a boat to and fro within a few readings
        turning(noise=0.0) + np.deg2rad(2.0) * np.sin(np.arange(800) * 1.7),
        np.zeros(50),
        turning(n=3),
        [],
    ],
)
def test_nothing_sound_is_found(rate):
    assert not leaps(series(rate), "yaw_rate").any()


def test_a_log_that_is_sailed_straight_and_turns_once_keeps_its_turn():
    rate = np.zeros(500)
    rate[250:252] = 0.02
    assert not leaps(series(rate, 30.0), "yaw_rate").any()
    drift = 1e-3 * np.sin(np.arange(500) / 80.0)
    assert not leaps(series(np.where(np.arange(500) == 250, 0.02, drift), 30.0), "yaw_rate").any()
    assert leaps(series(np.where(np.arange(500) == 250, 0.02, drift), 1.0), "yaw_rate").any()


def test_small_movements_of_a_rudder_that_is_hardly_put_over_are_sound():
    # a helmsman's touch of 2 deg in a log that holds no more than 0.3 deg else
    rudder = np.deg2rad(0.3 * np.sin(np.arange(600) / 9.0))
    rudder[[100, 101, 300, 301]] += np.deg2rad(2.0)
    assert not leaps(series(rudder), "rudder_angle").any()
    rudder[450] = np.deg2rad(-45.0)
    assert np.flatnonzero(leaps(series(rudder), "rudder_angle")).tolist() == [450]


def test_what_was_sailed_within_a_gap_is_not_judged():
    rate = turning()
    rate[401] = DROPOUT
    whole = series(rate)
    later = whole.time_utc_ns + np.where(np.arange(rate.size) > 401, 60 * SECOND_NS, 0)
    assert not leaps(Series(later, rate), "yaw_rate").any()


def readings_of(made, column):
    frame = pl.DataFrame({"time_utc_ns": made.time_utc_ns, "source": "row", column: made.value})
    return frame.with_columns(pl.lit(None, dtype=pl.Float64).alias("instant_std_s"))


def test_the_log_says_how_many_were_left_out():
    rate = turning()
    rate[[401, 610]] = DROPOUT
    made = series(rate)
    found = from_readings(readings_of(made, "yaw_rate_rad_s"))
    assert len(found.series["yaw_rate"]) == 798
    assert found.left_out["yaw_rate"].tolist() == made.time_utc_ns[[401, 610]].tolist()
    (note,) = [note for note in found.notes if "leap" in note]
    assert note == (
        "2 readings of yaw_rate left out: they leap away and back as no ship turns; the first is -16.65 deg/s at "
        "1970-01-01 00:06:41 UTC"
    )


def steering(period_s=0.5, rate_deg_s=5.0, noise=0.1, resolution=0.0):
    """A 20/20 zigzag of a steering gear that goes over every 100 s, deg."""
    time = np.arange(0.0, 800.0, period_s)
    corners = np.arange(50.0, 800.0, 100.0)
    at, angle = [0.0], [0.0]
    for k, corner in enumerate(corners):
        to = 20.0 if k % 2 == 0 else -20.0
        at += [corner, corner + abs(to - angle[-1]) / rate_deg_s]
        angle += [angle[-1], to]
    shown = np.interp(time, at, angle) + noise * np.random.default_rng(RNG_SEED).standard_normal(time.size)
    return np.round(shown / resolution) * resolution if resolution else shown


@pytest.mark.parametrize("failed", [-45.0, -88.8, 60.0])
@pytest.mark.parametrize("at", [[213, 214], [213, 214, 262, 263, 515, 1301, 1302]])
def test_a_broken_loop_of_the_rudder_is_found(failed, at):
    angle = steering()
    angle[at] = failed
    assert np.flatnonzero(leaps(series(np.deg2rad(angle), 0.5), "rudder_angle")).tolist() == at


def orders(held_readings):
    """An order that jumps and stays, deg."""
    return np.repeat(np.random.default_rng(RNG_SEED).choice([-20.0, -10.0, 0.0, 10.0, 20.0], 200), held_readings)


@pytest.mark.parametrize(
    ("angle", "period_s"),
    [
        (steering(), 0.5),
        (steering(resolution=1.0), 0.5),
        (steering(period_s=0.1), 0.1),
        (steering(period_s=2.0), 2.0),
        (steering(period_s=3.0), 3.0),
        (steering(period_s=10.0), 10.0),
        (steering(rate_deg_s=1000.0), 0.5),
        (orders(1), 1.0),
        (orders(2), 1.0),
        (orders(20), 1.0),
        # one order that is taken back at once
        (np.where(np.isin(np.arange(4000), [1005, 1006]), 35.0, orders(20)), 1.0),
    ],
)
def test_no_sound_rudder_is_found(angle, period_s):
    assert not leaps(series(np.deg2rad(angle), period_s), "rudder_angle").any()


def test_a_rudder_is_bridged_where_readings_are_left_out():
    angle = np.deg2rad(steering(noise=0.0))
    angle[[213, 214]] = np.deg2rad(-45.0)
    made = series(angle, 0.5)
    found = from_readings(readings_of(made, "rudder_angle_rad"))
    rudder = found.series["rudder_angle"]
    assert rudder.time_utc_ns.tolist() == made.time_utc_ns.tolist()
    assert np.allclose(np.rad2deg(rudder.value[[213, 214]]), 20.0)
    assert found.left_out["rudder_angle"].tolist() == made.time_utc_ns[[213, 214]].tolist()
    assert any(note.startswith("2 readings of rudder_angle left out") for note in found.notes)
