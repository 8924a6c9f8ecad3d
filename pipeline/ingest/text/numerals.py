"""Decimal text to numbers, the one way for every format."""

from __future__ import annotations

import numpy as np
import polars as pl

from kempf.pipeline.ingest.decoded import Float


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
