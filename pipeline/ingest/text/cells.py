"""Short texts within one byte buffer read as numbers, words and digits: eight bytes of every text at a time.

A text of up to eight characters is one 64-bit word, so a whole column is checked and converted by a few operations on
arrays of words. What is too long or too odd for that goes the way of `number`, which decides what a number is; both
ways give the same bits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl
from numpy.typing import NDArray

from kempf.pipeline.ingest.decoded import Flag, Float
from kempf.pipeline.ingest.spans import Bytes, Index, Spans, is_blank, trimmed

Word = NDArray[np.uint64]

_ONES = 0x0101010101010101
_ZEROS = np.uint64(ord("0") * _ONES)
_POINTS = np.uint64(ord(".") * _ONES)
_TOPS = np.uint64(0x80 * _ONES)
_LOWS = np.uint64(0x7F * _ONES)
#: added to a byte it sets the top bit of what lies above "9"
_ABOVE = np.uint64((0x7F - ord("9")) * _ONES)
_PAIRS = np.uint64(0x000000FF000000FF)

#: Word that keeps the last k bytes of eight, k = 0 ... 8.
_KEEP = np.array([0] + [((1 << 8 * k) - 1) << 8 * (8 - k) for k in range(1, 9)], dtype=np.uint64)
POWERS_OF_TEN = 10 ** np.arange(10, dtype=np.int64)

#: Integers up to here are exact as floats, so that one division by a power of ten rounds once, as the reading of
#: decimal text does.
_EXACT = 1 << 53

#: Longest text that can be a number, characters: the shortest form of any float is far below.
_LONGEST = 400

#: Stands for a text of more than eight characters where texts are compared as words.
LONG = np.uint64(0xFFFFFFFFFFFFFFFF)


def words(buffer: Bytes, place: Index) -> Word:
    """Return eight bytes from each place on, the first in the lowest byte; zeros beyond the ends of the buffer.

    Parameters
    ----------
    place : ndarray of int64, shape (n,)
        From -8 up to the size of the buffer.

    Returns
    -------
    ndarray of uint64, shape (n,)
    """
    if place.size == 0:
        return np.empty(0, dtype=np.uint64)
    low, high = int(place.min()), int(place.max())
    if low < 0 or high > buffer.size - 8:
        if low < 0 or buffer.size < 64:
            buffer, place = np.concatenate((np.zeros(8, np.uint8), buffer, np.zeros(8, np.uint8))), place + 8
        else:
            # only the last few reach beyond the end
            word = words(buffer, np.minimum(place, buffer.size - 8))
            beyond = np.maximum(place - (buffer.size - 8), 0)
            return np.where(beyond < 8, word >> (8 * np.minimum(beyond, 7)).astype(np.uint64), np.uint64(0))
    view: Word = np.ndarray((buffer.size - 7,), dtype="<u8", buffer=np.ascontiguousarray(buffer), strides=(1,))
    return view[place].astype(np.uint64, copy=False)


def all_digits(word: Word) -> Flag:
    """Return which words hold eight decimal digits."""
    good: Flag = (((word + _ABOVE) | (word - _ZEROS)) & _TOPS) == 0
    return good


def eight_digits(word: Word) -> NDArray[np.int64]:
    """Return the value of eight decimal digits, the first in the lowest byte."""
    word = word - _ZEROS
    word = word * np.uint64(10) + (word >> np.uint64(8))
    high = (word & _PAIRS) * np.uint64(100 + (1_000_000 << 32))
    low = ((word >> np.uint64(16)) & _PAIRS) * np.uint64(1 + (10_000 << 32))
    return ((high + low) >> np.uint64(32)).astype(np.int64)


def _last_digits(word: Word, count: Index) -> Word:
    """Keep the last ``count`` bytes of each word and put the digit zero in front of them."""
    keep = _KEEP[count]
    return (word & keep) | (_ZEROS & ~keep)


def first_digits(word: Word, count: Index) -> Word:
    """Move the first ``count`` bytes of each word to its end and put the digit zero in front of them."""
    # a shift by 64 bits is undefined: no byte at all is asked for by way of one
    shift = (8 * (8 - np.maximum(count, 1))).astype(np.uint64)
    return _last_digits(word << shift, count)


def leading_digits(word: Word) -> Index:
    """Return how many digits each word begins with."""
    other = (((word & _LOWS) + _ABOVE) | ((word | _TOPS) - _ZEROS) ^ _TOPS | word) & _TOPS
    return (np.bitwise_count((other & -other) - np.uint64(1)) >> 3).astype(np.int64)


@dataclass(frozen=True, eq=False)
class Cells:
    """Texts within a buffer, without blanks at either end; in any order."""

    buffer: Bytes
    #: start, stop: Shape (n,).
    start: Index
    stop: Index

    @classmethod
    def of(cls, buffer: Bytes, start: Index, stop: Index) -> Cells:
        """Return the texts between the places without the blanks at their ends."""
        there = stop > start
        if buffer.size:
            last = buffer.size - 1
            first, final = buffer[np.minimum(start, last)], buffer[np.maximum(stop - 1, 0)]
            # every blank is a space or below it
            at = np.flatnonzero((np.minimum(first, final) <= ord(" ")) & there)
            at = at[is_blank(first[at]) | is_blank(final[at])]
            if at.size:
                slim = trimmed(Spans(buffer, start[at], stop[at]))
                start, stop = start.copy(), stop.copy()
                start[at], stop[at] = slim.start, slim.stop
        return cls(buffer, start, stop)

    def there(self) -> Flag:
        """Return which are not empty."""
        filled: Flag = self.stop > self.start
        return filled

    def letter(self) -> Bytes:
        """Return the one character of each text; 0 for an empty text, 255 for a longer one."""
        length = self.stop - self.start
        if self.buffer.size == 0:
            return np.zeros(length.shape, dtype=np.uint8)
        letter = self.buffer[np.minimum(self.start, self.buffer.size - 1)]
        letter[length != 1] = 255
        letter[length == 0] = 0
        return letter

    def word(self) -> Word:
        """Return each text as a word, see `as_word`; `LONG` for one of more than eight characters."""
        length = self.stop - self.start
        # a shift by 64 bits is undefined
        shift = (8 * (8 - np.clip(length, 1, 8))).astype(np.uint64)
        word = (words(self.buffer, self.start) << shift) >> shift
        return np.where(length > 8, LONG, np.where(length > 0, word, np.uint64(0)))

    def is_one_of(self, texts: tuple[str, ...] | frozenset[str]) -> Flag:
        """Return which texts are one of some short ones."""
        if max(map(len, texts), default=0) <= 1:
            among = np.zeros(256, dtype=np.bool_)
            among[[ord(text) if text else 0 for text in texts]] = True
            return among[self.letter()]
        word = self.word()
        matches = np.zeros(word.shape, dtype=np.bool_)
        for text in sorted(texts):
            matches |= word == as_word(text)
        return matches

    def integer(self) -> tuple[NDArray[np.int64], Flag]:
        """Return each text of one to sixteen digits as an integer, zero for any other, and which are such."""
        length = self.stop - self.start
        good = (length >= 1) & (length <= 16)
        length = np.where(good, length, 0)
        stop = np.where(good, self.stop, 0)
        late = _last_digits(words(self.buffer, stop - 8), np.minimum(length, 8))
        early = _last_digits(words(self.buffer, np.maximum(stop - 16, -8)), np.maximum(length - 8, 0))
        good &= all_digits(late) & all_digits(early)
        return np.where(good, eight_digits(early) * 100_000_000 + eight_digits(late), 0), good

    def number(self) -> Float:
        """Return each text as a number; NaN where it is none.

        Returns
        -------
        ndarray of float64, shape (n,)
            The bits that `number` gives.
        """
        buffer, stop, length = self.buffer, self.stop, self.stop - self.start
        if buffer.size == 0 or length.size == 0:
            return np.full(length.shape, np.nan)
        lead = buffer[np.minimum(self.start, buffer.size - 1)]
        negative = lead == ord("-")
        start = self.start + (negative & (length > 0))
        tail = words(buffer, stop - 8)
        # a byte's top bit is set exactly where the byte is a point
        points = tail ^ _POINTS
        points = ~(((points & _LOWS) + _LOWS) | points | _LOWS) & _KEEP[np.clip(stop - start, 0, 8)]
        single = np.bitwise_count(points) <= 1
        behind = 7 - (np.bitwise_count(points - np.uint64(1)) >> 3).astype(np.int64)
        # of nine characters the first may be the point: eight decimals
        eighth = (behind < 0) & (stop - start >= 9) & (buffer[np.maximum(stop - 9, 0)] == ord("."))
        behind[eighth] = 8
        decimals = np.maximum(behind, 0)
        whole_stop = stop - decimals - (behind >= 0)
        digits = whole_stop - start
        good = single & (digits >= 1) & (digits <= 8) & (behind != 0)
        whole = _last_digits(words(buffer, whole_stop - 8), np.clip(digits, 0, 8))
        part = _last_digits(tail, decimals)
        good &= all_digits(whole) & all_digits(part)
        digits_value = eight_digits(whole) * POWERS_OF_TEN[decimals] + eight_digits(part)
        good &= digits_value <= _EXACT
        value: Float = digits_value / POWERS_OF_TEN.astype(np.float64)[decimals]
        value = np.where(negative, -value, value)
        value[~good] = np.nan
        rest = np.flatnonzero(~good & (length > 0) & (length <= _LONGEST))
        if rest.size:
            odd = Spans(buffer, self.start[rest], stop[rest])
            value[rest] = _one_by_one(odd)
        return value


#: A number with a comma before its decimals, as a regular expression: what is before the comma, and what is behind it.
DECIMAL_COMMA = r"^([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)$"


def number(text: pl.Series) -> Float:
    """Convert decimal text to numbers.

    Parameters
    ----------
    text : polars.Series of String, shape (n,)
        With a decimal point, never a comma, and without blanks around it.

    Returns
    -------
    ndarray of float64, shape (n,)
        NaN where the text is null or no finite number.
    """
    value = text.cast(pl.Float64, strict=False).fill_null(float("nan")).to_numpy().copy()
    value[~np.isfinite(value)] = np.nan
    return value


def as_word(text: str) -> np.uint64:
    """Return a text of at most eight characters as a word: its first character in the lowest byte.

    Examples
    --------
    >>> int(as_word("A")), int(as_word("AB"))
    (65, 16961)
    """
    return np.uint64(int.from_bytes(text.encode("ascii"), "little"))


def _one_by_one(odd: Spans) -> Float:
    """Read what is no plain decimal number; the stretches may stand in any order."""
    order = np.argsort(odd.start, kind="stable")
    value = np.empty(order.size)
    value[order] = number(odd.take(order).text(limit=_LONGEST))
    return value
