"""Ships without any effect whose log has coarse stamps, or none: what a diagnosis makes of them.

What instruments do to each other within a second that nobody knows is no missing physics (decision 0114). Each ship
sails two zigzags on each of two days; her logs are NMEA 0183. Before, instants were taken for exact.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import product
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks import result_page
from benchmarks.diagnose.diagnosed import CLAIMED, outcome_of
from benchmarks.identify.prediction.plain_ship import two_zigzags, unset_clocks
from benchmarks.ingest.restamped import Stamp, burst, restamped, whole_second
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.vessel_runs import layout_of
from kempf.flows.jobs.ingest.ingest_logs import ingest_log
from kempf.flows.process.cores import usable
from kempf.pipeline.channels.instant_errors import IN_THE_LOG
from kempf.pipeline.diagnose.verdicts.diagnosis import diagnose
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.trial import TrialSettings, simulate_trial, zigzag_settings
from kempf.schemas.effects import catalogue
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.units import DAY_NS
from kempf.warehouse.storage.store import Warehouse

_SHIPS = ("mariner", "container", "tanker", "ferry")
_STAMPS: dict[str, Stamp | None] = {"whole seconds": whole_second, "bursts of a second": burst, "no stamps": None}


@dataclass(frozen=True)
class _Case:
    stamps: str
    hull: str
    seed: int


def _settings(case: _Case, day: int) -> TrialSettings:
    first = zigzag_settings(case.hull, seed=10 * case.seed + day)
    # a receiver measures on the second
    receiver, *others = first.instruments
    return replace(
        first,
        programme=two_zigzags(HULLS[case.hull]),
        instruments=(receiver, *unset_clocks(others, np.random.default_rng([20061, case.seed, day]))),
        start_utc_ns=first.start_utc_ns + day * DAY_NS,
        heading_deg=90.0 * day,
    )


def _outcomes(case: _Case) -> tuple[str, str]:
    """Return what a diagnosis comes to with instants taken for exact, and as they are known."""
    with TemporaryDirectory() as folder, ThreadPoolExecutor(1) as workers:
        warehouse = Warehouse(folder)
        for day in range(2):
            trial = simulate_trial(_settings(case, day))
            log = LogFile(restamped(trial, _STAMPS[case.stamps]))
            ingest_log(warehouse, case.hull, f"day{day}.nmea", log, logger_profile(trial.settings), case.hull)
        layout = layout_of(warehouse, choose(warehouse, case.hull), ModelSpec())
        runs = layout.runs()
        exact = [replace(run, instant_errors=IN_THE_LOG) for run in runs.runs]
        before = diagnose(exact, runs.spec, catalogue(), workers)
        found = diagnose(runs.runs, runs.spec, catalogue(), workers, lay_out=layout.runs_at)
        return outcome_of(before), outcome_of(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=2, help="of every ship and kind of stamp")
    given = parser.parse_args()
    asked = [_Case(*one) for one in product(_STAMPS, _SHIPS, range(1, given.cases + 1))]
    rows = []
    with ProcessPoolExecutor(usable()) as pool:
        for case, outcomes in zip(asked, pool.map(_outcomes, asked), strict=True):
            rows.append([case.stamps, case.hull, *outcomes])
            print(*rows[-1], flush=True)
    found = {
        when: [sum(row[column].startswith(CLAIMED) for row in rows), sum(row[column] == "unexplained" for row in rows)]
        for when, column in (("before", 2), ("now", 3))
    }
    counts = "; ".join(f"{when} {claimed} claims and {left} `unexplained`" for when, (claimed, left) in found.items())
    lines = [
        f"{len(rows)} diagnoses of simulated ships without an effect, four zigzags each: {counts}. Before, instants "
        "were taken for exact.",
        "",
        *result_page.table(["NMEA behind", "ship", "before", "now"], rows),
    ]
    options = f"--cases {given.cases}" if given.cases != parser.get_default("cases") else ""
    result_page.write("diagnose.coarse_stamps", "Coarse stamps: the diagnosis", lines, options=options)


if __name__ == "__main__":
    main()
