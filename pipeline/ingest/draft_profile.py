"""A profile for a person to complete, from the names of a log's columns: what is guessed is marked with a ``?``.

Nothing is read with a guess: a profile in which a ``?`` is left is refused.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from kempf.schemas.units import TO_SI

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
_TIME = re.compile(r"utc|t|time( ?stamp)?|date ?time|datetime|epoch|gps ?time|time utc")
_UNIT = {re.sub(r"[^a-z]", "", unit.lower()): unit for unit in TO_SI} | {"degs": "deg/s", "knots": "kn", "kts": "kn"}


def draft_profile(file_name: str, columns: Sequence[str]) -> str:
    """Return the draft of a profile for a delimited log, YAML with a ``?`` wherever a person has to look.

    Parameters
    ----------
    columns : sequence of str
        Every column of the log.
    """
    words = [_words(column) for column in columns]
    clock = next((c for c, (name, _) in zip(columns, words, strict=True) if _TIME.fullmatch(name)), None)
    lines = [
        f"# A draft from the columns of {file_name}. Correct every line that has a ? and delete the ?;",
        "# take out the columns that are not needed. docs/profile.md lists the channels and the units.",
        'vessel: "?"',
        "length_m: null",
        "sources:",
        f"  - match: {json.dumps(file_name)}",
        f"    time: {{column: {json.dumps((clock or '') + '?')}}}  # with a unit if it is a number of seconds",
        "    channels:",
    ]
    for column, (name, unit) in zip(columns, words, strict=True):
        if column != clock:
            channel, usual = _guess(name)
            lines.append(
                f"      {json.dumps(column)}: {{channel: {json.dumps(channel + '?')}, "
                f"unit: {json.dumps((unit or usual) + '?')}}}"
            )
    return "\n".join(lines) + "\n"


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
