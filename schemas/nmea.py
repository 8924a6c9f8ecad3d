"""The sentences of NMEA 0183 that carry a canonical channel: type, fields, units, and where each says that it is void.

Positions count the fields behind the address, from 1. Sentences whose channels are not in fixed fields with one
unit, such as the list of transducers of XDR, are named in `SPECIAL`.

References
----------
NMEA 0183 version 4.11; IEC 61162-1:2016, section 8.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Form = Literal["number", "latitude", "longitude"]

_KNOT = 1852.0 / 3600.0
_FOOT = 0.3048
_TRUE = {"T": 1.0}
_KNOTS = {"N": 1.0}
_KILOMETRES = {"K": 1 / 1.852}


@dataclass(frozen=True)
class NmeaField:
    """One field of a sentence that is a canonical channel.

    Parameters
    ----------
    position : int
        Field of the value.
    channel, unit : str
        Canonical channel and the unit that the standard fixes.
    form : {"number", "latitude", "longitude"}
        ``latitude`` is ddmm.mmm, ``longitude`` dddmm.mmm.
    letter : int, optional
        Field with the letter that says unit, reference or side.
    factors : dict, optional
        Letter -> factor on the value; another letter makes the value unreadable.
    """

    position: int
    channel: str
    unit: str
    form: Form = "number"
    letter: int | None = None
    factors: dict[str, float] | None = None


@dataclass(frozen=True)
class Sentence:
    """One sentence type.

    Parameters
    ----------
    name : str
        The three letters behind the talker.
    words : str
        Plain description.
    least : int
        Fewest fields of a whole sentence.
    fields : tuple of NmeaField
        A channel that stands twice is read from the later field where the earlier one is empty.
    valid : dict of int to str, optional
        Field -> characters that mean valid data; anything else there makes the sentence void.
    modes : dict of int to str, optional
        Field of the mode indicator -> letters of a measurement; any other letter makes the sentence void: dead
        reckoning, manual input, a simulator, no fix. An empty field, as one that is not there, says nothing.
    carries : dict of int to tuple of str, optional
        Field -> contents with which the sentence carries the channel at all (relative wind, not true wind).
    utc, date : int, optional
        Fields of the time of day (hhmmss.ss) and of the date (ddmmyy).
    """

    name: str
    words: str
    least: int
    fields: tuple[NmeaField, ...] = ()
    valid: dict[int, str] | None = None
    modes: dict[int, str] | None = None
    carries: dict[int, tuple[str, ...]] | None = None
    utc: int | None = None
    date: int | None = None


def _position(first: int) -> tuple[NmeaField, NmeaField]:
    return (
        NmeaField(first, "latitude", "deg", "latitude", first + 1, {"N": 1.0, "S": -1.0}),
        NmeaField(first + 2, "longitude", "deg", "longitude", first + 3, {"E": 1.0, "W": -1.0}),
    )


#: Modes of a position system in which it measures: autonomous, differential, RTK with fixed and with float integers,
#: precise.
_FIXES = "ADRFP"

_THROUGH_WATER = "speed_through_water"

_ALL = (
    Sentence(
        "RMC",
        "recommended minimum: time, date, position, speed and course over ground, magnetic variation",
        9,
        (*_position(3), NmeaField(7, "speed_over_ground", "kn"), NmeaField(8, "course_over_ground", "deg")),
        valid={2: "A"},
        modes={12: _FIXES},
        utc=1,
        date=9,
    ),
    # qualities 6, 7, 8 are dead reckoning, manual input and a simulator; 9 is a receiver's own word for corrections
    Sentence("GGA", "GNSS fix", 6, _position(2), valid={6: "123459"}, utc=1),
    Sentence("GLL", "geographic position", 4, _position(1), valid={6: "A"}, modes={7: _FIXES}, utc=5),
    Sentence("ZDA", "time and date", 4, utc=1),
    Sentence(
        "VTG",
        "course and speed over ground",
        6,
        (
            NmeaField(1, "course_over_ground", "deg", letter=2, factors=_TRUE),
            NmeaField(5, "speed_over_ground", "kn", letter=6, factors=_KNOTS),
            NmeaField(7, "speed_over_ground", "kn", letter=8, factors=_KILOMETRES),
        ),
        modes={9: _FIXES},
    ),
    Sentence("HDT", "true heading", 1, (NmeaField(1, "heading", "deg"),)),
    Sentence("THS", "true heading and status", 2, (NmeaField(1, "heading", "deg"),), valid={2: "AE"}),
    Sentence("HDG", "magnetic heading with deviation and variation", 5),
    Sentence("HDM", "magnetic heading", 1),
    Sentence("ROT", "rate of turn", 1, (NmeaField(1, "yaw_rate", "deg/min"),), valid={2: "A"}),
    Sentence("RSA", "rudder sensor angles: starboard or single, port", 1),
    Sentence(
        "VHW",
        "speed through water; its headings repeat the compass and are left to it",
        6,
        (
            NmeaField(5, _THROUGH_WATER, "kn", letter=6, factors=_KNOTS),
            NmeaField(7, _THROUGH_WATER, "kn", letter=8, factors=_KILOMETRES),
        ),
    ),
    Sentence(
        "VBW",
        "dual ground and water speed",
        3,
        (NmeaField(1, _THROUGH_WATER, "kn"), NmeaField(2, "lateral_speed_through_water", "kn")),
        valid={3: "A"},
    ),
    Sentence(
        "VLW",
        "distance travelled through the water, in all and since a reset",
        2,
        (NmeaField(1, "distance_through_water", "nmi", letter=2, factors={"N": 1.0}),),
    ),
    Sentence(
        "MWV",
        "wind speed and angle",
        5,
        (
            NmeaField(1, "wind_angle", "deg"),
            NmeaField(3, "wind_speed", "m/s", letter=4, factors={"M": 1.0, "N": _KNOT, "K": 1 / 3.6}),
        ),
        valid={5: "A"},
        carries={2: ("R",)},
    ),
    Sentence(
        "MWD",
        "true wind speed and direction",
        8,
        (
            NmeaField(1, "true_wind_direction", "deg", letter=2, factors=_TRUE),
            NmeaField(5, "true_wind_speed", "kn", letter=6, factors=_KNOTS),
            NmeaField(7, "true_wind_speed", "kn", letter=8, factors={"M": 1.0 / _KNOT}),
        ),
    ),
    Sentence(
        "RPM",
        "shaft revolutions of the single or first shaft",
        3,
        (NmeaField(3, "shaft_speed", "rpm"),),
        valid={5: "A"},
        carries={1: ("S",), 2: ("0", "1", "")},
    ),
    Sentence("DPT", "depth below the transducer", 1, (NmeaField(1, "water_depth", "m"),)),
    Sentence(
        "DBT",
        "depth below the transducer",
        4,
        (
            NmeaField(3, "water_depth", "m", letter=4, factors={"M": 1.0}),
            NmeaField(1, "water_depth", "m", letter=2, factors={"f": _FOOT}),
            NmeaField(5, "water_depth", "m", letter=6, factors={"F": 6.0 * _FOOT}),
        ),
    ),
    Sentence("XDR", "transducers: roll and pitch", 4),
)

#: Sentences by their three letters.
SENTENCES: dict[str, Sentence] = {sentence.name: sentence for sentence in _ALL}

#: Channels of the sentences whose channels are not in fixed fields with one unit -> unit that the standard fixes.
SPECIAL: dict[str, dict[str, str]] = {
    "HDG": {"heading": "deg"},
    "HDM": {"heading": "deg"},
    "RSA": {"rudder_angle": "deg"},
    "XDR": {"roll": "deg", "pitch": "deg"},
}

#: Sentences that are read for their time alone.
SILENT: frozenset[str] = frozenset({"ZDA"})

#: Names under which XDR transducers of type A (angle), unit D (degrees) report roll and pitch.
XDR_ANGLES: dict[str, str] = {"ROLL": "roll", "PTCH": "pitch", "PITCH": "pitch"}

#: Talkers of the satellite systems: one receiver speaks as several of them.
SATELLITES: frozenset[str] = frozenset({"GP", "GN", "GL", "GA", "GB", "BD", "GI", "GQ", "QZ"})
