"""Series as one binary answer: a line of JSON, then for each series its seconds and its values.

The header is ASCII JSON, ended by a line feed and filled up with blanks so that the numbers begin at a multiple of four
bytes. Numbers are little-endian float32, for each series in the header's order first all seconds after the window's
beginning, then all values.
"""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

from kempf.workbench.charts.bins import Shown


def encoded(start_utc_ns: int, end_utc_ns: int, shown: Mapping[str, Shown]) -> bytes:
    """Return the answer for a window.

    Parameters
    ----------
    start_utc_ns, end_utc_ns : int
        The window, UTC nanoseconds.
    shown : mapping of str to Shown
        By channel.
    """
    series = [{"name": n, "count": s.time_s.size, "total": s.total, "drawn": s.drawn} for n, s in shown.items()]
    # as text: JavaScript's numbers cannot hold nanoseconds
    head = json.dumps({"from_utc_ns": str(start_utc_ns), "to_utc_ns": str(end_utc_ns), "series": series})
    padded = head + " " * (-(len(head) + 1) % 4) + "\n"
    parts = [
        np.asarray(part, dtype="<f4").tobytes()
        for channel in shown.values()
        for part in (channel.time_s, channel.value)
    ]
    return padded.encode("ascii") + b"".join(parts)
