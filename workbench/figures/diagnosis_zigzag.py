"""Heading of a zigzag, measured and in free run, with its rudder, overshoots and the limits of IMO MSC.137(76)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from kempf.schemas.diagnosis_evidence import ManoeuvreEvidence
from kempf.workbench.figures.diagnosis_style import FAINT, FULL, INK, LIMIT, PLAIN, framed_figure, style

_PLACES = {"first overshoot": 0, "second overshoot": 1}


def limits(imo: Mapping[str, Any]) -> dict[int, float]:
    """Return the limits of the overshoots that have one, deg, by number from 0.

    Parameters
    ----------
    imo : mapping
        The criteria as a segment has them.
    """
    by_place = {}
    for name, criterion in imo.items():
        for words, place in _PLACES.items():
            if name.endswith(words) and criterion.get("limit_deg") is not None:
                by_place[place] = float(criterion["limit_deg"])
    return by_place


def draw_zigzag(shown: ManoeuvreEvidence, psi0_deg: float, allowed: Mapping[int, float], first: str, last: str) -> Any:
    """Draw heading from the base course, measured and predicted, over the rudder.

    Parameters
    ----------
    psi0_deg : float
        Nominal heading deviation; NaN where no zigzag was sailed.
    allowed : mapping of int to float
        Of `limits`.
    first, last : str
        What the two models are called.
    """
    with style():
        figure = framed_figure(3.8, legend_in=0.25)
        panel = figure.subplots()
        panel.axhline(0.0, color=INK, lw=0.5)
        for side in (-1, 1) if np.isfinite(psi0_deg) else ():
            panel.axhline(side * psi0_deg, color=FAINT, lw=0.8, ls=":")
        panel.plot(shown.time_s, np.degrees(shown.rudder), color=FAINT, lw=1.1, label="rudder")
        panel.plot(shown.time_s, np.degrees(shown.heading_deviation), color=INK, lw=1.6, label="heading, measured")
        for label, predicted, colour, line in ((first, shown.before, PLAIN, "--"), (last, shown.after, FULL, "-.")):
            if predicted is not None:
                heading = np.degrees(predicted.heading_deviation)
                panel.plot(shown.time_s, heading, color=colour, lw=1.2, ls=line, label=f"free run, {label}")
        for k, peak in enumerate(shown.peaks):
            top = peak.side * (psi0_deg + peak.beyond_deg)
            panel.plot([peak.at_s, peak.at_s], [peak.side * psi0_deg, top], color=INK, lw=1.0, ls=":")
            panel.annotate(
                f"{peak.beyond_deg:.1f}°",
                (peak.at_s, top),
                (0, 11 * peak.side),
                textcoords="offset points",
                ha="center",
                va="center",
                fontsize=8,
            )
            if k in allowed:
                level = peak.side * (psi0_deg + allowed[k])
                width = 0.04 * float(shown.time_s[-1])
                once = "largest overshoot that IMO allows" if k == min(allowed) else None
                panel.plot([peak.at_s - width, peak.at_s + width], [level, level], color=LIMIT, lw=2.4, label=once)
        low, high = panel.get_ylim()
        panel.set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
        panel.set_xlim(0.0, shown.time_s[-1])
        panel.set_xlabel("time from the beginning of the manoeuvre, s")
        panel.set_ylabel("from the base course, deg,\npositive to starboard")
        handles, labels = panel.get_legend_handles_labels()
        figure.legend(handles, labels, loc="upper center", ncols=3)
        return figure


def describe_zigzag(shown: ManoeuvreEvidence, label: str) -> str:
    """Return the figure in words.

    Parameters
    ----------
    label : str
        Of the manoeuvre.
    """
    overshoots = ", ".join(f"{peak.beyond_deg:.1f}" for peak in shown.peaks)
    sentence = f" Measured overshoots beyond the nominal heading, degrees: {overshoots}." if overshoots else ""
    return f"{label}: heading, measured and predicted in free run, and rudder in time.{sentence}"
