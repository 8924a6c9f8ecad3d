"""Draw the README's picture from the demonstration: ``python -m benchmarks.documents.draw_readme``.

Left the 20/20 zigzag of the first trial day with the executes that were found; right the six parameters of every zigzag
of the demonstration beside the truth, in parts of the truth, with two standard errors.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

from kempf.flows.jobs.demo.demonstrate import Demonstration, demonstrate
from kempf.flows.jobs.identify.identify_vessel import IdentifyOutcome
from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.schemas.model_spec import HULL_PARAMETERS
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.segments import Segment

FIGURE = Path(__file__).parents[2] / "docs" / "figures" / "zigzag.png"
#: Seconds of the approach that are shown.
BEFORE_S = 60.0
SECOND_NS = 1_000_000_000
BLUE, ORANGE, GREEN = "#1f5fa8", "#d1731f", "#2c7d46"


def draw_zigzag(axes, warehouse: Warehouse, segment: Segment) -> None:  # type: ignore[no-untyped-def]
    instruments = channels_of(warehouse, segment.ingest_id)
    origin = segment.executes_utc_ns[0]
    begin, end = max(segment.start_utc_ns, origin - int(BEFORE_S * SECOND_NS)), segment.end_utc_ns
    heading = instruments.series["heading"].between(begin, end)
    rudder = instruments.series["rudder_angle"].between(begin, end)
    # the base heading is between 0 and 360, the heading unwrapped over the whole log
    psi = np.rad2deg(heading.value) - segment.base_heading_deg
    psi -= 360.0 * np.round(np.mean(psi) / 360.0)
    for number, execute in enumerate(segment.executes_utc_ns):
        label = "execute found" if number == 0 else None
        axes.axvline((execute - origin) / SECOND_NS, color="0.55", lw=0.9, ls=":", label=label)
    axes.plot(heading.seconds_since(origin), psi, color=BLUE, lw=1.6, label="heading less base heading")
    axes.plot(rudder.seconds_since(origin), np.rad2deg(rudder.value), color=ORANGE, lw=1.2, label="rudder angle")
    axes.set_xlabel("time since the first execute, s")
    axes.set_ylabel("deg, positive to starboard")
    axes.set_xlim((begin - origin) / SECOND_NS, (end - origin) / SECOND_NS)
    axes.set_ylim(-68, 68)
    axes.set_yticks(np.arange(-60, 61, 20))
    axes.grid(lw=0.3, axis="y")
    axes.set_title(
        f"{segment.psi0_deg:g}/{segment.delta0_deg:g} zigzag found in the log of the first day", loc="left", fontsize=10
    )
    axes.legend(loc="upper right", fontsize=8, ncols=3, framealpha=1.0, columnspacing=1.2)


def draw_parameters(axes, shown: Demonstration) -> None:  # type: ignore[no-untyped-def]
    names = list(HULL_PARAMETERS)
    kinds = sorted({_kind(o) for o in shown.identified}, reverse=True)
    for row, name in enumerate(names):
        axes.axhspan(row - 0.5, row + 0.5, color="0.95" if row % 2 else "1.0", zorder=0)
        for place, outcome in enumerate(shown.identified):
            assert outcome.parameter_set is not None
            found = next(p for p in outcome.parameter_set.parameters if p.name == name)
            assert found.std is not None
            percent = 100.0 / abs(shown.truth[name])
            colour = (GREEN, BLUE)[kinds.index(_kind(outcome))]
            label = f"{_kind(outcome)} zigzag" if row == 0 and place < len(kinds) else None
            axes.errorbar(
                (found.value - shown.truth[name]) * percent * np.sign(shown.truth[name]),
                row + 0.13 * (place - (len(shown.identified) - 1) / 2),
                xerr=2.0 * found.std * percent,
                fmt="o",
                ms=3.5,
                lw=1.2,
                color=colour,
                label=label,
            )
    axes.axvline(0.0, color="k", lw=1.0)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.5, -1.15)
    axes.set_xlim(-32, 32)
    axes.set_xlabel("estimate less truth, % of the truth; bars are ±2 standard errors")
    axes.set_title("what each zigzag says of the ship, truth at 0", loc="left", fontsize=10)
    axes.legend(loc="upper right", fontsize=8, ncols=2, framealpha=1.0)


def _kind(outcome: IdentifyOutcome) -> str:
    return f"{outcome.segment.psi0_deg:g}/{outcome.segment.delta0_deg:g}"


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        shown = demonstrate(Path(folder))
        warehouse = Warehouse(str(Path(folder) / "warehouse"))
        figure, (left, right) = plt.subplots(1, 2, figsize=(12, 4.4), width_ratios=(1.25, 1), layout="constrained")
        draw_zigzag(left, warehouse, shown.identified[0].segment)
        draw_parameters(right, shown)
        FIGURE.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(FIGURE, dpi=100, metadata={"Software": None})
        print(FIGURE, FIGURE.stat().st_size)


if __name__ == "__main__":
    main()
