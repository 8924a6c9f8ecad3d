"""A profile for a person to complete, from the columns or topics of a log: what is guessed is marked with a ``?``.

Nothing is read with a guess: a profile in which a ``?`` is left is refused.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from kempf.schemas.profile import ChannelMap
from kempf.schemas.units import TO_SI

if TYPE_CHECKING:
    from kempf.pipeline.ingest.delimited import Titled
    from kempf.pipeline.ingest.mcap.topics.fields import Fields

#: channel and the unit that loggers mostly write it in, by what its column is called; the first that fits
_NAMES: tuple[tuple[str, str, str], ...] = (
    (r"lat(itude)?", "latitude", "deg"),
    (r"lon(g|gitude)?|lng", "longitude", "deg"),
    (r"sog|speed over ground|gps speed", "speed_over_ground", "kn"),
    (r"cog|course over ground|course|track", "course_over_ground", "deg"),
    (r"stw|log speed|speed through water|water speed", "speed_through_water", "kn"),
    (r"rot|r|yaw ?rate|rate of turn|turn rate|gyro ?z", "yaw_rate", "deg/min"),
    (r"hdg|hdt|heading|psi|yaw|gyro|compass", "heading", "deg"),
    (r"(rudder|delta) (order|cmd|command|set|setpoint)|ordered rudder", "rudder_order", "deg"),
    (r"rudder|rudder angle|delta|rsa|helm", "rudder_angle", "deg"),
    (r"(true wind|tw) ?(speed|s)", "true_wind_speed", "kn"),
    (r"(true wind|tw) ?(direction|dir|d)", "true_wind_direction", "deg"),
    (r"(relative |apparent )?wind speed|aws", "wind_speed", "kn"),
    (r"(relative |apparent )?wind (angle|dir|direction)|awa", "wind_angle", "deg"),
    (r"rpm|shaft( speed)?|revs|propeller", "shaft_speed", "rpm"),
    (r"depth|water depth", "water_depth", "m"),
    (r"roll|heel|phi", "roll", "deg"),
    (r"pitch|trim|theta", "pitch", "deg"),
)
_TIME = re.compile(
    r"utc|t|time( ?stamp)?|date ?time|datetime|epoch|gps ?time|(time|time of day) utc|utc time|time of day"
)
_DATE = re.compile(r"((utc|gps) ?)?(date|day)( utc)?")
_UNIT = {re.sub(r"[^a-z]", "", unit.lower()): unit for unit in TO_SI} | {"degs": "deg/s", "knots": "kn", "kts": "kn"}


def draft_profile(
    file_name: str, columns: Sequence[str], titled: Titled | None = None, encoding: str | None = None
) -> str:
    """Return the draft of a profile for a delimited log, YAML with a ``?`` wherever a person has to look.

    Parameters
    ----------
    columns : sequence of str
        Every column of the log.
    titled : Titled, optional
        Where lines of title stand before the table.
    encoding : str, optional
        By which the columns were read, where that is not UTF-8.
    """
    if titled is not None:
        columns = titled.names or [f"column {k}" for k in range(1, titled.count + 1)]
    words = [_words(column) for column in columns]
    day, clock = (
        next((c for c, (name, _) in zip(columns, words, strict=True) if kind.fullmatch(name)), None)
        for kind in (_DATE, _TIME)
    )
    lines = [
        *_head(file_name, "columns"),
        *([f'    encoding: "{encoding}?"  # the text is not in UTF-8'] if encoding else []),
        *_table(titled, columns),
        _time(day, clock),
        "    channels:",
    ]
    for column, (name, unit) in zip(columns, words, strict=True):
        if column not in (day, clock):
            channel, usual = _guess(name)
            lines.append(_entry(column, channel, unit or usual))
    return "\n".join(lines) + "\n"


def draft_topics(file_name: str, topics: Mapping[str, Fields]) -> str:
    """Return the draft of a profile for an MCAP log, with a ``?`` wherever a person has to look.

    Parameters
    ----------
    topics : mapping of str to Fields
        The fields of every topic that hold a number.
    """
    lines = [*_head(file_name, "topics"), "    channels:  # '<topic>.<field>'; the time is that at which it was logged"]
    for topic, fields in topics.items():
        for field, mapped in fields.items():
            if isinstance(mapped, ChannelMap):
                more = ", positive: port" if mapped.positive == "port" else ""
                more += f", offset: {mapped.offset:.6g}" if mapped.offset else ""
                lines.append(_entry(f"{topic}.{field}", mapped.channel, mapped.unit, more))
                continue
            # an element of a list is called as the list is
            name, unit = _words(
                next(part for part in reversed(field.split(".")) if not part.isdigit() or part == field)
            )
            last = _words(topic.rpartition("/")[2])[0]
            said = [_words(mapped)[0]] if mapped else [name, f"{last} {name}", last]
            channel, usual = next((guess for guess in map(_guess, said) if guess[0]), ("", ""))
            # names are those of joints, whose angles are in rad (REP-103)
            usual = "rad" if mapped and usual == "deg" else usual
            label = f"  # {mapped!r} in the log" if mapped else ""
            lines.append(_entry(f"{topic}.{field}", channel, unit or usual) + label)
    return "\n".join(lines) + "\n"


def _head(file_name: str, contents: str) -> list[str]:
    return [
        f"# A draft from the {contents} of {file_name}. Correct every line that has a ? and delete the ?;",
        "# take out the lines that are not needed. docs/profile.md lists the channels and the units.",
        'vessel: "?"',
        "length_m: null",
        "sources:",
        # a bracket in a pattern begins a choice of signs
        f"  - match: {json.dumps(file_name.replace('[', '[[]'))}",
    ]


def _time(day: str | None, clock: str | None) -> str:
    """Return where the time stands: a column of its own, or a date beside a time of day."""
    if day is None or clock is None:
        column = json.dumps((clock or day or "") + "?")
        return f"    time: {{column: {column}}}  # with a unit if it is a number of seconds"
    both = ", ".join(f"{key}: {json.dumps(column + '?')}" for key, column in (("date", day), ("time", clock)))
    return f"    time: {{{both}}}  # with date_form: dd.mm.yyyy or the like if the date is not yyyy-mm-dd"


def _table(titled: Titled | None, columns: Sequence[str]) -> list[str]:
    """Return how a table below lines of title is read."""
    if titled is None:
        return []
    return [
        *([f"    header_lines: {titled.header_lines}  # of title, before the table"] if titled.header_lines else []),
        f"    separator: {json.dumps(titled.separator)}",
        *([] if titled.names else [f"    columns: {json.dumps(list(columns))}  # no line of the file names them"]),
    ]


def _entry(key: str, channel: str, unit: str, more: str = "") -> str:
    fields = f"channel: {json.dumps(channel + '?')}, unit: {json.dumps(unit + '?')}{more}"
    return f"      {json.dumps(key, ensure_ascii=False)}: {{{fields}}}"


def _words(column: str) -> tuple[str, str | None]:
    """Return the name of a column in plain words, and the unit that stands behind it."""
    parts = re.split(r"[\s_.()\[\]]+", column.strip(" ()[]").lower())
    for count in (2, 1):
        unit = _UNIT.get(re.sub(r"[^a-z]", "", "".join(parts[-count:])))
        if len(parts) > count and unit is not None:
            return " ".join(parts[:-count]), unit
    return " ".join(parts), None


def _guess(name: str) -> tuple[str, str]:
    return next(((channel, unit) for pattern, channel, unit in _NAMES if re.fullmatch(pattern, name)), ("", ""))
