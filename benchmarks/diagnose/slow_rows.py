"""Measured logs thinned to a row a second: what a diagnosis finds with instants as they are taken, and found.

Of such a log nobody can tell that its instruments measured at the rows, so a diagnosis lays its runs out at the
instants that the plain model finds (decision 0111).
"""

from __future__ import annotations

import argparse
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from benchmarks import measured_ships, result_page
from benchmarks.diagnose.diagnosed import LADDER, rung_row
from benchmarks.measured_ships import Ship
from kempf.flows.process.cores import usable
from kempf.pipeline.diagnose.screening.found_instants import LayOut
from kempf.pipeline.diagnose.verdicts.diagnosis import diagnose
from kempf.pipeline.diagnose.verdicts.diagnosis_json import as_json
from kempf.schemas.effects import catalogue

_ROW_S = 1.0


def _rows(ship: Ship) -> list[list[str]]:
    layout = measured_ships.thinned(ship, _ROW_S)
    runs, rows = layout.runs(), list[list[str]]()
    ways: dict[str, LayOut | None] = {"as they are taken": None, "found": layout.runs_at}
    with ThreadPoolExecutor(usable()) as workers:
        for words, lay_out in ways.items():
            diagnosis = diagnose(runs.runs, runs.spec, catalogue(), workers, lay_out=lay_out)
            if lay_out is not None and not diagnosis.found:
                break
            stated = as_json(diagnosis)
            claimed = "; ".join(" or ".join(one["effects"]) for one in stated["sets"]) or "nothing"
            for one in stated["ladder"]:
                head = (
                    [ship.name, words, stated["verdict"].replace("_", " "), claimed] if one["step"] == 0 else [""] * 4
                )
                rows.append([*head, *rung_row(stated, one)])
            print(" | ".join(rows[-1]), flush=True)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    given = parser.parse_args()
    rows = [row for make in (measured_ships.tank, measured_ships.pond) for row in _rows(make(given.data))]
    lines = [
        f"One row in {_ROW_S:g} s of the towing tank's and the pond's logs. A ship that stands once is laid out with "
        "the instants as they are taken: what is found lies farther off than the rows allow, or too little is gained.",
        "",
        *result_page.table(["ship", "instants", "verdict", "claimed", *LADDER], rows),
    ]
    result_page.write("diagnose.slow_rows", "Measured logs, a row a second: the diagnosis", lines)


if __name__ == "__main__":
    main()
