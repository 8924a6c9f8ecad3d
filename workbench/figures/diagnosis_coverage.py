"""Coverage: where the manoeuvres have been, and so where the model speaks from experience."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kempf.workbench.figures.diagnosis_style import FULL, PLAIN, new_figure, style
from kempf.workbench.report.content import RunView


def draw_coverage(runs: Sequence[RunView]) -> Any:
    """Draw drift speed against yaw rate, and rudder against speed.

    Parameters
    ----------
    runs : sequence of RunView

    Returns
    -------
    matplotlib.figure.Figure
    """
    with style():
        figure = new_figure(3.4)
        left, right = figure.subplots(1, 2)
        for held, colour, marker, label in ((False, PLAIN, "o", "fitted"), (True, FULL, "x", "held out")):
            chosen = [run for run in runs if run.held_out is held]
            if not chosen:
                continue
            drift, turn, rudder, speed = _columns(chosen)
            look = {"ls": "", "marker": marker, "ms": 2.6, "color": colour, "alpha": 0.5, "rasterized": True}
            look["mew"] = 0.6 if held else 0.0
            left.plot(turn, drift, label=f"{label} ({len(chosen)})", **look)
            right.plot(rudder, speed, label=f"{label} ({len(chosen)})", **look)
        left.set_xlabel("yaw rate r, deg/s")
        left.set_ylabel("lateral speed v, m/s")
        left.set_title("motion")
        right.set_xlabel("rudder δ, deg")
        right.set_ylabel("speed V, m/s")
        right.set_title("rudder and speed")
        handles, labels = left.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=2, markerscale=2.0)
        return figure


def _columns(runs: Sequence[RunView]) -> tuple[Any, Any, Any, Any]:
    # where the ship runs away, what was measured
    states = np.concatenate(
        [run.full.states[:, :2] if np.all(np.isfinite(run.full.states)) else run.measured[:, :2] for run in runs]
    )
    rudder = np.degrees(np.concatenate([run.rudder_rad for run in runs]))
    return states[:, 0], np.degrees(states[:, 1]), rudder, np.concatenate([run.speed_m_s for run in runs])


def describe_coverage(runs: Sequence[RunView]) -> str:
    """Return the figure in words.

    Parameters
    ----------
    runs : sequence of RunView
    """
    drift, turn, rudder, speed = _columns(runs)
    told = ", ".join(
        f"{name} {np.nanmin(x):.3g} to {np.nanmax(x):.3g} {unit}"
        for name, x, unit in (
            *(("lateral speed", drift, "m/s"), ("yaw rate", turn, "deg/s")),
            *(("rudder", rudder, "deg"), ("speed", speed, "m/s")),
        )
    )
    return f"Where the manoeuvres have been: {told}."
