"""What NMEA sentences say: fields by the table in `kempf.schemas.nmea`, in columns, one sentence type at a time.

When they say it is settled in `clock`; which of two rudders and which magnetic variation holds, by looking at the
whole log, in `compass_and_rudder`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.ingest.decoded import CODE, Flag, Float, Reason
from kempf.pipeline.ingest.nmea.frames import Frames
from kempf.pipeline.ingest.spans import Index
from kempf.pipeline.ingest.text.cells import Cells
from kempf.schemas.channels import CHANNELS
from kempf.schemas.nmea import SENTENCES, SILENT, XDR_ANGLES, NmeaField, Sentence
from kempf.schemas.units import factor_to_si

#: Most transducers that are read of one sentence.
_TRANSDUCERS = 10

_DEGREE = factor_to_si("deg", "rad", "angle")


@dataclass(frozen=True, eq=False)
class Fields:
    """The sentences of one type, field by field."""

    frames: Frames
    #: Shape (m,). Their records, ascending.
    record: Index

    @cached_property
    def count(self) -> Index:
        """Number of fields behind the address, shape (m,)."""
        return self.frames.commas[self.record]

    def at(self, place: int) -> Cells:
        """Return the fields at a place, counted from 1; empty where a sentence ends before it."""
        comma, stop = self.frames.comma, self._stop
        if comma.size == 0:
            return Cells(self.frames.body.buffer, stop, stop)
        here = self._first + (place - 1)
        start = comma[np.minimum(here, comma.size - 1)] + 1
        end = np.where(self.count > place, comma[np.minimum(here + 1, comma.size - 1)], stop)
        if self._fewest < place:
            there = self.count >= place
            start, end = np.where(there, start, stop), np.where(there, end, stop)
        constructor = Cells.of if self.frames.padded else Cells
        return constructor(self.frames.body.buffer, start, end)

    @cached_property
    def _stop(self) -> Index:
        return self.frames.body.stop[self.record]

    @cached_property
    def _first(self) -> Index:
        return self.frames.first_comma[self.record]

    @cached_property
    def _fewest(self) -> int:
        return int(self.count.min(initial=0))


@dataclass(frozen=True, eq=False)
class Said:
    """What the sentences of one type say."""

    fields: Fields
    #: Shape (m,). Code of the refusal, 0 for none.
    reason: NDArray[np.int8]
    #: Channel -> value in SI (NaN where the text is no number) and whether it is there, each shape (m,).
    values: dict[str, tuple[Float, Flag]] = field(default_factory=dict)

    @property
    def record(self) -> Index:
        """Records of the sentences, ascending, shape (m,)."""
        return self.fields.record


def read_type(frames: Frames, record: Index, name: str) -> Said:
    """Read the sentences of one type.

    Parameters
    ----------
    record : ndarray of int64, shape (m,)
        Records of the sentences, ascending; whole, with the right checksum.
    name : str
        Key of `kempf.schemas.nmea.SENTENCES`.
    """
    sentence = SENTENCES[name]
    fields = Fields(frames, record)
    said = Said(fields, np.zeros(record.size, dtype=np.int8))
    said.reason[_void(fields, sentence)] = CODE[Reason.VOID]
    for place, wanted in (sentence.carries or {}).items():
        said.reason[~fields.at(place).is_one_of(wanted)] = CODE[Reason.NO_CHANNEL]
    if name in SILENT:
        said.reason[:] = CODE[Reason.NO_CHANNEL]
    said.reason[fields.count < sentence.least] = CODE[Reason.MALFORMED]
    if name in _SPECIAL:
        _SPECIAL[name](said)
    for item in sentence.fields:
        value, there = _read_field(fields, item)
        if item.channel in said.values:
            first, was = said.values[item.channel]
            value, there = np.where(was, first, value), was | there
        said.values[item.channel] = (value, there)
    present = np.zeros(record.size, dtype=np.bool_)
    for _, there in said.values.values():
        present |= there
    said.reason[(said.reason == 0) & ~present] = CODE[Reason.VOID]
    return said


def _void(fields: Fields, sentence: Sentence) -> Flag:
    """Return which sentences say themselves that they are not valid; an older edition ends before the mark."""
    void = np.zeros(fields.record.size, dtype=np.bool_)
    for place, valid in (sentence.valid or {}).items():
        void |= ~fields.at(place).is_one_of(tuple(valid)) & (fields.count >= place)
    for place, measured in (sentence.modes or {}).items():
        void |= ~fields.at(place).is_one_of((*measured, ""))
    return void


def _read_field(fields: Fields, item: NmeaField) -> tuple[Float, Flag]:
    cells = fields.at(item.position)
    value = cells.number()
    if item.form != "number":
        # ddmm.mmm: whole degrees are the hundreds
        degrees = np.floor(value / 100.0)
        minutes = value - 100.0 * degrees
        value = np.where(minutes < 60.0, degrees + minutes / 60.0, np.nan)
    if item.letter is not None and item.factors is not None:
        factor = np.full(256, np.nan)
        for name, times in item.factors.items():
            factor[ord(name)] = times
        value = value * factor[fields.at(item.letter).letter()]
    with np.errstate(over="ignore"):  # beyond all numbers: refused as not finite
        return value * factor_to_si(item.unit, CHANNELS[item.channel].unit, item.channel), cells.there()


def east(letter: Cells) -> Float:
    """Return 1 for E, -1 for W, NaN for any other letter."""
    side = letter.letter()
    return np.where(side == ord("E"), 1.0, np.where(side == ord("W"), -1.0, np.nan))


def _read_magnetic(said: Said) -> None:
    """Read the magnetic heading with its deviation, east positive, rad; the variation is added later."""
    heading = said.fields.at(1)
    value = heading.number()
    if bool(np.any(said.fields.count >= 3)):
        deviation = said.fields.at(2)
        value = value + np.where(deviation.there(), deviation.number() * east(said.fields.at(3)), 0.0)
    said.values["heading"] = (value * _DEGREE, heading.there())


def _read_starboard(said: Said) -> None:
    """Read the rudder of a ship with one; `compass_and_rudder` looks for a second one."""
    angle, status = said.fields.at(1), said.fields.at(2)
    void = ~status.is_one_of(("A",)) & (said.fields.count >= 2)
    said.values["rudder_angle"] = (angle.number() * _DEGREE, angle.there() & ~void)


def _read_transducers(said: Said) -> None:
    """Read transducers, groups of type, value, unit, name; roll and pitch are angles (A) in degrees (D)."""
    fields, m = said.fields, said.record.size
    named = np.zeros(m, dtype=np.bool_)
    for channel in sorted(set(XDR_ANGLES.values())):
        said.values[channel] = (np.full(m, np.nan), np.zeros(m, dtype=np.bool_))
    for k in range(1, min(int(fields.count.max(initial=0)), 4 * _TRANSDUCERS), 4):
        angle = fields.at(k).is_one_of(("A",)) & fields.at(k + 2).is_one_of(("D",))
        if not angle.any():
            continue
        value, label = fields.at(k + 1), fields.at(k + 3)
        number, filled = value.number() * _DEGREE, value.there()
        for name, channel in XDR_ANGLES.items():
            labelled = angle & label.is_one_of((name,))
            named |= labelled
            labelled &= filled
            got, there = said.values[channel]
            got[labelled], there[labelled] = number[labelled], True
    said.reason[(said.reason == 0) & ~named] = CODE[Reason.NO_CHANNEL]


_SPECIAL: dict[str, Callable[[Said], None]] = {
    "HDG": _read_magnetic,
    "HDM": _read_magnetic,
    "RSA": _read_starboard,
    "XDR": _read_transducers,
}
