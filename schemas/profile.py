"""The vessel profile: what a person writes once about a ship and how her logger names things.

The file is YAML (JSON is YAML). Particulars and sources may stand in one file or in several that are laid over each
other; two files that disagree are refused, see `merge`.
"""

from __future__ import annotations

import hashlib
import json
import re
from datetime import UTC, datetime
from fnmatch import fnmatch
from typing import Any, ClassVar, Literal

from pydantic import (
    AwareDatetime,
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    field_validator,
    model_serializer,
    model_validator,
)

from kempf.schemas.channels import CHANNELS
from kempf.schemas.errors import UsageError
from kempf.schemas.faults import faults_of
from kempf.schemas.frozen import Frozen
from kempf.schemas.side import Side
from kempf.schemas.units import SECOND_NS, factor_to_si

#: From here on spreadsheets count days, those of old Macintosh computers from the second.
_SPREADSHEETS = (datetime(1899, 12, 30, tzinfo=UTC), datetime(1904, 1, 1, tzinfo=UTC))

#: yyyy or yy, mm or mmm, and dd in any order, with one sign between them or none
_PART = r"(?:yyyy|yy|mmm|mm|dd)"
_DATE_FORM = re.compile(rf"(?=.*y)(?=.*m)(?=.*d){_PART}([-./ ]?){_PART}\1{_PART}")


