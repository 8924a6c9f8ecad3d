"""What a model leaves of a manoeuvre, as a strip: measured less predicted over time, the same scale for all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float, Mask
from kempf.schemas.enumeration import as_words
from kempf.schemas.motion_channel import MOTION
from kempf.schemas.units import SECOND_NS
from kempf.workbench.web.draw.shades import shades
from kempf.workbench.web.draw.svg import element

_WIDTH, _HEIGHT, _POINTS = 320.0, 36.0, 100


@dataclass(frozen=True)
class Strips:
    """The strips of several manoeuvres."""

    #: By manoeuvre.
    drawn: dict[str, Markup]
    #: What their height is, both ways.
    reach: float
    unit: str


def draw_strips(
    columns: Mapping[str, Mapping[str, Float]], channel: str, marked: Mapping[str, Mask | None]
) -> Strips | None:
    """Return the strips of some manoeuvres; None where the channel was measured in none of them.

    Parameters
    ----------
    columns : mapping
        By manoeuvre and column, see `kempf.pipeline.compare.run_series.run_series`.
    channel : str
        Such as ``yaw_rate``.
    marked : mapping
        By manoeuvre the instants that are shaded, shape (n,).
    """
    of, (unit, factor) = MOTION[channel].suffix, MOTION[channel].shown
    left = {name: factor * (run[f"{channel}_{of}"] - run[f"{channel}_predicted_{of}"]) for name, run in columns.items()}
    known = [np.abs(values[np.isfinite(values)]) for values in left.values()]
    reach = float(max((np.max(values) for values in known if values.size), default=0.0))
    if not reach > 0.0:
        return None
    drawn = {name: _strip(columns[name], left[name], reach, marked.get(name), channel) for name in columns}
    return Strips(drawn, reach, unit)


def _strip(columns: Mapping[str, Float], left: Float, reach: float, marked: Mask | None, channel: str) -> Markup:
    time_s = (columns["time_utc_ns"] - columns["time_utc_ns"][0]).astype(np.float64) / SECOND_NS
    scale, middle = _WIDTH / max(float(time_s[-1]), 1e-9), 0.5 * _HEIGHT
    at = _extremes(left)
    places = zip((scale * time_s[at]).tolist(), (middle - (middle - 1.0) * left[at] / reach).tolist(), strict=True)
    path = "M" + " ".join(f"{a:.0f} {b:.1f}" for a, b in places) if at.size else ""
    size = float(np.sqrt(np.mean(left[np.isfinite(left)] ** 2))) if at.size else 0.0
    return element(
        "svg",
        element("title", f"What is left of {as_words(channel)}: rms {size:.3g}"),
        *(() if marked is None else shades(time_s, marked, 0.0, scale, 0.0, _HEIGHT)),
        element("line", x1=0.0, x2=_WIDTH, y1=middle, y2=middle, class_="grid"),
        element("path", d=path, fill="none", class_="line-left"),
        viewBox=f"0 0 {_WIDTH:g} {_HEIGHT:g}",
        role="img",
        class_="drawing strip",
        xmlns="http://www.w3.org/2000/svg",
    )


def _extremes(values: Float) -> NDArray[np.intp]:
    """Return the smallest and the largest of each stretch in order of time: a peak is not lost."""
    known = np.flatnonzero(np.isfinite(values))
    if known.size <= _POINTS:
        return known
    parts = np.array_split(known, _POINTS // 2)
    pairs = [sorted((part[np.argmin(values[part])], part[np.argmax(values[part])])) for part in parts]
    result: NDArray[np.intp] = np.unique(np.concatenate(pairs))
    return result
