"""What the clocks of an MCAP log do to the hull that is identified from it: a zigzag with each of their troubles.

The zigzag of `benchmarks.ingest.nmea_clocks`, recorded as recorders, networks and other computers would that are off,
coarse or late; what is identified is compared with what the log gives as it should be.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import groupby
from typing import Any

import numpy as np
from mcap.writer import Writer

from benchmarks import result_page
from benchmarks.ingest.nmea_clocks import HULL, SETTINGS, Identified, identified, rows
from kempf.pipeline.simulate.logger_fields import LOGGER_FIELDS
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.trial import simulate_trial
from kempf.schemas.profile import TimeColumn, VesselProfile

SECOND = 1_000_000_000
HEADING, RUDDER = "/gyro/heading", "/steering/rudder"
#: Topics of instruments that are wired to the recorder, and whose messages have no stamp.
WIRED = (RUDDER, "/log/speed")
#: Notes with one of these words are those on clocks, publishers and fields.
WORDS = ("clock", "stamps", "log times", "waited", "silent", "twice", "publishers", "do not give", "same_instant")


@dataclass(frozen=True)
class Message:
    """What a topic brings."""

    #: By the recorder's clock, UTC ns.
    log_ns: int
    #: When it was published and when it was measured, UTC ns.
    publish_ns: int
    measured_ns: int
    topic: str
    content: dict[str, Any]
    #: Which of the topic's publishers it is from.
    publisher: int = 0


Log = list[Message]


@cache
def sound() -> tuple[Message, ...]:
    """Return the log as it should be."""
    trial = simulate_trial(SETTINGS)
    present = {record.instrument.name for record in trial.instruments}
    log = []
    for topic, fields in groupby((f for f in LOGGER_FIELDS if f.instrument in present), key=lambda field: field.topic):
        own = list(fields)
        record = trial.record(own[0].instrument)
        columns = [field.written(record.values[field.column]).tolist() for field in own]
        arrival, measured = record.arrival_utc_ns.tolist(), record.measured_utc_ns.tolist()
        for at, true, *values in zip(arrival, measured, *columns, strict=True):
            log.append(Message(at, at, true, topic, dict(zip((field.name for field in own), values, strict=True))))
    return tuple(sorted(log, key=lambda one: one.log_ns))


def written(log: Log, *, in_order: bool = True) -> bytes:
    """Write messages by their log time, or as they come."""
    out = io.BytesIO()
    writer = Writer(out)
    writer.start()
    schema, channels = writer.register_schema("any", "jsonschema", b'{"type": "object"}'), dict[tuple[str, int], int]()
    for one in sorted(log, key=lambda one: one.log_ns) if in_order else log:
        name = one.topic, one.publisher
        if name not in channels:
            channels[name] = writer.register_channel(one.topic, "json", schema, {"publisher": str(one.publisher)})
        writer.add_message(channels[name], one.log_ns, json.dumps(one.content).encode(), one.publish_ns)
    writer.finish()
    return out.getvalue()


def recorded(change: Callable[[int, int], int], begins: str = "/") -> Log:
    """Change the log time of topics, given with the seconds since the log's beginning."""
    log = sound()
    start = log[0].log_ns
    return [
        replace(one, log_ns=change(one.log_ns, (one.log_ns - start) // SECOND)) if one.topic.startswith(begins) else one
        for one in log
    ]


def every(period_s: float, at: int, since_s: int) -> int:
    """By a recorder that looks so often."""
    del since_s
    period = round(period_s * SECOND)
    return -(-at // period) * period + at % period // 1000


def set_by(step_s: float, at: int, since_s: int) -> int:
    """By a clock that is set on the way."""
    return at + (round(step_s * SECOND) if since_s >= 400 else 0)


def stamped(log: Log, ahead: Callable[[str, int], int] = lambda topic, at: 0, without: tuple[str, ...] = ()) -> Log:
    """Stamp messages with the time of measurement, by a clock that is ahead by so much, ns."""
    out = []
    for one in log:
        stamp = one.measured_ns + ahead(one.topic, one.measured_ns)
        header = (
            {} if one.topic in without else {"header": {"stamp": {"sec": stamp // SECOND, "nanosec": stamp % SECOND}}}
        )
        out.append(replace(one, content=one.content | header))
    return out


def sensors(ahead_s: float) -> bytes:
    """By a computer whose clock is ahead of the recorder's; the rudder is wired to the recorder."""
    return written(stamped(list(sound()), lambda topic, at: round(ahead_s * SECOND), WIRED))


def heading_by(clock: Callable[[int], int]) -> bytes:
    """Stamp the heading by another clock than the rest."""
    return written(stamped(list(sound()), lambda topic, at: clock(at) if topic == HEADING else 0, WIRED))


def queued() -> Log:
    """Let headings wait in a queue, none longer than 0.8 s or overtaken by another."""
    draw, last, log = np.random.default_rng(1), 0, []
    for one in sound():
        if one.topic == HEADING:
            last = max(last + 1, one.log_ns + int(draw.uniform(0.0, 0.8) * SECOND))
        log.append(replace(one, log_ns=last) if one.topic == HEADING else one)
    return log


def two_compasses() -> Log:
    """Let a second compass, half a degree off, publish under the same topic."""
    others = [
        replace(
            one,
            log_ns=one.log_ns + SECOND // 10,
            content={"heading": (one.content["heading"] + 0.5) % 360.0},
            publisher=1,
        )
        for one in sound()
        if one.topic == HEADING
    ]
    return [*sound(), *others]


def renamed() -> Log:
    """Let the rudder's field have another name in the second half."""
    half = sound()[len(sound()) // 2].log_ns
    return [
        replace(one, content={"angle": one.content["rudder"]}) if one.topic == RUDDER and one.log_ns > half else one
        for one in sound()
    ]


#: Every trouble by name; those of the second kind are read with ``time: {column: header.stamp}``.
LOG_TIME: dict[str, Callable[[], bytes]] = {
    "none": lambda: written(list(sound())),
    "headings in bursts of 1 s": lambda: written(recorded(partial(every, 1.0), HEADING)),
    "headings in bursts of 0.5 s": lambda: written(recorded(partial(every, 0.5), HEADING)),
    "GNSS in bursts of 2 s": lambda: written(recorded(partial(every, 2.0), "/gnss")),
    "everything in bursts of 1 s": lambda: written(recorded(partial(every, 1.0))),
    "headings in bursts of 0.2 s, one in each": lambda: written(recorded(partial(every, 0.2), HEADING)),
    "headings in bursts of 1 s, with stamps": lambda: written(stamped(recorded(partial(every, 1.0), HEADING))),
    "headings queued for up to 0.8 s, with stamps": lambda: written(stamped(queued())),
    "log times of whole seconds": lambda: written(recorded(lambda at, _: at // SECOND * SECOND)),
    "log times of 0": lambda: written(recorded(lambda at, _: 0)),
    "recorder set back by 3 s on the way": lambda: written(recorded(partial(set_by, -3.0)), in_order=False),
    "recorder set back by 3 s, file sorted since": lambda: written(recorded(partial(set_by, -3.0))),
    "recorder set forward by 1.5 s": lambda: written(recorded(partial(set_by, 1.5))),
    "recorder set forward by 1.5 s, with stamps": lambda: written(stamped(recorded(partial(set_by, 1.5)))),
    "two compasses under one topic, 0.5 deg apart": lambda: written(two_compasses()),
    "rudder's field renamed half way": lambda: written(renamed()),
}
STAMPS: dict[str, Callable[[], bytes]] = {
    "stamps, rudder and speed log without": partial(sensors, 0.0),
    "stamps 0.3 s ahead of the recorder": partial(sensors, 0.3),
    "stamps 1.5 s ahead": partial(sensors, 1.5),
    "stamps 1 s behind": partial(sensors, -1.0),
    "stamps 0.5 s behind, as messages that take so long": partial(sensors, -0.5),
    "headings stamped in GPS time, 18 s ahead": lambda: heading_by(lambda at: 18 * SECOND),
    "headings stamped since boot": lambda: heading_by(lambda at: 100 * SECOND - sound()[0].log_ns),
    "headings stamped with 0": lambda: heading_by(lambda at: -at),
}


def by_stamps(profile: VesselProfile) -> VesselProfile:
    """Return a profile that takes the time of MCAP logs from their stamps."""
    sources = [
        one.model_copy(update={"time": TimeColumn(column="header.stamp")} if one.match == "*.mcap" else {})
        for one in profile.sources
    ]
    return profile.model_copy(update={"sources": sources})


def main() -> None:
    """Run the benchmark and write its page."""
    profile = logger_profile(SETTINGS)
    found: dict[str, Identified] = {}
    for troubles, own in ((LOG_TIME, profile), (STAMPS, by_stamps(profile))):
        for name, trouble in troubles.items():
            found[name] = identified(trouble(), "log.mcap", own, WORDS)
            print(name, found[name], flush=True)
    head = ("trouble", "kept, %", *HULL, "first note on it")
    lines = [
        "A zigzag of a simulated mariner, identified from her log with each trouble of its clocks. Each number of the "
        "hull: by how many of its standard errors it is off what the log gives without any. The rows from "
        f'"{next(iter(STAMPS))}" on are read with `time: {{column: header.stamp}}`.',
        "",
        *result_page.table(head, list(rows(found))),
    ]
    result_page.write("ingest.mcap_clocks", "Clocks of MCAP logs", lines)


if __name__ == "__main__":
    main()
