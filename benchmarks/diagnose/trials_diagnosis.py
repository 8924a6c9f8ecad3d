"""The eight trial ships: what the program concludes for each, with the evidence. Nobody told it what ails them."""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks import measured_ships, result_page
from benchmarks.diagnose.diagnosed import diagnosed, section
from kempf.flows.jobs.standing_model import PLAIN


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=Path(__file__).parents[3] / "shared")
    given = parser.parse_args()
    told = []
    for ship in measured_ships.fleet(given.data):
        told.append(diagnosed(ship, PLAIN))
        print(ship.name, told[-1]["verdict"], flush=True)
    rows = [
        [
            one["vessel"],
            one["verdict"].replace("_", " "),
            "; ".join(" or ".join(found["effects"]) for found in one["sets"]) or "none",
            f"{len(one['fitted'])} + {len(one['held_out'])}",
        ]
        for one in told
    ]
    lines = [
        "Errors are those of free runs, initial state, constant wind force and constant current fitted to the run; rms "
        "values are of the held-out zigzags, of the fitted ones where none is held out.",
        "",
        *result_page.table(["vessel", "verdict", "lacks", "zigzags fitted + held out"], rows),
        "",
    ]
    result_page.write(
        "diagnose.trials_diagnosis",
        "The eight trial ships diagnosed",
        [*lines, *(line for one in told for line in section(one))],
    )


if __name__ == "__main__":
    main()
