"""The ladder of the measured towing-tank runs: from the linear model down, on runs that were not fitted."""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks import measured_ships, result_page
from benchmarks.diagnose.diagnosed import diagnosed, section
from kempf.flows.jobs.ingest.files import read_model

_MODEL = Path(__file__).parents[2] / "docs" / "models" / "tank.yaml"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=Path(__file__).parents[3] / "shared")
    given = parser.parse_args()
    spec = read_model(_MODEL).model_copy(update={"rate_bias": False})
    stated = diagnosed(measured_ships.tank(given.data), spec)
    first, last = stated["ladder"][0], stated["ladder"][-1]
    ratio = _yaw_rate(last) / _yaw_rate(first)
    lines = [
        f"{len(stated['fitted'])} runs fitted, {len(stated['held_out'])} held out before anything was looked at. The "
        f"held-out yaw-rate rms of the last model is {100 * ratio:.0f} % of the linear model's (wanted: at most half); "
        f"the ladder stops after {len(stated['ladder']) - 1} effects, when no candidate stands the tests or the "
        "largest number of steps is reached.",
        "",
    ]
    result_page.write(
        "diagnose.hsva_ladder", "Towing-tank runs: the ladder on held-out runs", [*lines, *section(stated)]
    )


def _yaw_rate(rung: dict[str, dict[str, dict[str, float]]]) -> float:
    runs = rung["held_out"].values()
    return float((sum(run["yaw_rate"] ** 2 for run in runs) / len(runs)) ** 0.5)


if __name__ == "__main__":
    main()
