"""A predicted manoeuvre: what the ship of the estimates does, over what all ships do that the data allow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from kempf.pipeline.manoeuvre.prediction import Prediction
from kempf.pipeline.manoeuvre.spiral import PredictedSpiral
from kempf.pipeline.manoeuvre.turning_circle import PredictedCircle
from kempf.pipeline.manoeuvre.zigzag import PredictedZigzag
from kempf.workbench.figures.diagnosis_style import FAINT, FULL, INK, LIMIT, new_figure, style
from kempf.workbench.figures.drawn import save

#: so many of the ships are drawn one by one
_SHIPS = 96


def draw_manoeuvre(prediction: Prediction, path: Path, title: str = "") -> None:
    """Draw a prediction.

    Parameters
    ----------
    path : Path
        Ending ``.png``, ``.svg`` or ``.pdf``.
    title : str, optional
        Above the figure.
    """
    with style():
        figure = new_figure(6.4 if isinstance(prediction.manoeuvre, PredictedCircle) else 4.2)
        figure.set_facecolor("white")
        panel = figure.subplots()
        figure.suptitle(title, x=0.02, ha="left", fontsize=9.5)
        if isinstance(prediction.manoeuvre, PredictedCircle):
            _circle(panel, prediction)
        elif isinstance(prediction.manoeuvre, PredictedZigzag):
            _zigzag(panel, prediction, prediction.manoeuvre)
        elif isinstance(prediction.manoeuvre, PredictedSpiral):
            _spiral(panel, prediction)
        else:
            _pull_out(panel, prediction)
        handles, labels = panel.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
        save(figure, path, 110)


def _ships(panel: Any, prediction: Prediction, x: int, y: int, factors: tuple[float, float]) -> None:
    """Draw ships of all models thinly, evenly chosen, and the one of the estimates over them."""
    drawn = prediction.drawn
    chosen = drawn[:: max(1, len(drawn) // _SHIPS)]
    for k, ship in enumerate(chosen):
        label = "ships that the data allow" if k == 0 else None
        panel.plot(
            factors[0] * ship.curve[:, x], factors[1] * ship.curve[:, y], color=FULL, alpha=0.12, lw=1.0, label=label
        )
    for k, model in enumerate(prediction.models):
        if model.sailed is not None:
            curve = model.sailed.curve
            style_of = {"color": INK, "lw": 1.6} if k == 0 else {"color": LIMIT, "lw": 1.0, "ls": "--"}
            label = "estimates" if k == 0 else ("models that fit as well" if k == 1 else None)
            panel.plot(factors[0] * curve[:, x], factors[1] * curve[:, y], **style_of, label=label)


def _bar(panel: Any, figure: Any, place: float, *, across: bool) -> None:
    """Draw the interval of a figure as a bar."""
    if figure.value is None:
        return
    ends = (figure.low, figure.high)
    both = (place, place)
    panel.plot(ends if across else both, both if across else ends, color=LIMIT, lw=3.0, solid_capstyle="butt")


def _circle(panel: Any, prediction: Prediction) -> None:
    _ships(panel, prediction, 1, 0, (1.0, 1.0))
    figures = prediction.figures
    advance, diameter, transfer = (figures[n] for n in ("advance_m", "tactical_diameter_m", "transfer_m"))
    for figure, words, across in ((advance, "advance", False), (diameter, "tactical diameter", True)):
        if figure.value is None:
            continue
        if across:
            panel.axvline(figure.value, color=FAINT, lw=0.8, ls=":")
            _bar(panel, figure, 0.0, across=True)
            place, align = (figure.value, 0.0), {"ha": "right", "va": "bottom"}
        else:
            panel.axhline(figure.value, color=FAINT, lw=0.8, ls=":")
            _bar(panel, figure, transfer.value or 0.0, across=False)
            place, align = (0.0, figure.value), {"ha": "left", "va": "bottom"}
        text = f" {words} {figure.value:.4g} m ({figure.low:.4g} to {figure.high:.4g}) "
        panel.annotate(text, place, fontsize=8, **align)
    panel.plot([], [], color=LIMIT, lw=3.0, label="95 % interval")
    panel.set_aspect("equal")
    panel.set_xlabel("across the approach, to the side of the turn, m")
    panel.set_ylabel("along the approach, m")


def _zigzag(panel: Any, prediction: Prediction, manoeuvre: PredictedZigzag) -> None:
    nominal = np.degrees(manoeuvre.heading_rad)
    panel.axhline(0.0, color=INK, lw=0.5)
    for side in (-1, 1):
        panel.axhline(side * nominal, color=FAINT, lw=0.8, ls=":")
    curve = prediction.sailed.curve
    panel.plot(curve[:, 0], np.degrees(curve[:, 2]), color=FAINT, lw=1.1, label="rudder")
    _ships(panel, prediction, 0, 1, (1.0, np.degrees(1.0)))
    heading = np.degrees(curve[:, 1])
    for k in range(manoeuvre.overshoots):
        figure = prediction.figures[f"overshoots_deg.{k}"]
        side = manoeuvre.side * (-1) ** k
        if figure.value is None:
            continue
        at = float(curve[np.argmin(np.abs(heading - side * (nominal + figure.value))), 0])
        low, high = (side * (nominal + x) for x in (figure.low, figure.high))
        panel.plot(
            [at, at], [low, high], color=LIMIT, lw=4.0, solid_capstyle="butt", label=None if k else "95 % interval"
        )
        text = f"{figure.value:.1f}°\n({figure.low:.1f} to {figure.high:.1f})"
        panel.annotate(
            text, (at, max(high, low) if side > 0 else min(high, low)), (0, 14 * side),
            textcoords="offset points", ha="center", va="center", fontsize=7.5,
        )  # fmt: skip
    low, high = panel.get_ylim()
    panel.set_ylim(low - 0.12 * (high - low), high + 0.12 * (high - low))
    panel.set_xlim(0.0, float(curve[-1, 0]))
    panel.set_xlabel("time from the first execute, s")
    panel.set_ylabel("heading from the base course and rudder, deg")


def _pull_out(panel: Any, prediction: Prediction) -> None:
    panel.axhline(0.0, color=INK, lw=0.5)
    _ships(panel, prediction, 0, 1, (1.0, np.degrees(1.0)))
    left = prediction.figures["residual_yaw_rate_deg_s"]
    _bar(panel, left, float(prediction.sailed.curve[-1, 0]), across=False)
    panel.plot([], [], color=LIMIT, lw=3.0, label="95 % interval of what is left")
    panel.set_xlabel("time from the order amidships, s")
    panel.set_ylabel("yaw rate, deg/s")


def _spiral(panel: Any, prediction: Prediction) -> None:
    panel.axhline(0.0, color=INK, lw=0.5)
    panel.axvline(0.0, color=INK, lw=0.5)
    _ships(panel, prediction, 0, 1, (np.degrees(1.0), np.degrees(1.0)))
    assert isinstance(prediction.manoeuvre, PredictedSpiral)
    for name, marker, words in (
        ("from_starboard_deg_s", "v", "direct spiral, from starboard"),
        ("from_port_deg_s", "^", "direct spiral, from port"),
    ):
        there = [
            (np.degrees(o), prediction.figures[f"{name}.{k}"].value)
            for k, o in enumerate(prediction.manoeuvre.orders_rad)
        ]
        points = [(o, value) for o, value in there if value is not None]
        panel.plot(*zip(*points, strict=True), marker=marker, ls="", ms=4.5, color=LIMIT, label=words)
    farthest = 1.05 * np.degrees(prediction.manoeuvre.rudder_rad)
    panel.set_xlim(-farthest, farthest)
    panel.set_xlabel("rudder, deg")
    panel.set_ylabel("steady yaw rate, deg/s")
