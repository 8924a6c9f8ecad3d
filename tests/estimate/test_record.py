"""What a segment must hold to be identified, and how it is laid out for the estimators."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.channels import undelayed_speeds
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.lateness import Lateness
from kempf.pipeline.channels.series import Series
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.grid_run import plain_run
from kempf.pipeline.estimate.record.sampled import sample
from kempf.pipeline.estimate.search.starts import thinned
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.units import SECOND_NS
from tests.estimate.simulated import bounds, changed, instruments_of, record_of, sailed, without

TRIAL = sailed("ferry", seed=1, duration_s=400.0)
START, END = bounds(TRIAL)
LOG = instruments_of(TRIAL)


def with_gap(channel: str, from_s: float, to_s: float) -> Instruments:
    one = LOG.series[channel]
    seconds = one.seconds_since(START)
    keep = (seconds < from_s) | (seconds > to_s)
    return changed(LOG, channel, Series(one.time_utc_ns[keep], one.value[keep]))


def valued(channel: str, change: Callable[[np.ndarray], np.ndarray]) -> Instruments:
    one = LOG.series[channel]
    return changed(LOG, channel, Series(one.time_utc_ns, change(one.value)))


def some_nan(value: np.ndarray) -> np.ndarray:
    return np.where(np.arange(value.size) % 97 == 50, np.nan, value)


def all_nan(value: np.ndarray) -> np.ndarray:
    return np.full_like(value, np.nan)


@pytest.mark.parametrize(
    ("log", "end_s", "code"),
    [
        (LOG, 15.0, "channel_missing"),  # fewer than 20 values of the GNSS
        (without(LOG, "heading"), None, "channel_missing"),
        (without(LOG, "rudder_angle"), None, "channel_missing"),
        (without(LOG, "course_over_ground"), None, "channel_missing"),
        (without(LOG, "speed_over_ground"), None, "channel_missing"),
        (valued("rudder_angle", lambda x: 0.0 * x + 0.01), None, "no_excitation"),
        (with_gap("rudder_angle", 100.0, 130.0), None, "rudder_gap"),
        (valued("speed_through_water", lambda x: 0.0 * x), None, "speed_stuck"),
        (valued("heading", some_nan), None, "not_finite"),
        (valued("rudder_angle", some_nan), None, "not_finite"),
        (valued("yaw_rate", some_nan), None, "not_finite"),
        (valued("speed_through_water", some_nan), None, "not_finite"),
        (valued("course_over_ground", all_nan), None, "not_finite"),
    ],
)
def test_refusals_have_their_code_and_say_what_to_do(log: Instruments, end_s: float | None, code: str) -> None:
    end = END if end_s is None else START + round(end_s * SECOND_NS)
    with pytest.raises(DataRejected) as caught:
        make_record(log, START, end)
    assert caught.value.code == code
    assert caught.value.message and caught.value.next_step


def test_a_segment_of_too_few_instants_is_refused() -> None:
    # slow instruments on common seconds: 30 instants in all
    time = START + np.arange(30, dtype=np.int64) * SECOND_NS
    names = ("heading", "rudder_angle", "course_over_ground", "speed_over_ground", "yaw_rate", "speed_through_water")
    slow = Instruments({n: Series(time, 1.0 + 0.1 * np.sin(np.arange(30.0))) for n in names}, {}, ())
    with pytest.raises(DataRejected) as caught:
        make_record(slow, START, END)
    assert caught.value.code == "segment_too_short"
    assert caught.value.details["instants"] == 30


def test_every_measurement_stands_at_its_own_instant_once() -> None:
    record = record_of(TRIAL)
    assert np.all(np.diff(record.time_s) > 0)
    for column, name in ((0, "course_over_ground"), (1, "yaw_rate")):
        one = LOG.series[name].between(record.start_utc_ns, record.start_utc_ns + round(record.time_s[-1] * SECOND_NS))
        held = np.isfinite(record.measured[:, column])
        np.testing.assert_allclose(record.time_s[held], one.seconds_since(record.start_utc_ns), atol=1e-9)
    rate = record.measured[np.isfinite(record.measured[:, 1]), 1]
    first = LOG.series["yaw_rate"].between(record.start_utc_ns, END).value
    np.testing.assert_array_equal(rate, first[: rate.size])
    assert record.used == (True, True, True)
    assert record.warnings == ()
    assert record.noise_start[0] == pytest.approx(0.05, rel=0.25)
    assert record.noise_start[1] == pytest.approx(np.deg2rad(0.03), rel=0.25)


def test_no_mean_of_readings_lies_beyond_the_grid() -> None:
    # a step that does not divide the record: readings follow its last instant
    for length_m in (40.0, 61.0, 77.0):
        run = plain_run("run", record_of(TRIAL), ModelSpec(), 0.0, length_m)
        own = (run.time_s[:, None] + run.offset_s)[np.isfinite(run.measured)]
        assert own.min() >= 0.0 and own.max() <= run.time_s[-1] + 1e-9


def test_the_heading_is_the_measurement_where_there_is_no_yaw_rate() -> None:
    record = record_of(TRIAL, "yaw_rate")
    assert record.used == (True, False, True)
    heading = record.measured[:, 2]
    assert abs(heading[np.isfinite(heading)][0]) < 0.01
    assert "no yaw rate" in record.warnings[0]


def test_a_gap_of_the_compass_costs_measurements_not_the_segment() -> None:
    record = make_record(with_gap("heading", 100.0, 130.0), START, END)
    whole = make_record(LOG, START, END)
    assert record.start_utc_ns == whole.start_utc_ns
    held = {t for t, y in zip(record.time_s, record.measured[:, 0], strict=True) if np.isfinite(y)}
    lost = np.isfinite(whole.measured[:, 0]) & np.array([t not in held for t in whole.time_s])
    assert 28 <= np.count_nonzero(lost) <= 32
    seconds = whole.time_s[lost] + (record.start_utc_ns - START) / SECOND_NS
    assert seconds.min() >= 99.0 and seconds.max() <= 131.0
    assert not np.any(np.isfinite(record.measured[:, 0]) & ~np.isfinite(record.heading_rad))


def test_thinning_drops_whole_instants_and_keeps_the_ends() -> None:
    record = record_of(TRIAL)
    thin = thinned(record, 100)
    assert thin.time_s.size < 0.5 * record.time_s.size
    assert thin.time_s[0] == record.time_s[0] and thin.time_s[-1] == record.time_s[-1]
    at = np.searchsorted(record.time_s, thin.time_s)
    np.testing.assert_array_equal(record.measured[at], thin.measured)
    np.testing.assert_array_equal(record.rudder_rad[at], thin.rudder_rad)


def test_sampling_takes_the_mean_rudder_of_the_step() -> None:
    record = record_of(TRIAL)
    sampled = sample(record, 0.5)
    assert sampled.step_s == 0.5
    assert np.all(np.isfinite(sampled.measured))
    # in the middle of the steps the held value is the rudder itself, to the curvature of a few samples
    first = np.flatnonzero(np.isfinite(record.measured[:, 0]))[0]
    start_s = max(record.time_s[first], record.time_s[np.flatnonzero(np.isfinite(record.measured[:, 1]))[0]])
    middle = start_s + 0.5 * (np.arange(sampled.rudder.size) + 0.5)
    truth = np.interp(middle[:-1], record.time_s, record.rudder_rad)
    assert np.sqrt(np.mean((sampled.rudder[:-1] - truth) ** 2)) < np.deg2rad(0.3)
    with pytest.raises(DataRejected) as caught:
        sample(record, 30.0)
    assert caught.value.code == "segment_too_short"


def test_a_hole_in_the_speed_is_refused_and_a_cut_end_is_flagged() -> None:
    trial = sailed(seed=2, duration_s=500.0)
    instruments = instruments_of(trial)
    start, end = bounds(trial)
    log = instruments.series["speed_through_water"]
    middle = (start + end) // 2
    hole = np.abs(log.time_utc_ns - middle) > 40 * SECOND_NS
    with pytest.raises(DataRejected) as caught:
        make_record(
            changed(instruments, "speed_through_water", Series(log.time_utc_ns[hole], log.value[hole])), start, end
        )
    assert caught.value.code == "speed_gap"
    tail = log.time_utc_ns < end - 100 * SECOND_NS
    cut = make_record(
        changed(instruments, "speed_through_water", Series(log.time_utc_ns[tail], log.value[tail])), start, end
    )
    assert any("at its ends" in warning for warning in cut.warnings)


def test_channels_that_never_meet_are_refused() -> None:
    trial = sailed(seed=2, duration_s=500.0)
    instruments = instruments_of(trial)
    start, end = bounds(trial)
    heading = instruments.series["heading"]
    middle = (start + end) // 2
    parts = {
        "heading": heading.between(start, middle),
        "course_over_ground": instruments.series["course_over_ground"].between(middle + 5 * SECOND_NS, end),
    }
    apart = instruments
    for name, series in parts.items():
        apart = changed(apart, name, series)
    with pytest.raises(DataRejected) as caught:
        make_record(apart, start, end)
    assert caught.value.code in {"no_lateral_speed", "channel_missing"}


def test_what_lateness_takes_is_the_difference_of_two_records(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a velocity that is found late, and of the same found a little later."""
    records = []
    for late_s in (0.3, 0.3 + 1e-4):
        found = Lateness(late_s, 0.05)
        monkeypatch.setattr(undelayed_speeds, "_velocity_lateness", lambda series, found=found: found)
        records.append(make_record(LOG, START, END))
    first, second = records
    assert first.lateral_by_late is not None
    assert first.instant_errors.smoothing_s == 0.05
    moved = (second.measured[:, 0] - first.measured[:, 0]) / 1e-4
    np.testing.assert_array_equal(np.isnan(first.lateral_by_late), np.isnan(moved))
    np.testing.assert_allclose(np.nan_to_num(first.lateral_by_late), np.nan_to_num(moved), atol=1e-6)
    assert np.nanstd(moved) > 1e-3
    # and of the means of a run
    runs = [plain_run("", one, ModelSpec(), 0.0, 100.0) for one in records]
    by_late = runs[0].lateral_by_late
    assert by_late is not None
    means = (runs[1].measured[:, 0] - runs[0].measured[:, 0]) / 1e-4
    seen = np.isfinite(means)
    np.testing.assert_allclose(by_late[seen], means[seen], atol=1e-6)
    monkeypatch.undo()
    assert make_record(LOG, START, END).lateral_by_late is None


def test_readings_that_were_left_out_are_counted_for_the_segment_they_are_in() -> None:
    at = np.array([START - SECOND_NS, START + SECOND_NS, END - SECOND_NS])
    log = replace(LOG, left_out={"yaw_rate": at})
    assert "2 readings of yaw_rate left out: they leap away and back as no ship turns" in (
        make_record(log, START, END).warnings
    )
    assert not any(
        "leap" in warning for warning in make_record(log, START + 2 * SECOND_NS, END - 2 * SECOND_NS).warnings
    )
