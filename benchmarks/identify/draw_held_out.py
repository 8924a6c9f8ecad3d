"""Free runs over measurements: yaw rate and lateral speed, one run a column."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.identify.linear_free_run import LinearFreeRun


def draw_held_out(runs: dict[str, LinearFreeRun], path: Path) -> None:
    figure, axes = plt.subplots(
        2, len(runs), figsize=(3.4 * len(runs), 5.5), sharex="col", sharey="row", layout="constrained", squeeze=False
    )
    for column, (name, run) in enumerate(runs.items()):
        for row, (channel, scale, label) in enumerate(
            ((1, np.rad2deg(1.0), "yaw rate, deg/s"), (0, 1.0, "lateral speed, m/s"))
        ):
            axis = axes[row, column]
            axis.plot(
                run.time_s, scale * (run.predicted + run.error)[:, channel], color="0.4", lw=2.5, label="measured"
            )
            axis.plot(run.time_s, scale * run.predicted[:, channel], color="tab:red", lw=1.2, label="free run")
            axis.grid(alpha=0.3)
            if column == 0:
                axis.set_ylabel(label)
        rms, fit = run.rms, run.fit_percent
        axes[0, column].set_title(
            f"{name}, held out\n{np.rad2deg(rms['yaw_rate']):.2f} deg/s rms, fit {fit['yaw_rate']:.0f} %", fontsize=9
        )
        axes[1, column].set_title(f"{rms['lateral_speed']:.3f} m/s rms, fit {fit['lateral_speed']:.0f} %", fontsize=9)
        axes[1, column].set_xlabel("time, s")
    axes[0, 0].legend(loc="upper right", fontsize=8)
    figure.savefig(path, dpi=110)
    plt.close(figure)
