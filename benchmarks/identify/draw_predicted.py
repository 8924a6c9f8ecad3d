"""Measured over predicted some seconds ahead, with 95 % intervals. Measures nothing."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.identify.linear_ahead import Ahead
from kempf.pipeline.estimate.record.record import Record
from kempf.schemas.confidence import NORMAL_95

_SHOWN = (
    (2, np.rad2deg(1.0), "heading from its first value, deg"),
    (1, np.rad2deg(1.0), "yaw rate, deg/s"),
    (0, 1.0, "lateral speed over ground, m/s"),
)


def draw_predicted(record: Record, ahead: Ahead, path: Path) -> None:
    shown = [one for one in _SHOWN if np.isfinite(ahead.error[:, one[0]]).any()]
    figure, axes = plt.subplots(len(shown), 1, figsize=(11, 3.2 * len(shown)), sharex=True, layout="constrained")
    for axis, (column, scale, label) in zip(np.atleast_1d(axes), shown, strict=True):
        good = np.isfinite(ahead.error[:, column])
        time, measured = record.time_s[good], scale * record.measured[good, column]
        predicted = measured - scale * ahead.error[good, column]
        reach = NORMAL_95 * scale * ahead.std[good, column]
        # a window is predicted from one beginning: between windows the line breaks
        ends = np.flatnonzero(np.diff(time) > 0.4 * ahead.horizon_s)
        for part in np.split(np.arange(time.size), ends + 1):
            axis.fill_between(
                time[part], (predicted - reach)[part], (predicted + reach)[part], color="tab:blue", alpha=0.3, lw=0
            )
            axis.plot(time[part], predicted[part], color="tab:blue", lw=1.0)
        outside = np.abs(measured - predicted) > reach
        axis.plot(time[~outside], measured[~outside], ".", color="0.2", ms=3, label="measured, inside")
        axis.plot(time[outside], measured[outside], ".", color="tab:red", ms=4, label="measured, outside")
        axis.set_ylabel(label)
        low, high = np.percentile(np.concatenate([predicted - reach, predicted + reach]), [0.5, 99.5])
        axis.set_ylim(low - 0.2 * (high - low), high + 0.2 * (high - low))
        axis.grid(lw=0.3)
    axes = np.atleast_1d(axes)
    axes[0].set_title(
        f"predicted {0.5 * ahead.horizon_s:g} to {ahead.horizon_s:g} s ahead, with 95 % intervals", fontsize=10
    )
    axes[0].legend(loc="upper right", fontsize=8, ncols=2)
    axes[-1].set_xlabel("s")
    figure.savefig(path, dpi=80, metadata={"Software": None})
    plt.close(figure)
