"""The ladder of the measured model on a pond: wind, shaft and a hull that hide each other."""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks import measured_ships, result_page
from benchmarks.diagnose.diagnosed import section
from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_vessel
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.warehouse.storage.store import Warehouse


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=Path(__file__).parents[3] / "shared")
    ship = measured_ships.pond(parser.parse_args().data)
    with TemporaryDirectory() as folder:
        warehouse = Warehouse(folder)
        measured_ships.take_in(warehouse, ship)
        found = diagnose_vessel(warehouse, ship.name, default_model_of(warehouse, ship.name))[0].as_json()
    lines = [
        f"{len(found['fitted'])} manoeuvres fitted, {len(found['held_out'])} held out before anything was looked at: "
        "zigzags and random manoeuvres. The model is the one that her profile's surroundings choose.",
        "",
    ]
    result_page.write("diagnose.pond_ladder", "Pond runs: the ladder", [*lines, *section(found)])


if __name__ == "__main__":
    main()
