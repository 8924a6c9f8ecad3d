"""Clocks of MCAP logs: messages that wait, recorders that are set on the way, stamps of other computers."""

import io
import json

import numpy as np
import polars as pl
import pytest
from mcap.writer import Writer

from kempf.pipeline.ingest.mcap import decode
from kempf.schemas.profile import VesselProfile
from tests.reading import read_log

START = 1_746_252_000_000_000_000
SECOND = 1_000_000_000
#: Topic -> field, channel, unit, and seconds between two messages.
TOPICS = {
    "/gyro": ("heading", "heading", "deg", 0.2),
    "/rudder": ("angle", "rudder_angle", "deg", 0.5),
    "/log": ("stw", "speed_through_water", "m/s", 1.0),
}
COLUMN = {"/gyro": "heading_rad", "/rudder": "rudder_angle_rad", "/log": "speed_through_water_m_s"}


def profile(time=None, channels=None):
    mapped = {
        f"{topic}.{field}": {"channel": channel, "unit": unit} for topic, (field, channel, unit, _) in TOPICS.items()
    }
    source = {"match": "*", "channels": channels or mapped, **({"time": time} if time else {})}
    return VesselProfile.model_validate({"sources": [source]})


def messages(seconds=60.0):
    """(log time, topic, payload, time of measurement), ns, by log time; everything takes 4 ms to the recorder."""
    draw, found = np.random.default_rng(3), []
    for n, (topic, (field, _, _, period)) in enumerate(TOPICS.items()):
        for k in range(round(seconds / period)):
            at = START + round((k * period + 0.013 * n + draw.uniform(0, 0.002)) * 1e9)
            angle = 20.0 * np.sin(k * period / 9.0 + n)
            found.append((at + 4_000_000, topic, {field: round(100.0 + angle if n == 0 else angle / 4 + 5, 4)}, at))
    return sorted(found, key=lambda one: one[0])


def moved(change, topics=TOPICS, **options):
    """Change the log time of some topics."""
    return [(change(at) if topic in topics else at, topic, data, true) for at, topic, data, true in messages(**options)]


