"""The eight trial ships: what the program concludes for each, with the evidence. What ails them is not known to it."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks import measured_ships, result_page
from benchmarks.diagnose.diagnosed import diagnosed, section
from benchmarks.measured_ships import Ship
from kempf.schemas.model_spec import ModelSpec


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    ships = measured_ships.fleet(parser.parse_args().data)
    conclude("diagnose.trials_diagnosis", "The eight trial ships diagnosed", ships)


def conclude(name: str, title: str, ships: Sequence[Ship]) -> None:
    """Diagnose ships from the plain model and write the page of what is concluded."""
    stated = []
    for ship in ships:
        stated.append(diagnosed(ship, ModelSpec()))
        print(ship.name, stated[-1]["verdict"], _sets(stated[-1]["sets"]), flush=True)
    rows = [
        [
            one["vessel"],
            one["verdict"].replace("_", " "),
            _sets(one["sets"]),
            _sets(one["immaterial"]),
            "" if one["share_explained"] is None else f"{100.0 * one['share_explained']:.0f}",
            f"{len(one['fitted'])} + {len(one['held_out'])}",
        ]
        for one in stated
    ]
    head = ["vessel", "verdict", "lacks", "certain but immaterial", "explained, %", "zigzags fitted + held out"]
    lines = [
        "Errors one leg ahead are per cent of the motion, mean over manoeuvres: of the fitted ones, of each by the "
        "parameters of the others, of the held-out ones. Free runs have initial state, constant wind force and "
        "constant current fitted to the run; rms values are "
        "of the held-out zigzags, of the fitted ones where none is held out. "
        "Explained is the part of the misfit one leg ahead, in manoeuvres left out.",
        "",
        *result_page.table(head, rows),
        "",
    ]
    result_page.write(name, title, [*lines, *(line for one in stated for line in section(one))])


def _sets(found: Sequence[Mapping[str, Any]]) -> str:
    return "; ".join(" or ".join(one["effects"]) for one in found) or "none"


if __name__ == "__main__":
    main()
