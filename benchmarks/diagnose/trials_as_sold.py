"""Six ships with instruments as they are sold, some of which lack two effects: what the program concludes for each."""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks import measured_ships, result_page
from benchmarks.diagnose.trials_diagnosis import conclude


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    ships = measured_ships.fleet(parser.parse_args().data, "trials_as_sold")
    conclude("diagnose.trials_as_sold", "Six trial ships with instruments as they are sold", ships)


if __name__ == "__main__":
    main()
