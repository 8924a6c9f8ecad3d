"""Elapsed or epoch times written as decimal numbers, to nanoseconds without rounding through a float."""

from __future__ import annotations

from decimal import ROUND_HALF_EVEN, Decimal, InvalidOperation

import numpy as np
import polars as pl
from numpy.typing import NDArray

#: Decimal places of one nanosecond in each unit.
_PLACES = {"s": 9, "ms": 6, "us": 3, "ns": 0}

#: Largest count of nanoseconds that is taken for a time, about 290 years.
_LARGEST = 9_200_000_000_000_000_000


def to_ns(text: pl.Series, unit: str) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Convert decimal text in ``unit`` to nanoseconds.

    Parameters
    ----------
    text : polars.Series of String, shape (n,)
        Such as ``.050000000`` or ``1.714e9``; without blanks around it.
    unit : {"s", "ms", "us", "ns"}

    Returns
    -------
    ns : ndarray of int64, shape (n,)
        Rounded to the nearest nanosecond, half to even; zero where the text is no number.
    good : ndarray of bool, shape (n,)
    """
    places = _PLACES[unit]
    frame = text.fill_null("").alias("text").to_frame()
    plain = (
        frame.lazy()
        .with_columns(
            plain=pl.col("text").str.contains(r"^[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)$"),
            negative=pl.col("text").str.starts_with("-"),
            whole=pl.col("text").str.extract(r"^[+-]?([0-9]*)", 1).fill_null(""),
            part=pl.col("text").str.extract(r"\.([0-9]*)$", 1).fill_null(""),
        )
        .with_columns(
            # more digits than a nanosecond, or than an integer holds, go the slow and exact way
            plain=pl.col("plain")
            & (pl.col("part").str.slice(places).str.strip_chars("0") == "")
            & (pl.col("whole").str.len_bytes() <= 18 - places),
        )
        .with_columns(digits=pl.col("whole") + pl.col("part").str.slice(0, places).str.pad_end(places, "0"))
        .with_columns(ns=pl.col("digits").cast(pl.Int64, strict=False).fill_null(0))
        .with_columns(ns=pl.when("negative").then(-pl.col("ns")).otherwise("ns"))
        .select("text", "plain", "ns")
        .collect(engine="in-memory")
    )
    ns = plain["ns"].to_numpy().astype(np.int64)
    good = plain["plain"].to_numpy().copy()
    for i in np.flatnonzero(~good):
        exact = _exact(plain["text"][int(i)], places)
        good[i] = exact is not None
        ns[i] = exact or 0
    return np.where(good, ns, 0), good


def _exact(text: str, places: int) -> int | None:
    try:
        number = Decimal(text)
        if not text.isascii() or not number.is_finite() or "_" in text or number.adjusted() > 20:
            return None
        ns = int(number.scaleb(places).to_integral_value(rounding=ROUND_HALF_EVEN))
    except (InvalidOperation, ValueError):
        return None
    return ns if abs(ns) < _LARGEST else None