def stamped(log, topics=TOPICS, ahead=0):
    """Give messages the stamp of a clock that is ahead by so much, ns."""
    out = []
    for at, topic, data, true in log:
        stamp = {"sec": (true + ahead) // SECOND, "nanosec": (true + ahead) % SECOND}
        out.append((at, topic, {**data, "header": {"stamp": stamp}} if topic in topics else data, true))
    return out


def write(log, *, in_order=True, publish=None, channel_of=lambda topic, k: topic):
    out = io.BytesIO()
    writer = Writer(out, chunk_size=4000)
    writer.start()
    schema, ids = writer.register_schema("any", "jsonschema", b"{}"), {}
    for k, (at, topic, data, true) in enumerate(sorted(log, key=lambda one: one[0]) if in_order else log):
        name = channel_of(topic, k)
        if name not in ids:
            ids[name] = writer.register_channel(topic, "json", schema, metadata={"publisher": name})
        writer.add_message(ids[name], at, json.dumps(data).encode(), at if publish is None else publish(true))
    writer.finish()
    return out.getvalue()


def read(data, given=None):
    return read_log("a.mcap", data, given or profile())


def times(readings, source):
    frame = readings.frame
    return frame.filter(frame["source"] == source)["time_utc_ns"].to_numpy()


def true_times(topic, **options):
    return np.array([true for _, own, _, true in messages(**options) if own == topic])


def off_s(readings, topic, **options):
    """Return how far the times are from those of the measurements."""
    found, true = times(readings, topic), true_times(topic, **options)
    assert found.size == true.size
    return (found - true) / 1e9


def every(period_s):
    """Log times of a recorder that looks so often."""
    period = round(period_s * 1e9)
    return lambda at: -(-at // period) * period + at % period // 1000


def at_half(change_s, at):
    return at + round(change_s * 1e9) * (at > START + 30 * SECOND)


def test_a_sound_log_is_read_as_it_was_recorded() -> None:
    for log, time in (
        (messages(), None),
        (stamped(messages()), None),
        (stamped(messages()), {"column": "header.stamp"}),
    ):
        readings = read(write(log), profile(time))
        assert readings.notes == () and readings.tally.records_rejected == 0
        assert np.all(off_s(readings, "/gyro") == (0.004 if time is None else 0.0))


def test_bursts_of_a_topic_are_spread_over_the_time_since_the_one_before() -> None:
    readings = read(write(moved(every(1.0), ["/gyro"])))
    assert np.abs(off_s(readings, "/gyro")[5:]).max() < 0.12
    assert np.abs(off_s(readings, "/rudder")).max() < 0.005
    assert len(readings.notes) == 1
    assert "bursts, every 1 s" in readings.notes[0] and "/gyro (0.058 s)" in readings.notes[0]


def test_topics_that_come_with_the_bursts_of_another_are_spread_too() -> None:
    readings = read(write(moved(every(1.0))))
    for topic, (*_, period) in TOPICS.items():
        assert abs(np.median(off_s(readings, topic))) <= period / 2
    assert "/log (0.29 s)" in readings.notes[0]


def test_pairs_of_two_devices_and_repetitions_are_no_bursts() -> None:
    log = []
    for k in range(120):
        for device, other in enumerate((0.0, 3.0)):
            log.append((START + k * SECOND // 2 + device * 1_000_000, "/rudder", {"angle": k % 40 + other}, 0))
    given = profile(channels={"/rudder.angle": {"channel": "rudder_angle", "unit": "deg"}})
    readings = read(write(log), given)
    assert readings.notes == () and times(readings, "/rudder")[1] == START + 1_000_000


def test_a_rudder_that_speaks_when_it_moves_has_no_bursts() -> None:
    log = [
        (START + round((k * 4.0 + 0.01 * n) * 1e9), "/rudder", {"angle": 0.3 * n * (-1) ** k}, 0)
        for k in range(40)
        for n in range(12)
    ]
    given = profile(channels={"/rudder.angle": {"channel": "rudder_angle", "unit": "deg"}})
    readings = read(write(log), given)
    assert readings.notes == () and times(readings, "/rudder")[1] == START + 10_000_000


def test_twin_rudders_that_follow_each_other_have_no_bursts() -> None:
    draw, log = np.random.default_rng(5), []
    for k in range(200):
        for side in range(2):
            angle = 20.0 * np.sin(k / 8) + draw.normal(0, 0.1)
            log.append((START + k * SECOND // 2 + side * 500_000, "/rudder", {"angle": angle}, 0))
    given = profile(channels={"/rudder.angle": {"channel": "rudder_angle", "unit": "deg"}})
    readings = read(write(log), given)
    assert readings.notes == () and times(readings, "/rudder")[1] == START + 500_000


def test_messages_that_waited_are_read_at_their_stamps() -> None:
    log = stamped(moved(every(1.0), ["/gyro"]))
    readings = read(write(log))
    assert np.all(off_s(readings, "/gyro") == 0.0)
    assert np.all(off_s(readings, "/rudder") == 0.004)
    assert readings.notes == (
        "Messages waited unevenly before they were recorded, while the stamps in them run evenly: /gyro (up to 0.8 s). "
        "They were read at the instants of their stamps.",
    )


def test_stamps_of_a_clock_that_is_off_are_moved_onto_the_recorders() -> None:
    log = stamped(moved(lambda at: at + at * 2_654_435_761 % 700_000_000, ["/log"]), ahead=-40 * SECOND)
    readings = read(write(log))
    assert np.abs(off_s(readings, "/log")).max() < 0.1


def test_stamps_that_are_coarser_than_log_time_are_not_used() -> None:
    log = [
        (at, topic, {**data, "stamp": {"sec": at // SECOND, "nanosec": 0}}, true)
        for at, topic, data, true in messages()
    ]
    assert np.all(off_s(read(write(log)), "/gyro") == 0.004)


def test_whole_seconds_are_spread() -> None:
    readings = read(write(moved(lambda at: at // SECOND * SECOND)))
    assert readings.tally.records_rejected == 0
    assert np.abs(off_s(readings, "/gyro")).max() < 0.25
    assert "whole seconds" in readings.notes[0] and "`publish_time`" in readings.notes[0]
    std_s = dict(readings.frame.group_by("source").agg(pl.col("instant_std_s").unique().item()).iter_rows())
    assert all(f"{source} ({own_s:.2g} s)" in readings.notes[0] for source, own_s in std_s.items())
    assert std_s["/log"] == pytest.approx(12.0**-0.5)


def test_a_topic_of_whole_seconds_that_comes_once_in_each_is_meant_so() -> None:
    log = [one for one in moved(lambda at: at // SECOND * SECOND) if one[1] == "/log"]
    given = profile(channels={"/log.stw": {"channel": "speed_through_water", "unit": "m/s"}})
    readings = read(write(log), given)
    assert readings.notes == () and times(readings, "/log")[1] == START + SECOND


@pytest.mark.parametrize("ahead_s", [0.3, 1.5, -2.0])
def test_log_time_is_put_right_by_stamps_of_another_clock(ahead_s) -> None:
    ahead = round(ahead_s * 1e9)
    log = stamped(messages(), ["/gyro", "/log"], ahead)
    readings = read(write(log), profile({"column": "header.stamp"}))
    assert np.all(off_s(readings, "/gyro") == ahead_s)
    assert np.abs(off_s(readings, "/rudder") - ahead_s).max() < 0.01
    assert f"{abs(ahead_s - 0.004):.3f} s {'ahead of' if ahead_s > 0 else 'behind'} log time" in readings.notes[0]
    assert "/rudder has, was put right" in readings.notes[0]


def test_stamps_that_may_be_late_or_off_are_noted_with_what_to_write() -> None:
    log = stamped(messages(), ["/gyro", "/log"], -SECOND // 2)
    readings = read(write(log), profile({"column": "header.stamp"}))
    assert np.all(off_s(readings, "/rudder") == 0.004)
    assert "write `delay_s: 0.504` at the channels of /rudder" in readings.notes[0]
    mapped = profile().sources[0].channels
    delayed = {
        k: {**v.model_dump(exclude_defaults=True), **({"delay_s": 0.504} if "/rudder" in k else {})}
        for k, v in mapped.items()
    }
    readings = read(write(log), profile({"column": "header.stamp"}, delayed))
    assert np.allclose(off_s(readings, "/rudder"), -0.5, atol=1e-6)


@pytest.mark.parametrize("stamp", [lambda true: true - START + 100 * SECOND, lambda true: true + 18 * SECOND])
def test_one_topic_that_stamps_by_another_clock_is_moved(stamp) -> None:
    log = stamped(messages(), ["/log", "/rudder"])
    log = [
        (
            at,
            topic,
            {**data, "header": {"stamp": {"sec": stamp(true) // SECOND, "nanosec": stamp(true) % SECOND}}},
            true,
        )
        if topic == "/gyro"
        else (at, topic, data, true)
        for at, topic, data, true in log
    ]
    readings = read(write(log), profile({"column": "header.stamp"}))
    assert readings.tally.records_rejected == 0
    assert np.abs(off_s(readings, "/gyro")).max() < 0.01 and np.all(off_s(readings, "/log") == 0.0)
    assert "The stamps of /gyro are" in readings.notes[0]


def test_stamps_that_stand_still_are_no_times() -> None:
    log = [
        (at, topic, {**data, "header": {"stamp": {"sec": 0, "nanosec": 0}}}, true)
        for at, topic, data, true in messages()
    ]
    log = [one if one[1] == "/gyro" else stamped([one])[0] for one in log]
    readings = read(write(log), profile({"column": "header.stamp"}))
    assert readings.tally.records_rejected == 0 and np.all(off_s(readings, "/gyro") == 0.004)
    assert readings.notes[0] == "The stamps of /gyro stand still: these messages have log time."


@pytest.mark.parametrize("step_s", [-3.0, -1.0])
def test_a_recorder_that_is_set_back_is_put_right(step_s) -> None:
    log = moved(lambda at: at_half(step_s, at))
    readings = read(write(sorted(log, key=lambda one: one[3]), in_order=False))
    assert readings.tally.records_rejected == 0
    for topic in TOPICS:
        assert np.abs(off_s(readings, topic) - step_s).max() < 0.03
    assert f"set back by {-step_s:.2f} s at 2025-05-03T06:00:" in readings.notes[0]


def test_a_recorder_that_is_set_forward_is_put_right_by_stamps_and_else_noted() -> None:
    log = moved(lambda at: at_half(1.5, at))
    readings = read(write(stamped(log, ["/gyro"])))
    assert "set forward by 1.50 s" in readings.notes[0]
    assert np.abs(off_s(readings, "/rudder") - 1.5).max() < 0.01
    readings = read(write(log))
    assert "All topics are silent for 1." in readings.notes[0]
    assert off_s(readings, "/rudder")[0] == 0.004


def test_a_pause_that_stamps_share_is_a_pause() -> None:
    log = [one for one in stamped(messages()) if not START + 20 * SECOND < one[3] < START + 22 * SECOND]
    readings = read(write(log))
    assert readings.notes == ()


def test_a_file_that_was_sorted_after_its_clock_was_set_back_is_noted() -> None:
    readings = read(write(moved(lambda at: at_half(-3.0, at))))
    assert readings.notes[0].startswith("For 3 s from 2025-05-03T06:00:27Z on every topic comes twice as often")


def test_halves_in_another_order_and_copies_are_no_clock_that_was_set() -> None:
    log = messages()
    for order in ([*log[250:], *log[:250]], [*log[:300], *log[200:]]):
        readings = read(write(order, in_order=False))
        assert not any("clock was set" in note for note in readings.notes)
        assert readings.tally.records_rejected > 0


@pytest.mark.parametrize("per_s", [1e3, 0.5, 1.02], ids=["ms since boot", "a simulation", "another clock's pace"])
def test_a_number_that_does_not_pass_as_log_time_does_is_no_stamp(per_s: float) -> None:
    log = [
        (at, topic, {**data, "timestamp": 0.5 + (true - START) / 1e9 * per_s}, true)
        for at, topic, data, true in messages(seconds=120.0)
    ]
    readings = read(write(log))
    assert readings.notes == () and readings.tally.records_rejected == 0
    assert np.all(off_s(readings, "/gyro", seconds=120.0) == 0.004)


@pytest.mark.parametrize("time", [None, {"column": "header.stamp"}])
def test_a_stall_behind_which_all_that_waited_comes_at_once_is_no_clock_that_was_set(time: dict | None) -> None:
    begin, end = START + 30 * SECOND, START + 33 * SECOND
    held = [
        (end + 1_000 * k if begin < at <= end else at, topic, data, true)
        for k, (at, topic, data, true) in enumerate(messages())
    ]
    readings = read(write(stamped(held, ["/gyro"])), profile(time))
    assert not any("clock was set" in note for note in readings.notes)
    # messages without a stamp are late only where they waited
    off = np.abs(off_s(readings, "/rudder"))
    assert np.all(off[true_times("/rudder") < begin - SECOND // 10] < 0.01)


def test_a_second_recorder_behind_the_first_is_no_clock_that_was_set() -> None:
    log = messages()
    late = [(at + 3_000_000 + k % 7 * 100_000, *rest) for k, (at, *rest) in enumerate(log)]
    readings = read(write([*log, *late], in_order=False))
    assert not any("clock was set" in note for note in readings.notes)


def test_the_clock_that_agrees_with_the_recorder_is_kept_beside_one_that_is_a_little_ahead() -> None:
    log = stamped(stamped(messages(), ["/gyro"]), ["/log"], ahead=300_000_000)
    readings = read(write(log), profile({"column": "header.stamp"}))
    assert np.all(off_s(readings, "/gyro") == 0.0)
    assert np.all(np.abs(off_s(readings, "/rudder")) < 0.01)
    assert np.all(np.abs(off_s(readings, "/log")) < 0.02)
    (note,) = (note for note in readings.notes if "ahead of log time" in note)
    assert "/log" in note and "/gyro" not in note


def test_a_single_wrong_stamp_moves_no_other_message() -> None:
    log = stamped(messages(seconds=120.0), ["/gyro", "/log"], ahead=300_000_000)
    at, topic, data, true = log[400]
    while topic != "/gyro":
        log = log[1:]
        at, topic, data, true = log[400]
    log[400] = (at, topic, {**data, "header": {"stamp": {"sec": true // SECOND + 10, "nanosec": 0}}}, true)
    found = read(write(log), profile({"column": "header.stamp"}))
    steps = np.diff(times(found, "/rudder")) / 1e9
    assert np.max(np.abs(steps - 0.5)) < 0.05


@pytest.mark.parametrize("order", [("1", "2"), ("2", "1")])
def test_publishers_are_parted_whichever_speaks_first_and_through_several_files(order: tuple[str, str]) -> None:
    first = write(messages(), channel_of=lambda topic, k: topic + order[k % 2])
    later = [(at + 60 * SECOND, topic, data, true) for at, topic, data, true in messages()]
    second = write(later, channel_of=lambda topic, k: topic + order[k % 2])
    one = read(first).frame.filter(pl.col("source").str.starts_with("/gyro"))["source"].value_counts()
    both = read(first + second).frame.filter(pl.col("source").str.starts_with("/gyro"))["source"].value_counts()
    counts = dict(one.iter_rows())
    assert set(counts) == {"/gyro", "/gyro#2"} and sum(counts.values()) == 300
    assert dict(both.iter_rows()) == {source: 2 * many for source, many in counts.items()}


def test_a_log_that_is_longer_than_the_sample_is_read_through_for_its_clocks(monkeypatch) -> None:
    data = write(moved(every(1.0), ["/gyro"], seconds=120.0))
    wanted = read(data)
    monkeypatch.setattr(decode, "_TOGETHER", 200)
    monkeypatch.setattr("kempf.pipeline.ingest.mcap.container.stream.WINDOW", 3000)
    found = read(data)
    assert found.frame.equals(wanted.frame) and found.notes == wanted.notes


def test_log_time_of_a_clock_that_never_ran_is_that_of_publishing() -> None:
    readings = read(write(moved(lambda at: 0), publish=lambda true: true))
    assert np.all(off_s(readings, "/gyro") == 0.0)
    assert readings.notes == ("The log times are all 0: the messages have their publish_time.",)


def test_the_unit_of_log_time_counts_where_it_is_not_that_of_mcap() -> None:
    given = profile({"column": "log_time", "unit": "us"})
    readings = read(write(moved(lambda at: at // 1000)), given)
    assert np.abs(off_s(readings, "/gyro") - 0.004).max() < 2e-6 and readings.notes == ()
    readings = read(write(messages()), given)
    assert np.all(off_s(readings, "/gyro") == 0.004)
    assert readings.notes == (
        "The log_time is in nanoseconds, as MCAP has it, and not in us, as the profile says: take `unit` out.",
    )


def test_two_publishers_of_a_topic_are_two_sources() -> None:
    log = messages()
    log += [
        (at + 60_000_000, topic, {"heading": data["heading"] + 6}, true)
        for at, topic, data, true in log
        if topic == "/gyro"
    ]
    log.sort(key=lambda one: one[0])
    second = {k for k, one in enumerate(log) if one[0] - one[3] > 50_000_000}
    data = write(log, channel_of=lambda topic, k: "second" if k in second else topic)
    mapped = {k: v.model_dump(exclude_defaults=True) for k, v in profile().sources[0].channels.items()}
    mapped["/gyro.heading"]["delay_s"] = 0.004
    readings = read(data, profile(channels=mapped))
    assert np.allclose(off_s(readings, "/gyro"), 0.0, atol=1e-6)
    assert np.allclose(times(readings, "/gyro#2") - true_times("/gyro"), 60_000_000, atol=1000)
    assert any(
        note.startswith("Topic /gyro has 2 publishers that speak at the same time") and note.endswith("/gyro, /gyro#2.")
        for note in readings.notes
    )


def test_a_channel_that_follows_on_another_of_its_topic_is_one_source() -> None:
    half = len(messages()) // 2
    readings = read(write(messages(), channel_of=lambda topic, k: topic + "+" * (k > half)))
    assert readings.notes == () and set(readings.frame["source"]) == set(TOPICS)


@pytest.mark.parametrize("late", [False, True])
def test_a_field_that_changes_its_name_is_named_with_what_is_there(late) -> None:
    log = [
        (
            at,
            topic,
            {"delta": data["angle"]} if topic == "/rudder" and (true < START + 20 * SECOND) == late else data,
            true,
        )
        for at, topic, data, true in messages()
    ]
    readings = read(write(log))
    assert readings.tally.by_reason == {"void": 40 if late else 80}
    which = "first 40 of 120 messages of /rudder, until" if late else "last 80 of 120 messages of /rudder, from"
    assert len(readings.notes) == 1 and f"The {which} 2025-05-03T06:00:20." in readings.notes[0]
    assert "do not give the field angle; they have delta." in readings.notes[0]


def test_readings_that_fail_now_and_then_are_no_field_that_ends() -> None:
    log = [
        (at, topic, {} if topic == "/rudder" and k % 7 == 0 else data, true)
        for k, (at, topic, data, true) in enumerate(messages())
    ]
    assert read(write(log)).notes == ()
