"""The unmodelled sway and yaw acceleration against lateral speed, yaw rate, rudder and heading."""

from __future__ import annotations

from typing import Any

import numpy as np

from kempf.schemas.diagnosis_evidence import UnmodelledAcceleration
from kempf.workbench.figures.diagnosis_style import FULL, INK, PLAIN, new_figure, style

#: sway in 1e-3 m/s^2, yaw in 1e-3 deg/s^2
_ROWS = (("sway", "sway,\n1e-3 m/s²", 1e3), ("yaw", "yaw,\n1e-3 deg/s²", 1e3 * np.degrees(1.0)))
_COLUMNS = {
    "lateral_speed": ("v, m/s", 1.0),
    "yaw_rate": ("r, deg/s", np.degrees(1.0)),
    "rudder": ("rudder, deg", np.degrees(1.0)),
    "heading": ("heading, deg", np.degrees(1.0)),
}


def draw_unmodelled(before: UnmodelledAcceleration, after: UnmodelledAcceleration | None, first: str, last: str) -> Any:
    """Draw the accelerations that act beside a model.

    Parameters
    ----------
    before, after : UnmodelledAcceleration
        Beside the first model and beside the last; None where they are the same.
    first, last : str
        What the two models are called.
    """
    shown = [(before, PLAIN, "o", first)] + ([(after, FULL, "s", last)] if after is not None else [])
    with style():
        figure = new_figure(4.4)
        panels = figure.subplots(2, len(_COLUMNS), sharey="row", sharex="col", squeeze=False)
        for row, (name, words, factor) in zip(panels, _ROWS, strict=True):
            row[0].set_ylabel(words)
            for panel, (quantity, (_, scale)) in zip(row, _COLUMNS.items(), strict=True):
                panel.axhline(0.0, color=INK, lw=0.6)
                for acceleration, colour, marker, label in shown:
                    part = getattr(acceleration, name)
                    x, y = scale * acceleration.against[quantity], factor * part.values
                    panel.plot(x, y, ".", ms=1.4, mec="none", color=colour, alpha=0.3, rasterized=True)
                    bins = part.against[quantity]
                    low, high = bins.median - bins.low, bins.high - bins.median
                    panel.errorbar(
                        *(scale * bins.middle, factor * bins.median, (factor * low, factor * high)),
                        fmt=marker,
                        ms=3.5,
                        color=colour,
                        lw=1,
                        capsize=1.5,
                        label=label,
                    )
        for panel, (words, _) in zip(panels[-1], _COLUMNS.values(), strict=True):
            panel.set_xlabel(words)
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=2)
        return figure


def describe_unmodelled(
    before: UnmodelledAcceleration, after: UnmodelledAcceleration | None, first: str, last: str
) -> str:
    """Return the figure in words.

    Parameters
    ----------
    first, last : str
        What the two models are called.
    """
    shown = [(before, first)] + ([(after, last)] if after is not None else [])
    if not all(acceleration.sway.values.size for acceleration, _ in shown):
        return "Unmodelled sway and yaw acceleration: the free run of a model diverges, and none can be computed."
    sizes = ", ".join(f"{1e3 * acceleration.sway.std:.2f} beside the {name}" for acceleration, name in shown)
    return (
        "Unmodelled sway and yaw acceleration, given all measurements of each manoeuvre, against lateral speed, yaw "
        f"rate, rudder and heading. Standard deviation of the sway part, 10⁻³ m/s²: {sizes}."
    )
