"""Correlations of the innovations with themselves and with the inputs of the ship, with the band of 99 %."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kempf.schemas.enumeration import as_words
from kempf.workbench.figures.diagnosis_style import BAND, FULL, INK, PLAIN, new_figure, style

#: in the order of the columns; the others stand in the table
_SHOWN = ("itself", "rudder", "heading_sine", "heading_cosine", "speed", "wind")
WORDS = {
    "itself": "itself",
    "rudder": "rudder",
    "rudder_rate": "rudder's rate",
    "heading_sine": "sine of heading",
    "heading_cosine": "cosine of heading",
    "speed": "speed",
    "wind": "wind force",
}
_ORDER = ("heading", "yaw_rate", "lateral_speed")

Pairs = dict[tuple[str, str], Mapping[str, Any]]


def pairs(correlations: Mapping[str, Any]) -> Pairs:
    """Return every correlation that there is by channel and what it is with.

    Parameters
    ----------
    correlations : mapping
        Of `kempf.pipeline.compare.correlations.correlations`.
    """
    by_pair: Pairs = {}
    for channel in _ORDER:
        if channel not in correlations:
            continue
        every = {"itself": correlations[channel]["auto"], **correlations[channel]["cross"]}
        by_pair |= {(channel, name): correlation for name, correlation in every.items() if correlation["lag_s"]}
    return by_pair


def draw_correlations(
    before: Mapping[str, Any], after: Mapping[str, Any], first_model: str, last_model: str, *, improved: bool
) -> Any:
    """Draw one row a channel, one column for itself and each input.

    Parameters
    ----------
    before, after : mapping
        Of the first model and of the last.
    first_model, last_model : str
        What the two are called.
    improved : bool
        Whether these are two.
    """
    first, last = pairs(before), pairs(after)
    rows = list(dict.fromkeys(channel for channel, _ in last))
    columns = [name for name in _SHOWN if any(other == name for _, other in last)]
    with style():
        figure = new_figure(0.9 + 1.5 * len(rows))
        panels = figure.subplots(len(rows), len(columns), sharey=True, sharex=True, squeeze=False)
        for row, channel in zip(panels, rows, strict=True):
            row[0].set_ylabel(as_words(channel))
            for panel, other in zip(row, columns, strict=True):
                correlation = last.get((channel, other))
                if correlation is None:
                    panel.set_visible(False)
                    continue
                panel.axhspan(-correlation["band"], correlation["band"], color=BAND, lw=0, label="band of 99 %")
                panel.axhline(0.0, color=INK, lw=0.5)
                if improved and (channel, other) in first:
                    plain = first[channel, other]
                    panel.plot(plain["lag_s"], plain["rho"], color=PLAIN, lw=0.9, ls="--", label=first_model)
                label, colour = (last_model, FULL) if improved else (first_model, PLAIN)
                panel.plot(correlation["lag_s"], correlation["rho"], color=colour, lw=0.9, label=label)
        for panel, other in zip(panels[0], columns, strict=True):
            panel.set_title(WORDS[other])
        largest = max(abs(correlation["largest"]) for correlation in (*first.values(), *last.values()))
        panels[0, 0].set_ylim(-max(0.15, 1.08 * largest), max(0.15, 1.08 * largest))
        figure.supxlabel("by how much the innovation comes later, s", fontsize=9)
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=3)
        return figure


def describe_correlations(after: Mapping[str, Any]) -> str:
    """Return the figure in words.

    Parameters
    ----------
    after : mapping
        Of the last model.
    """
    by_pair = pairs(after)
    worst = sorted(by_pair, key=lambda key: (-by_pair[key]["outside"] / len(by_pair[key]["lag_s"]), key))[:3]
    words = "; ".join(
        f"{as_words(channel)} with {WORDS[other]}, {by_pair[channel, other]['outside']} of "
        f"{len(by_pair[channel, other]['lag_s'])}"
        for channel, other in worst
    )
    return (
        "Correlations of the whitened one-step innovations with their own past and with the inputs of the ship, lags "
        f"to a minute. Lags outside the 99 % band under the last model, the most: {words}."
    )
