"""The worst windows of time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.distributions import chi2_log_tail, chi2_tail
from kempf.pipeline.estimate.record.record import MEASUREMENTS
from kempf.pipeline.predict.run_residuals import RunResiduals
from kempf.schemas.instants import iso_cut
from kempf.schemas.motion_channel import MOTION
from kempf.schemas.units import MILLISECOND_NS, SECOND_NS

#: a window in instants, with a few to spare of what `kempf explain` needs, and how many windows are shown of each kind
_WINDOW, _SHOWN = 24, 5
_FEWEST = 4


def worst(residuals: Sequence[RunResiduals]) -> list[dict[str, Any]]:
    """Return the windows in which the model errs most, worst first, one step ahead and in the free run.

    Returns
    -------
    list of dict
        ``run``, ``start`` and ``end`` (UTC, ISO 8601), ``start_s`` and ``end_s`` from the first instant of the run,
        ``channel``, ``phase`` (the commonest in it), ``measure``: ``one step`` with ``whitened_rms`` and the
        probability ``p_value`` of as much in a window of a right model, or ``free run`` with ``free_run_rms`` in
        ``unit`` and how many times the channel's own it is. Windows of one channel do not overlap.
    """
    windows = []
    for i, name in enumerate(MEASUREMENTS):
        windows += _one_step(residuals, i, name) + _free(residuals, i, name)
    shown = []
    for measure in ("one step", "free run"):
        these = [window for window in windows if window["measure"] == measure]
        these.sort(key=lambda window: -float(window["_rank"]))
        shown += [{k: v for k, v in window.items() if k != "_rank"} for window in these[:_SHOWN]]
    return shown


def _one_step(residuals: Sequence[RunResiduals], channel: int, name: str) -> list[dict[str, Any]]:
    windows = []
    for run in residuals:
        for at, mean, count in _windows(run.whitened[:, channel] ** 2):
            probability = chi2_tail(mean * count, count)
            measured = {"whitened_rms": float(np.sqrt(mean)), "p_value": probability}
            rank = -chi2_log_tail(mean * count, count)
            windows.append({**_window(run, at), "channel": name, "measure": "one step", **measured, "_rank": rank})
    return windows


def _free(residuals: Sequence[RunResiduals], channel: int, name: str) -> list[dict[str, Any]]:
    unit, factor = MOTION[name].shown
    whole = np.concatenate([run.free.error[:, channel] for run in residuals])
    if not np.isfinite(whole).any():
        return []
    usual, windows = float(np.nanmean(whole**2)), []
    for run in residuals:
        for at, mean, _ in _windows(run.free.error[:, channel] ** 2):
            times = float(np.sqrt(mean / usual)) if usual > 0.0 else 0.0
            measured = {"free_run_rms": factor * float(np.sqrt(mean)), "unit": unit, "times_its_rms": times}
            windows.append({**_window(run, at), "channel": name, "measure": "free run", **measured, "_rank": times})
    return windows


def _windows(square: Float) -> list[tuple[int, float, int]]:
    """Return beginnings, means and counts of the largest windows that do not overlap."""
    length = min(_WINDOW, square.size)
    good = np.isfinite(square)
    kernel = np.ones(length)
    total = np.convolve(np.where(good, np.nan_to_num(square), 0.0), kernel, "valid")
    count = np.round(np.convolve(good.astype(np.float64), kernel, "valid"))
    mean = np.where(count >= _FEWEST, total / np.maximum(count, 1.0), -np.inf)
    windows = []
    for _ in range(_SHOWN):
        at = int(np.argmax(mean))
        if not np.isfinite(mean[at]):
            break
        windows.append((at, float(mean[at]), int(count[at])))
        mean[max(0, at - length + 1) : at + length] = -np.inf
    return windows


def _window(residuals: RunResiduals, at: int) -> dict[str, Any]:
    run = residuals.filtered.run
    end = min(at + _WINDOW, run.time_s.size) - 1
    names, counts = np.unique(residuals.phase_of[at : end + 1], return_counts=True)
    start_s, end_s = float(run.time_s[at]), float(run.time_s[end])
    return {
        "run": run.name,
        "start": _iso(run.start_utc_ns, start_s, up=False),
        # whoever asks for this window gets its last instant too
        "end": _iso(run.start_utc_ns, end_s, up=True),
        "start_s": start_s,
        "end_s": end_s,
        "phase": str(names[int(np.argmax(counts))]) or None,
    }


def _iso(start_utc_ns: int, seconds: float, *, up: bool) -> str:
    instant_ns = start_utc_ns + round(seconds * SECOND_NS)
    return iso_cut(-(-instant_ns // MILLISECOND_NS) * MILLISECOND_NS if up else instant_ns)
