"""Numbers and words read eight bytes at a time: the same bits as the reading of text one by one."""

import numpy as np
import polars as pl
from hypothesis import given, settings
from hypothesis import strategies as st

from kempf.pipeline.ingest.text.cells import Cells, leading_digits, number, words

plain = st.decimals(allow_nan=False, allow_infinity=False, places=8, min_value=-(10**9), max_value=10**9).map(str)
short = st.from_regex(r"\A[-+]?[0-9]{0,10}\.?[0-9]{0,10}\Z")
odd = st.text(alphabet="0123456789.-+eE naif_/:\xe9\u0663", max_size=14)
texts = st.lists(st.one_of(plain, short, odd), max_size=25)


def cells_of(items):
    joined = ",".join(items).encode()
    buffer = np.frombuffer(joined, dtype=np.uint8)
    stop = np.cumsum([len(item.encode()) + 1 for item in items], dtype=np.int64) - 1
    start = np.concatenate(([0], stop[:-1] + 1)).astype(np.int64) if len(items) else stop
    return Cells.of(buffer, start, stop)


@settings(max_examples=40, deadline=None)
@given(texts)
def test_numbers_have_the_bits_of_the_reading_one_by_one(items):
    mine = cells_of(items).number()
    theirs = number(pl.Series(items, dtype=pl.String).str.strip_chars(" \t\r\n\v\f"))
    assert np.array_equal(np.isnan(mine), np.isnan(theirs))
    good = ~np.isnan(mine)
    assert np.array_equal(mine[good].view(np.uint64), theirs[good].view(np.uint64))


@settings(max_examples=50, deadline=None)
@given(st.binary(max_size=100))
def test_words_are_eight_bytes_with_zeros_beyond_the_ends(data):
    place = np.arange(-8, len(data) + 1)
    padded = bytes(8) + data + bytes(8)
    expected = [int.from_bytes(padded[k : k + 8], "little") for k in range(len(data) + 9)]
    assert words(np.frombuffer(data, dtype=np.uint8), place).tolist() == expected


@settings(max_examples=100, deadline=None)
@given(st.binary(min_size=8, max_size=8))
def test_leading_digits(data):
    count = next((k for k, byte in enumerate(data) if not 48 <= byte <= 57), 8)
    assert leading_digits(np.frombuffer(data, dtype="<u8").astype(np.uint64)).tolist() == [count]


def test_words_are_compared_whole():
    cells = cells_of(["A", "", "AB", "ROLL", "ROLLROLLROLL", "\xff\xff\xff\xff", " A "])
    assert cells.is_one_of(("A", "ROLL")).tolist() == [True, False, False, True, False, False, True]
    assert cells.is_one_of(("",)).tolist() == [False, True, False, False, False, False, False]
