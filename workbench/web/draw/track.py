"""The track of a log in metres, north up."""

from __future__ import annotations

from collections.abc import Sequence
from math import log10

import numpy as np
from markupsafe import Markup

from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.positions import plane
from kempf.pipeline.channels.series import Float, wrapped
from kempf.workbench.web.draw.svg import drawing, element

_WIDTH, _HEIGHT, _EDGE = 640.0, 420.0, 24.0
#: points of a line that a figure of this size can tell apart
_POINTS = 1500


def draw_track(channels: Instruments, manoeuvres: Sequence[tuple[int, int]]) -> Markup | None:
    """Return the track, its manoeuvres drawn thicker; None for a log without positions.

    Parameters
    ----------
    manoeuvres : sequence of (int, int)
        Their ends, UTC nanoseconds.
    """
    latitude, longitude = channels.get("latitude"), channels.get("longitude")
    if latitude is None or longitude is None or len(latitude) < 2 or len(latitude) != len(longitude):
        return None
    # the shorter way round, so that a track across 180 deg holds together
    north, east = plane(latitude.value, wrapped(longitude.value - longitude.value[0]))
    scale = min(
        (_WIDTH - 2 * _EDGE) / max(float(np.ptp(east)), 1.0), (_HEIGHT - 2 * _EDGE) / max(float(np.ptp(north)), 1.0)
    )
    x = _EDGE + (east - east.min()) * scale
    y = _HEIGHT - _EDGE - (north - north.min()) * scale
    thick = []
    for start, end in manoeuvres:
        first, last = np.searchsorted(latitude.time_utc_ns, [start, end])
        if last - first > 1:
            thick.append(_line(x[first:last], y[first:last], "track-manoeuvre"))
    begin = element("circle", cx=float(x[0]), cy=float(y[0]), r=4, class_="track-start")
    return drawing(
        _WIDTH, _HEIGHT, "Track, north up", _line(x, y, "track"), *thick, begin, *_bar(scale), *_north(), kind="map"
    )


def _line(x: Float, y: Float, kind: str) -> Markup:
    step = max(1, x.size // _POINTS)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x[::step].tolist(), y[::step].tolist(), strict=True))
    return element("polyline", points=points, fill="none", class_=kind)


def _bar(scale: float) -> list[Markup]:
    """Draw a scale: one, two or five times a power of ten, at most a quarter of the width."""
    most = _WIDTH / 4.0 / scale
    ten = 10.0 ** int(np.floor(log10(most)))
    length = max(step * ten for step in (1.0, 2.0, 5.0) if step * ten <= most)
    x, y = _EDGE, _HEIGHT - 8.0
    return [
        element("line", x1=x, x2=x + length * scale, y1=y, y2=y, class_="axis"),
        element("text", f"{length:g} m", x=x + length * scale + 6.0, y=y + 4.0, class_="label"),
    ]


def _north() -> list[Markup]:
    x = _WIDTH - 20.0
    return [
        element("path", d=f"M{x} 36 V14 m-5 8 l5 -8 l5 8", fill="none", class_="axis"),
        element("text", "N", x=x, y=50, text_anchor="middle", class_="label"),
    ]
