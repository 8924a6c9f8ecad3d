"""The figures of the last run of `fleet`, as they are stored."""

from __future__ import annotations

import json
from typing import Any

from benchmarks import result_page

FIGURES = result_page.RESULTS / "fleet.json"
#: What the pages are made from.
_KEYS = (
    "vessels",
    "logs",
    "cores",
    "steps",
    "whole",
    "again",
    "one",
    "subset",
    "pairs",
    "dask_s",
    "dask_of",
    "commits",
    "bytes",
)

Figures = dict[str, Any]


class OldFigures(ValueError):
    """The stored figures are of a run that did not measure what the pages say now."""


def store(figures: Figures) -> None:
    """Keep the figures of a run."""
    FIGURES.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


def stored() -> Figures:
    """Return the figures of the last run.

    Raises
    ------
    OldFigures
        There are none, or not all that the pages want.
    """
    found: Figures = json.loads(FIGURES.read_text(encoding="utf-8")) if FIGURES.is_file() else {}
    missing = [key for key in _KEYS if key not in found]
    if missing:
        raise OldFigures(
            f"{FIGURES.name} lacks {', '.join(missing)}: measure anew by `python -m benchmarks.fleet.fleet`."
        )
    return found
