"""The paper's Fig. 1 and Fig. 3: lateral speed, yaw rate, force and current, true, measured and estimated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kempf.workbench.figures.drawn import pyplot, save

Float = NDArray[np.float64]

_LABELS = ("v, m/s", "r, deg/s", "F, 1e-3 m/s²", "$V_T$, m/s")
_FACTORS = (1.0, 180.0 / np.pi, 1e3, 1.0)


def draw_disturbed_zigzag(
    time_s: Float, true: Float, measured: Float, estimated: Float, path: Path, title: str
) -> None:
    """Draw four panels over time.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Since the first execute.
    true, estimated : ndarray, shape (n, 4)
        v, r, F, V_T; SI.
    measured : ndarray, shape (n, 2)
        y_v and y_r.
    path : Path
        Of a PNG.
    title : str
        Above the figure.
    """
    figure, axes = pyplot().subplots(4, 1, figsize=(10, 9), sharex=True, layout="constrained")
    for k, (panel, label, factor) in enumerate(zip(axes, _LABELS, _FACTORS, strict=True)):
        if k < 2:
            panel.plot(time_s, factor * measured[:, k], ".", ms=2.0, color="tab:orange", label="measured")
        panel.plot(time_s, factor * estimated[:, k], color="tab:blue", lw=1.2, label="estimated")
        panel.plot(time_s, factor * true[:, k], color="black", lw=1.0, ls="--", label="true")
        panel.set_ylabel(label)
        panel.grid(lw=0.3)
    for panel, k in ((axes[2], 2), (axes[3], 3)):
        # the first seconds of the filter must not hide where it goes
        reach = 2.2 * _FACTORS[k] * float(np.max(np.abs(true[:, k])))
        low, high = panel.get_ylim()
        panel.set_ylim(max(low, -0.5 * reach), min(high, reach))
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, frameon=False, title=title)
    axes[-1].set_xlabel("time since the first execute, s")
    save(figure, path, 90)
