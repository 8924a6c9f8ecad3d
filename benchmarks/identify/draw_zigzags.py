"""Draw rudder and heading of the measured logs with what `find_zigzags` found in them, one picture a source.

Run from the repository: ``python -m benchmarks.identify.draw_zigzags FOLDER``. Executes are vertical lines,
overshoots dots, the base heading a dashed line, phases the strip below. For the eye before the numbers are believed.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

from kempf.pipeline.segment.zigzags.find_zigzags import find_zigzags
from kempf.pipeline.segment.zigzags.zigzag import Zigzag
from tests.segment.loading import available, load

SOURCES = {
    "trials": "trials/*/2*",
    "towing_tank": "data/kvlcc2_hsva/*.dat",
    "boat": "data/usv_open_water/*_xy.csv",
}
COLOURS = {
    "approach": "0.85",
    "execute": "tab:red",
    "yaw_build_up": "tab:olive",
    "overshoot": "tab:purple",
    "counter_rudder": "tab:cyan",
    "steady_yaw": "tab:green",
}


def draw(axes, name: str) -> None:  # type: ignore[no-untyped-def]
    log = load(name)
    origin = int(log.heading.time_utc_ns[0])
    zero = float(log.heading.value[0])
    heading = np.rad2deg(log.heading.value - zero)
    axes.plot(log.heading.seconds_since(origin), heading, lw=0.8, color="tab:blue")
    axes.plot(log.rudder.seconds_since(origin), np.rad2deg(log.rudder.value), lw=0.8, color="tab:orange")
    found = find_zigzags(log.heading, log.rudder, log.speed)
    for zigzag in found:
        seconds = log.heading.seconds_since(origin)
        mark(axes, zigzag, origin=origin, zero_deg=float(np.rad2deg(zero)), heading=heading, seconds=seconds)
    listed = ", ".join(f"{z.kind} {z.psi0_deg:g}/{z.delta0_deg:g} {z.first_side} ({z.quality.start})" for z in found)
    axes.set_title(f"{name}: {listed or 'none'}", fontsize=8)
    low, high = np.percentile(heading, [1, 99])
    axes.set_ylim(max(low, -110) - 45, min(high, 200) + 20)
    axes.grid(lw=0.3)


def mark(axes, zigzag: Zigzag, *, origin: int, zero_deg: float, heading, seconds) -> None:  # type: ignore[no-untyped-def]
    for execute in zigzag.executes:
        axes.axvline((execute.time_utc_ns - origin) / 1e9, color="k", lw=0.6)
    inside = (seconds >= (zigzag.start_utc_ns - origin) / 1e9) & (seconds <= (zigzag.end_utc_ns - origin) / 1e9)
    turns = round((float(np.mean(heading[inside])) + zero_deg - zigzag.base_heading_deg) / 360.0)
    base = zigzag.base_heading_deg + 360.0 * turns - zero_deg
    axes.plot(seconds[inside], np.full(int(inside.sum()), base), "k--", lw=0.6)
    for overshoot in zigzag.overshoots:
        side = 1 if overshoot.side == "starboard" else -1
        peak = base + side * (zigzag.psi0_deg + overshoot.beyond_nominal_deg)
        axes.plot((overshoot.peak_utc_ns - origin) / 1e9, peak, "k.", ms=4)
    for phase in zigzag.phases:
        begin, end = (phase.start_utc_ns - origin) / 1e9, (phase.end_utc_ns - origin) / 1e9
        axes.axvspan(begin, end, ymin=0.0, ymax=0.05, color=COLOURS[phase.name], lw=0)


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for source, pattern in SOURCES.items():
        names = available(pattern)
        figure, axes = plt.subplots(len(names), 1, figsize=(20, 3.2 * len(names)))
        for one, name in zip(np.atleast_1d(axes), names, strict=True):
            draw(one, name)
        figure.tight_layout()
        figure.savefig(folder / f"zigzags_{source}.png", dpi=60)
        print(folder / f"zigzags_{source}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
