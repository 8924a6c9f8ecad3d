"""What NMEA sentences say: fields by the table in `schemas.nmea`, in columns, one sentence type at a time.

When they say it is settled in `nmea_clock`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import polars as pl
from numpy.typing import NDArray

from pipeline.ingest.decoded import CODE, Float
from pipeline.ingest.nmea_frames import Frames
from pipeline.ingest.numerals import number
from pipeline.ingest.readings import Reason
from pipeline.ingest.spans import Index, Spans
from schemas.channels import CHANNELS
from schemas.nmea import SENTENCES, SPECIAL, XDR_ANGLES, NmeaField, Sentence
from schemas.units import factor_to_si

#: Most fields that are read of a sentence: XDR may hold ten transducers of four fields.
_MOST = 40


@dataclass(frozen=True, eq=False)
class Said:
    """What the sentences of one type say.

    Attributes
    ----------
    record : ndarray of int64, shape (m,)
        Their records, ascending.
    text : polars.DataFrame, shape (m, fields)
        Fields ``f1``, ``f2`` ...; null where empty or absent.
    reason : ndarray of int8, shape (m,)
        Code of the refusal, 0 for none.
    values : dict of str to (ndarray, ndarray)
        Channel -> value in SI (NaN where the text is no number) and whether it is there, each shape (m,).
    """

    record: Index
    text: pl.DataFrame
    reason: NDArray[np.int8]
    values: dict[str, tuple[Float, NDArray[np.bool_]]] = field(default_factory=dict)


def read_type(frames: Frames, separated: Spans, record: Index, name: str) -> Said:
    """Read the sentences of one type.

    Parameters
    ----------
    frames : Frames
    separated : Spans
        The bodies over a buffer in which a line feed stands behind each, and nothing that is not printable within.
    record : ndarray of int64, shape (m,)
        Records of the sentences, ascending; whole, with the right checksum.
    name : str
        Key of `schemas.nmea.SENTENCES`.

    Returns
    -------
    Said
    """
    sentence = SENTENCES[name]
    commas = frames.commas[record]
    width = min(int(commas.max(initial=0)), _MOST) if name == "XDR" else _width(sentence)
    text = _split(separated.take(record), max(width, sentence.least))
    reason = np.zeros(record.size, dtype=np.int8)
    for place, valid in (sentence.valid or {}).items():
        mark = text[f"f{place}"].fill_null("")
        # a sentence of an older edition ends before the mark
        reason[(~mark.is_in(list(valid))).to_numpy() & (commas >= place)] = CODE[Reason.VOID]
    for place, wanted in (sentence.carries or {}).items():
        reason[(~text[f"f{place}"].fill_null("").is_in(list(wanted))).to_numpy()] = CODE[Reason.NO_CHANNEL]
    if name == "ZDA":
        reason[:] = CODE[Reason.NO_CHANNEL]
    reason[commas < sentence.least] = CODE[Reason.MALFORMED]
    said = Said(record, text, reason)
    if name in SPECIAL:
        {"HDG": _read_hdg, "XDR": _read_xdr}[name](said)
    for item in sentence.fields:
        said.values[item.channel] = _read_field(text, item)
    present = np.zeros(record.size, dtype=np.bool_)
    for _, there in said.values.values():
        present |= there
    reason[(reason == 0) & ~present] = CODE[Reason.VOID]
    return said


def _width(sentence: Sentence) -> int:
    places = [p for f in sentence.fields for p in (f.position, f.letter or 0)]
    places += [sentence.utc or 0, sentence.date or 0, 4 if sentence.name == "ZDA" else 0]
    return max([sentence.least, *places, *(sentence.valid or {}), *(sentence.carries or {})])


def _split(body: Spans, width: int) -> pl.DataFrame:
    """Split the sentences at their commas; the address is left out."""
    names = [f"f{k}" for k in range(width + 1)]
    # the first line makes the reader take the full width; it is dropped again
    head = b"," * width + b"\n"
    table = pl.read_csv(
        head + body.joined(extra=1).tobytes(),
        has_header=False,
        schema=dict.fromkeys(names, pl.String),
        quote_char=None,
        truncate_ragged_lines=True,
    )
    clean = [pl.col(c).str.strip_chars().replace("", None) for c in names[1:]]
    return table.slice(1).select(clean)


def _read_field(text: pl.DataFrame, item: NmeaField) -> tuple[Float, NDArray[np.bool_]]:
    column = text[f"f{item.position}"]
    value = number(column)
    if item.form != "number":
        # ddmm.mmm: whole degrees are the hundreds
        degrees = np.floor(value / 100.0)
        minutes = value - 100.0 * degrees
        value = np.where(minutes < 60.0, degrees + minutes / 60.0, np.nan)
    if item.letter is not None and item.factors is not None:
        letter = text[f"f{item.letter}"].fill_null("")
        factor = np.full(len(letter), np.nan)
        for name, times in item.factors.items():
            factor[(letter == name).to_numpy()] = times
        value = value * factor
    value = value * factor_to_si(item.unit, CHANNELS[item.channel].unit, item.channel)
    return value, column.is_not_null().to_numpy()


def _read_hdg(said: Said) -> None:
    """Magnetic heading plus deviation plus variation, east positive; without variation it is no true heading."""
    text = said.text
    heading, variation = number(text["f1"]), number(text["f4"])
    deviation = np.where(text["f2"].is_null().to_numpy(), 0.0, number(text["f2"]) * _east(text["f3"]))
    true = np.mod(heading + deviation + variation * _east(text["f5"]), 360.0) * (np.pi / 180.0)
    said.values["heading"] = (true, text["f1"].is_not_null().to_numpy())
    magnetic = text["f4"].is_null().to_numpy() & text["f1"].is_not_null().to_numpy()
    said.reason[(said.reason == 0) & magnetic] = CODE[Reason.NO_CHANNEL]


def _east(letter: pl.Series) -> Float:
    side = letter.fill_null("")
    return np.where((side == "E").to_numpy(), 1.0, np.where((side == "W").to_numpy(), -1.0, np.nan))


def _read_xdr(said: Said) -> None:
    """Transducers in groups of type, value, unit, name; roll and pitch are angles (A) in degrees (D)."""
    text, m = said.text, said.record.size
    named = np.zeros(m, dtype=np.bool_)
    for channel in sorted(set(XDR_ANGLES.values())):
        said.values[channel] = (np.full(m, np.nan), np.zeros(m, dtype=np.bool_))
    for k in range(1, text.width - 2, 4):
        kind, value, unit, name = (text[f"f{k + j}"].fill_null("") for j in range(4))
        angle = ((kind == "A") & (unit == "D")).to_numpy()
        for label, channel in XDR_ANGLES.items():
            mine = angle & (name == label).to_numpy()
            named |= mine
            mine &= (value != "").to_numpy()
            got, there = said.values[channel]
            got[mine], there[mine] = number(value)[mine] * (np.pi / 180.0), True
    said.reason[(said.reason == 0) & ~named] = CODE[Reason.NO_CHANNEL]
