"""Times that stand in a field of the messages: the forms that are read, and what is said of any other."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import pytest

from kempf.schemas.errors import UsageError
from tests.ingest.test_mcap import START, profile, read, write

#: A second before each message is written, and a part of a second that no double holds beside the year.
TRUE = [START - 10**9 + k * 100_000_000 + 123_456_000 for k in range(5)]
GYRO = {"/gyro.heading": {"channel": "heading", "unit": "deg"}}


def iso(ns: int) -> str:
    return str(np.datetime64(ns, "ns").astype("datetime64[us]"))


def logged(form: Callable[[int], object], **time: object) -> tuple[bytes, object]:
    messages = [("/gyro", k / 10, {"t": form(ns), "heading": k}) for k, ns in enumerate(TRUE)]
    return write(messages), profile(GYRO, time={"column": "t", **time})


@pytest.mark.parametrize(
    ("form", "time"),
    [
        (lambda ns: {"sec": ns // 10**9, "nsec": ns % 10**9}, {}),
        (lambda ns: {"sec": ns // 10**9, "nanosec": ns % 10**9}, {}),
        (lambda ns: f"{iso(ns)}Z", {}),
        (lambda ns: f" {iso(ns).replace('T', ' ')} Z", {}),
        (lambda ns: f"{iso(ns + 7200 * 10**9)}+02:00", {}),
        (lambda ns: f"{iso(ns)}Z", {"start": "2025-01-01T00:00:00Z"}),
    ],
)
def test_stamps_and_text_are_exact(form: Callable[[int], object], time: dict[str, object]) -> None:
    readings = read(*logged(form, **time))
    assert readings.frame["time_utc_ns"].to_list() == TRUE and readings.notes == ()


def test_days_are_counted_as_those_of_a_spreadsheet() -> None:
    data, given = logged(lambda ns: 45_780 + (ns - TRUE[0]) / 86_400e9, unit="d", start="1899-12-30T00:00:00Z")
    times = read(data, given).frame["time_utc_ns"].to_list()
    midnight = int(np.datetime64("2025-05-03", "ns").astype("int64"))
    assert [abs(found - midnight - (true - TRUE[0])) < 1_000 for found, true in zip(times, TRUE, strict=True)] == [
        True
    ] * 5


def test_text_without_a_zone_is_utc_and_a_note_says_so() -> None:
    readings = read(*logged(iso))
    assert readings.frame["time_utc_ns"].to_list() == TRUE
    assert readings.notes == ("Times without a zone are taken as UTC.",)


def test_text_is_read_where_the_message_goes_the_slow_way() -> None:
    messages = [("/gyro", k / 10, {"t": f"{iso(ns)}Z", "heading": k, "µ": k}) for k, ns in enumerate(TRUE)]
    messages[1:3] = [("/gyro", 0.1, json.dumps(messages[1][2]).replace("\\u00b5", "m").encode()), messages[2]]
    data = write(
        [(t, s, m if isinstance(m, bytes) else json.dumps(m, ensure_ascii=False).encode()) for t, s, m in messages]
    )
    assert read(data, profile(GYRO, time={"column": "t"})).frame["time_utc_ns"].to_list() == TRUE


@pytest.mark.parametrize(
    ("form", "time", "found", "step"),
    [
        (lambda ns: ns, {}, str(float(TRUE[0]))[:3].replace(".", ""), "Write `unit: ns` beside the column."),
        (lambda ns: ns // 10**3, {}, str(TRUE[0] // 10**3), "Write `unit: us` beside the column."),
        (lambda ns: ns // 10**6, {}, str(TRUE[0] // 10**6), "Write `unit: ms` beside the column."),
        (lambda ns: f"{iso(ns)}Z", {"unit": "s"}, repr(f"{iso(TRUE[0])}Z"), "Leave out the unit: the text says it."),
        (lambda _: "soon", {}, "'soon'", "Name another time, or leave 'time' out."),
        (lambda _: -1, {}, "-1", "Name another time, or leave 'time' out."),
        (lambda ns: {"s": ns}, {}, "neither a number nor text", "Name a field below it, or leave 'time' out."),
    ],
)
def test_a_time_that_is_there_is_quoted_and_not_denied(
    form: Callable[[int], object], time: dict[str, object], found: str, step: str
) -> None:
    with pytest.raises(UsageError) as refused:
        read(*logged(form, **time))
    assert refused.value.code == "no_time_column"
    assert f"the first of /gyro has {found}" in refused.value.message and refused.value.next_step == step


def test_a_field_that_is_not_there_is_still_said_not_to_be() -> None:
    data, _ = logged(lambda ns: ns)
    with pytest.raises(UsageError, match="which no message that it maps has; every MCAP message has") as refused:
        read(data, profile(GYRO, time={"column": "header.stamp"}))
    assert refused.value.code == "no_time_column"


def test_of_some_topics_the_note_quotes_the_time_too() -> None:
    messages = [("/gyro", 0, {"t": f"{iso(TRUE[0])}Z", "heading": 1}), ("/nav", 0, {"t": "soon", "pose": {"speed": 1}})]
    channels = GYRO | {"/nav.pose.speed": {"channel": "speed_over_ground", "unit": "m/s"}}
    readings = read(write(messages), profile(channels, time={"column": "t"}))
    assert readings.notes == ("Messages of /nav have log time where t is no time, such as 'soon'.",)
    assert sorted(readings.frame["time_utc_ns"].to_list()) == [TRUE[0], START]