class _Grown(Frozen):
    """A part of the profile to which keys were added: it is stored, and hashed, as it was where they are not used."""

    _later: ClassVar[frozenset[str]] = frozenset()

    @model_serializer(mode="wrap")
    def _as_before(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        content: dict[str, Any] = handler(self)
        return {key: value for key, value in content.items() if value is not None or key not in self._later}


class ChannelMap(Frozen):
    """How one column or topic field becomes a canonical channel."""

    channel: str
    unit: str
    #: which side counts as positive in the log; ``port`` turns the sign
    positive: Side = "starboard"
    #: added after the sign is turned, in ``unit``: a known mounting or index error
    offset: float = 0.0
    #: factor on the reading, before the offset: an instrument that is known to read so much too little
    scale: float = Field(default=1.0, ge=-1e6, le=1e6)
    #: so many seconds after the measurement the log says it was made
    delay_s: float = Field(default=0.0, ge=-3600.0, le=3600.0)
    #: seconds that this channel's clock counts in one second, from its source's first record on
    clock_rate: float = Field(default=1.0, ge=0.9, le=1.1)

    @model_validator(mode="after")
    def _known(self) -> ChannelMap:
        if self.channel not in CHANNELS:
            raise ValueError(f"unknown channel {self.channel!r}; known: {', '.join(CHANNELS)}")
        factor_to_si(self.unit, CHANNELS[self.channel].unit, self.channel)
        if self.scale == 0.0:
            raise ValueError("scale is a factor other than 0")
        return self

    @property
    def factor(self) -> float:
        """Factor from the log's unit, sign and scale to SI."""
        sign = -1.0 if self.positive == "port" else 1.0
        return sign * self.scale * factor_to_si(self.unit, CHANNELS[self.channel].unit, self.channel)

    @property
    def offset_si(self) -> float:
        """Offset in SI, added after the factor."""
        return self.offset * factor_to_si(self.unit, CHANNELS[self.channel].unit, self.channel)


class TimeColumn(_Grown):
    """Where the time of a log stands: UTC text, a date and a time of day, or elapsed time since a stated start."""

    #: column of the whole instant; one of its own, or ``date`` and ``time``, or rows that are counted
    column: str | None = None
    #: date, time: columns of the date and of the time of day, where they stand apart
    date: str | None = None
    time: str | None = None
    #: how the date is written, such as dd.mm.yyyy or dd-mmm-yyyy, in its own column or before the time of day in that
    #: of the whole instant; None for ISO 8601, yyyy-mm-dd or yyyymmdd
    date_form: str | None = None
    #: None for ISO 8601 text; else the unit of an elapsed or epoch number, or of the time since midnight
    unit: Literal["s", "ms", "us", "ns", "d"] | None = None
    #: start of the elapsed time; without it a number counts from 1970-01-01 UTC
    start: AwareDatetime | None = None
    #: seconds between two rows, where they are evenly spaced and the column is too coarse or not there
    interval_s: float | None = Field(default=None, gt=0, le=3600)

    _later: ClassVar[frozenset[str]] = frozenset({"date", "time", "date_form", "interval_s"})

    @field_validator("start")
    @classmethod
    def _of_our_time(cls, value: datetime | None) -> datetime | None:
        if value is not None and not (1970 <= value.year < 2200 or value in _SPREADSHEETS):
            raise ValueError(
                "start lies between the years 1970 and 2200, or is 1899-12-30T00:00:00Z or 1904-01-01T00:00:00Z, from "
                "which spreadsheets count days"
            )
        return value

    @field_validator("date_form")
    @classmethod
    def _a_form(cls, value: str | None) -> str | None:
        if value is not None and not _DATE_FORM.fullmatch(value):
            raise ValueError(
                "date_form has yyyy or yy, mm or mmm (the month's English name), and dd, once each, such as "
                "dd.mm.yyyy, mm/dd/yyyy, dd-mmm-yyyy or ddmmyy"
            )
        return value

    @model_validator(mode="after")
    def _one_way(self) -> TimeColumn:
        if (self.date is None) != (self.time is None):
            raise ValueError("date and time are given together: the columns of the date and of the time of day")
        if self.date is not None and self.column is not None:
            raise ValueError("column is that of the whole instant; with date and time leave it out")
        if self.date is not None and self.start is not None:
            raise ValueError("start is that of an elapsed time; the column of the date says the day")
        if self.date_form is not None and self.date is None and (self.column is None or self.unit is not None):
            raise ValueError(
                "date_form is that of the column date, or of a column of date and time of day without unit"
            )
        if self.unit == "d" and self.date is None and self.start is None:
            raise ValueError("days count from a start: give it, for those of a spreadsheet 1899-12-30T00:00:00Z")
        if self.column is None and self.date is None and self.interval_s is None and self.start is None:
            raise ValueError("give column, or date and time, or interval_s")
        return self

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns that it names."""
        return tuple(name for name in (self.column, self.date, self.time) if name is not None)

    @property
    def stated(self) -> bool:
        """Whether the profile states when a log begins, rather than the log: several may share that."""
        return self.start is not None or not self.columns


class Source(_Grown):
    """How the files of one kind are read; the first source whose pattern matches the file name is used."""

    match: str
    format: Literal["delimited", "mcap", "nmea"] | None = None
    time: TimeColumn | None = None
    channels: dict[str, ChannelMap] = Field(default_factory=dict)
    encoding: str = "utf-8"
    #: one character, or ``whitespace`` for any run of blanks; None reads it from the header
    separator: str | None = None
    #: the sign before the decimals of a number; None for a point
    decimal: Literal[".", ","] | None = None
    #: lines before the data that are not column names
    header_lines: int = Field(default=0, ge=0, le=1_000_000)
    #: names of the columns where the file has no line that names them
    columns: list[str] | None = None

    _later: ClassVar[frozenset[str]] = frozenset({"decimal"})

    @field_validator("separator")
    @classmethod
    def _one_character(cls, value: str | None) -> str | None:
        if value is not None and value != "whitespace" and (len(value) != 1 or not value.isascii() or value in '\r\n"'):
            raise ValueError("separator is one ASCII character, but no quote or line end, or 'whitespace'")
        return value


class Antenna(Frozen):
    """Position of the GNSS antenna from midships on the centre line at the keel, m."""

    forward_m: float = 0.0
    starboard_m: float = 0.0
    up_m: float = 0.0


class VesselProfile(_Grown):
    """A ship's particulars and the sources of her logs."""

    vessel: str | None = None
    length_m: float | None = Field(default=None, gt=0)
    beam_m: float | None = Field(default=None, gt=0)
    draught_m: float | None = Field(default=None, gt=0)
    block_coefficient: float | None = Field(default=None, gt=0, le=1)
    trial_speed_m_s: float | None = Field(default=None, gt=0)
    #: how well the trial speed is known as the speed of her zigzags before the first execute; see docs/no_log.md
    trial_speed_std_m_s: float | None = Field(default=None, gt=0)
    #: l of eq. (16): yaw acceleration per unit of lateral acceleration that the wind causes, 1/m
    wind_arm_per_m: float | None = None
    #: what her magnetic headings lack to true north where no sentence says it, deg, east positive
    variation_deg: float | None = Field(default=None, ge=-180, le=180)
    #: of a free-running model: length of the ship over that of the model, 45.7 for 1:45.7; all else here is the model's
    model_scale: float | None = Field(default=None, gt=1, le=1000)
    #: what acts on her beside the rudder, which the model has where none is named: see `surroundings.default_model`;
    #: None: the sea
    surroundings: Literal["tank", "pond", "sea"] | None = None
    antenna: Antenna = Antenna()
    sources: list[Source] = Field(default_factory=list)
    #: patterns of the files of an inbox that are her logs, by name or by path below the inbox, such as ``AUR_*.csv``
    inbox: list[str] | None = None

    _later: ClassVar[frozenset[str]] = frozenset({"variation_deg", "surroundings", "inbox", "model_scale"})

    def source_for(self, file_name: str) -> Source | None:
        """Return the first source whose pattern matches the file's name (without its folder), or None."""
        return next((s for s in self.sources if fnmatch(file_name, s.match)), None)

    def canonical_json(self) -> str:
        """Return the profile as one line of sorted JSON, the form that is hashed and stored."""
        return json.dumps(self.model_dump(mode="json"), sort_keys=True, separators=(",", ":"))

    @property
    def sha256(self) -> str:
        """Hash of `canonical_json` but for ``inbox``, which says whose logs are hers and not how they are read."""
        read = self.model_copy(update={"inbox": None})
        return hashlib.sha256(read.canonical_json().encode()).hexdigest()


def parse(mapping: Any, where: str) -> VesselProfile:
    """Check a mapping read from YAML and return the profile.

    Parameters
    ----------
    mapping : Any
        What the YAML reader gave.
    where : str
        Name of the file, for the message.

    Raises
    ------
    UsageError
        The content is not a profile; every fault is named with its place.
    """
    if not isinstance(mapping, dict):
        raise UsageError(
            "profile_not_a_mapping",
            f"{where} is not a vessel profile: expected keys such as 'vessel' and 'sources', "
            f"found {type(mapping).__name__}.",
            "See docs/profile.md for a profile that works.",
        )
    try:
        return VesselProfile.model_validate(mapping)
    except ValidationError as error:
        faults = faults_of(error, "profile", mapping)
        raise UsageError(
            "profile_invalid",
            f"{where} is not a valid vessel profile: {'; '.join(faults)}.",
            "Correct these keys; docs/profile.md lists every key with its unit.",
            {"faults": faults},
        ) from error


def merge(profiles: list[tuple[str, VesselProfile]]) -> VesselProfile:
    """Lay profiles over each other; keys may repeat only where they agree.

    Parameters
    ----------
    profiles : list of (str, VesselProfile)
        Where each came from, and the profile. At least one.

    Returns
    -------
    VesselProfile
        The union of all keys; sources in the order given, repeated ones once.

    Raises
    ------
    UsageError
        Two of them give one key different values, or one file pattern different sources.
    """
    values: dict[str, Any] = {}
    said_by: dict[str, str] = {}
    sources: dict[str, tuple[str, Source]] = {}
    for where, profile in profiles:
        given = profile.model_dump(exclude_unset=True, exclude={"sources"})
        for key, value in given.items():
            if key in values and values[key] != value:
                raise UsageError(
                    "profiles_disagree",
                    f"Two profiles disagree on {key}: {said_by[key]} says {values[key]!r}, {where} says {value!r}.",
                    "Make the two files agree, or give only one of them.",
                    {"key": key, said_by[key]: values[key], where: value},
                )
            values.setdefault(key, value)
            said_by.setdefault(key, where)
        for source in profile.sources:
            other = sources.setdefault(source.match, (where, source))
            if other[1] != source:
                raise UsageError(
                    "profiles_disagree",
                    f"Two profiles disagree on how files matching {source.match!r} are read: {other[0]} and {where}.",
                    "Make the two sources agree, or give only one of the files.",
                    {"match": source.match, "files": [other[0], where]},
                )
    return VesselProfile.model_validate({**values, "sources": [s for _, s in sources.values()]})


def overlay(below: VesselProfile, above: VesselProfile) -> VesselProfile:
    """Lay one profile over another: what the upper one says holds, what it leaves out stays.

    Parameters
    ----------
    below, above : VesselProfile
        A source of ``above`` replaces the one of ``below`` with the same file pattern, and is asked first.
    """
    kept = below.model_dump(exclude_unset=True, exclude={"sources"})
    given = above.model_dump(exclude_unset=True, exclude={"sources"})
    patterns = {source.match for source in above.sources}
    sources = [*above.sources, *(source for source in below.sources if source.match not in patterns)]
    return VesselProfile.model_validate({**kept, **given, "sources": sources})


def start_ns(start: datetime) -> int:
    """Return a zoned datetime as UTC nanoseconds, without rounding through a float."""
    whole = int(start.replace(microsecond=0).timestamp())
    return whole * SECOND_NS + start.microsecond * 1_000
