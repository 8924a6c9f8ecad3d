"""A ship on her course under one law or several: heading, its error in close-up, rudder, wind force as estimated."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from kempf.pipeline.steering.track import Track
from kempf.workbench.figures.drawn import pyplot, save

_COLOURS = ("tab:blue", "tab:red", "0.35", "tab:green")


def draw_course_keeping(tracks: Sequence[tuple[str, Track]], path: Path, title: str = "") -> None:
    """Draw the tracks of one ship in one weather under different laws.

    Parameters
    ----------
    tracks : sequence of (str, Track)
        What each is called, and the track; at most four.
    path : Path
        Ending ``.png``, ``.svg`` or ``.pdf``.
    title : str, optional
        Above the figure.
    """
    figure, axes = pyplot().subplots(4, 1, figsize=(10, 10), sharex=True, layout="constrained")
    heading, close, rudder, wind = axes
    first = tracks[0][1]
    start = first.course_rad[0]
    heading.plot(first.time_s, np.degrees(first.course_rad - start), color="black", lw=1.0, ls="--", label="ordered")
    wind.plot(first.time_s, 1e3 * first.truth[:, 7], color="black", lw=1.2, ls="--", label="true")
    for k, ((label, track), colour) in enumerate(zip(tracks, _COLOURS, strict=False)):
        # the first lies below the others, and good laws lie on each other
        style = {"color": colour, "lw": 2.6 if k == 0 else 1.0, "label": label}
        heading.plot(track.time_s, np.degrees(track.truth[:, 2] - start), **style)
        rudder.plot(track.time_s, np.degrees(track.truth[:, 6]), **style)
        wind.plot(track.time_s, 1e3 * track.estimate[:, 3], **style)
        close.plot(track.time_s, np.degrees(track.heading_error_rad), **style)
    for panel, text in (
        (heading, "heading from the course\nat the start, deg"),
        (close, "the same less the ordered\none, close up, deg"),
        (rudder, "rudder, deg"),
        (wind, "wind force as the law\nsees it, 1e-3 m/s²"),
    ):
        panel.set_ylabel(text)
        panel.grid(lw=0.3)
    straight = first.course_rad == start
    widest = max(float(np.percentile(np.abs(track.heading_error_rad[straight]), 99.0)) for _, track in tracks)
    close.set_ylim(-1.2 * np.degrees(widest), 1.2 * np.degrees(widest))
    # a law that lost the wind must not hide what the others did
    reach = 6.0 * max(1e-6, float(np.max(np.abs(1e3 * first.truth[:, 7]))))
    low, high = wind.get_ylim()
    wind.set_ylim(max(low, -reach), min(high, reach))
    handles, labels = heading.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=min(len(labels), 4), frameon=False, title=title)
    wind.set_xlabel("time, s")
    save(figure, path, 100)
