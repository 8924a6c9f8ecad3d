"""Shaded stretches of time behind a panel."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from kempf.pipeline.channels.series import Float, Mask
from kempf.workbench.web.draw.svg import element


def shades(time_s: Float, marked: Mask, left: float, per_second: float, top: float, height: float) -> list[Markup]:
    """Return rectangles over instants, one for those that follow each other.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
    marked : ndarray of bool, shape (n,)
    left, per_second, top, height : float
        Where the first instant is, how far a second reaches, and the panel, in units of the drawing.
    """
    # an instant reaches half way to the next ones
    half = 0.5 * float(np.median(np.diff(time_s))) if time_s.size > 1 else 0.5
    steps = np.diff(np.concatenate([[0], marked.astype(np.int8), [0]]))
    first, last = np.flatnonzero(steps > 0), np.flatnonzero(steps < 0) - 1
    return [
        element(
            "rect",
            x=left + per_second * max(float(time_s[a]) - half, float(time_s[0])),
            y=top,
            width=per_second * (float(time_s[b] - time_s[a]) + 2.0 * half),
            height=height,
            class_="shade",
        )
        for a, b in zip(first, last, strict=True)
    ]
