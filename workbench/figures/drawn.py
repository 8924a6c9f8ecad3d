"""Figures drawn with pyplot, without a window, and written so that equal figures are equal bytes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

_METADATA = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}


def pyplot() -> Any:
    """Return pyplot, which opens no window."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    return plt


def save(figure: Any, path: Path, dpi: int) -> None:
    """Write a figure to a file that ends in .png, .svg or .pdf, and close it."""
    import matplotlib as mpl

    with mpl.rc_context({"svg.hashsalt": "kempf"}):
        figure.savefig(path, dpi=dpi, metadata=_METADATA.get(path.suffix))
    pyplot().close(figure)
