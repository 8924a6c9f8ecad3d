"""Parameters of a vessel over time with their intervals, and the changes found."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kempf.pipeline.channels.series import Float, Nanoseconds
from kempf.pipeline.history.changes import Change, Changes
from kempf.pipeline.history.scan import YEAR_S
from kempf.pipeline.history.sets import ParameterHistory
from kempf.workbench.figures.drawn import pyplot, save


def draw_history(history: ParameterHistory, changes: Changes, path: Path, title: str) -> None:
    """Draw one panel a parameter: sets with 2 standard errors, scatter between trials, steps and drifts.

    Parameters
    ----------
    changes : Changes
        Of it.
    path : Path
        Ending ``.png``, ``.svg`` or ``.pdf``.
    title : str
        Above the figure.
    """
    p = len(history.names)
    rows = (p + 1) // 2
    figure, axes = pyplot().subplots(
        rows, 2, figsize=(12, 2.6 * rows + 1.2), sharex=True, layout="constrained", squeeze=False
    )
    std = np.sqrt(np.einsum("ijj->ij", history.covariance))
    time = history.time_utc_ns.astype("datetime64[ns]")
    edge = (time[-1] - time[0]) // 40 if len(history) > 1 else np.timedelta64(1, "D")
    span = np.linspace(0.0, 1.0, 400) * float((history.time_utc_ns[-1] - history.time_utc_ns[0]) or 1)
    fine: Nanoseconds = history.time_utc_ns[0] + span.astype(np.int64)
    for j, panel in enumerate(axes.flat[:p]):
        for k, change in enumerate(changes.changes):
            _mark(panel, change, j, first=k == 0)
        level = _level(changes, fine, j)
        if np.isfinite(changes.scatter[j]):
            band = 2.0 * changes.scatter[j]
            panel.fill_between(fine.astype("datetime64[ns]"), level - band, level + band, color="0.88", lw=0)
        panel.plot(fine.astype("datetime64[ns]"), level, color="tab:blue", lw=1.4, label="level")
        panel.errorbar(time, history.value[:, j], 2 * std[:, j], fmt="o", ms=3.5, lw=1, color="black", capsize=2)
        # what is certain of itself must not be hidden by what is not
        low, high = np.percentile(
            np.concatenate([history.value[:, j] - 2 * std[:, j], history.value[:, j] + 2 * std[:, j]]), [2, 98]
        )
        panel.set_ylim(low - 0.15 * (high - low), high + 0.15 * (high - low))
        panel.set_xlim(time[0] - edge, time[-1] + edge)
        panel.set_ylabel(f"{history.names[j]}, {history.units[j]}")
        panel.grid(lw=0.3)
    for panel in axes.flat[p:]:
        panel.set_visible(False)
    for panel in axes[-1]:
        panel.tick_params(axis="x", rotation=25)
    figure.suptitle(title, fontsize=11)
    figure.supxlabel(
        "bars: 2 standard errors; grey: 2 standard deviations of scatter between trials; "
        "red: when it changed, solid where this parameter moved by itself",
        fontsize=9,
    )
    save(figure, path, 90)


def _mark(panel: object, change: Change, j: int, *, first: bool) -> None:
    """Shade when a step may have happened."""
    if change.kind != "step":
        return
    low, high = (np.datetime64(t, "ns") for t in change.interval_utc_ns)
    middle = np.datetime64(sum(change.between_utc_ns) // 2, "ns")
    panel.axvspan(low, high, color="tab:red", alpha=0.12, lw=0)  # type: ignore[attr-defined]
    style = {"ls": "-" if change.moved[j] else ":", "lw": 1.2, "color": "tab:red"}
    panel.axvline(middle, label="change" if first else None, **style)  # type: ignore[attr-defined]


def _level(changes: Changes, time: Nanoseconds, j: int) -> Float:
    """Return what the changes found say the parameter was, shape (n,)."""
    if not changes.changes:
        return np.full(time.size, changes.mean[j])
    level = np.full(time.size, changes.changes[0].before[j])
    for change in changes.changes:
        first, last = change.between_utc_ns
        if change.kind == "step":
            after = time >= (first + last) // 2
            level[after] = change.before[j] + change.change[j]
        else:
            inside = time >= first
            years = (np.minimum(time[inside], last) - first) / (1e9 * YEAR_S)
            level[inside] = change.before[j] + change.change[j] * years
    return level
