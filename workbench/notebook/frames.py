"""Polars frames for a notebook, and a result as the HTML that a notebook shows."""

from __future__ import annotations

import html
from base64 import b64encode
from collections.abc import Mapping, Sequence
from typing import Any

import polars as pl

_NANOSECONDS = "_utc_ns"
_INSTANT = pl.Datetime("ns", "UTC")


def with_instants(frame: pl.DataFrame) -> pl.DataFrame:
    """Return a frame whose columns ``x_utc_ns`` (whole nanoseconds) are instants ``x_utc``, datetime[ns, UTC]."""
    counted = [name for name in frame.columns if name.endswith(_NANOSECONDS)]
    return frame.with_columns(pl.col(counted).cast(_INSTANT)).rename({n: n.removesuffix("_ns") for n in counted})


def frame_of(rows: Sequence[Mapping[str, Any]], columns: Mapping[str, Any]) -> pl.DataFrame:
    """Return some columns of rows as a frame, with the types given, also where there is no row."""
    return with_instants(pl.DataFrame({name: [row.get(name) for row in rows] for name in columns}, dict(columns)))


def as_html(title: str, sentences: Sequence[str], frames: Sequence[pl.DataFrame], picture: bytes | None = None) -> str:
    """Return a result as HTML: title, sentences, picture (PNG), tables."""
    drawn = ""
    if picture is not None:
        data = b64encode(picture).decode("ascii")
        drawn = f'<img alt="{html.escape(title)}" src="data:image/png;base64,{data}"/>'
    paragraphs = "".join(f"<p>{html.escape(sentence)}</p>" for sentence in sentences)
    tables = "".join(frame._repr_html_() for frame in frames)
    return f"<figure><figcaption>{html.escape(title)}</figcaption>{drawn}</figure>{paragraphs}{tables}"
