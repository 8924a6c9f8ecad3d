"""How long one hull takes that is identified from eighteen zigzags at once, their logs at 50 Hz.

A merchant ship of 160 m sails the standard trial of 900 s on eighteen days, the boat of 3 m 600 s, ten times as long in
her own time. Beside it: the same zigzags one by one, which is what a user has without pooling.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

from benchmarks import result_page
from kempf.flows.jobs.chosen_manoeuvres import choose
from kempf.flows.jobs.default_model import default_model_of
from kempf.flows.jobs.ingest_logs import ingest_log
from kempf.flows.jobs.vessel_runs import VesselRuns, assembled
from kempf.flows.process.cores import usable
from kempf.pipeline.diagnose.staged import staged
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.warehouse.store import Warehouse

_DAY_NS = 86_400_000_000_000
RATE_HZ = 50.0
#: seconds that eighteen of them may take
AIM_S = 60.0


@dataclass(frozen=True)
class Fleet:
    """What is sailed."""

    hull: str
    duration_s: float


FLEETS = (Fleet("mariner", 900.0), Fleet("usv", 600.0))


@dataclass(frozen=True)
class Took:
    """What it took."""

    hull: str
    runs: int
    #: Instants of the filter, all runs together.
    instants: int
    #: Iterations of the fit that stands; whether it converged.
    iterations: int
    converged: bool
    #: Seconds: laid out and begun, fitted together, of the processor for both; one by one.
    begun_s: float
    fitted_s: float
    processor_s: float
    single_s: float


def sailed(fleet: Fleet, count: int, folder: Path) -> Warehouse:
    """Take in a zigzag a day."""
    warehouse = Warehouse(str(folder / fleet.hull))
    for day in range(count):
        angle = (10.0, 20.0)[day % 2]
        settings = zigzag_settings(
            fleet.hull, heading_deg=angle, rudder_deg=angle, duration_s=fleet.duration_s, seed=700 + day
        )
        settings = replace(settings, start_utc_ns=settings.start_utc_ns + day * _DAY_NS)
        log = LogFile(to_csv(simulate_trial(settings), rate_hz=RATE_HZ))
        ingest_log(warehouse, fleet.hull, f"day{day}.csv.gz", log, logger_profile(settings), fleet.hull)
    return warehouse


def laid_out(warehouse: Warehouse, fleet: Fleet) -> VesselRuns:
    """Cut the zigzags out and begin each, as the nightly run does."""
    return assembled(warehouse, choose(warehouse, fleet.hull), default_model_of(warehouse, fleet.hull))


def pooled(runs: VesselRuns, workers: ThreadPoolExecutor) -> PooledFit:
    """Fit one hull to all of them."""
    return staged(runs.runs, runs.spec, (), workers)[1][-1]


def measure(fleet: Fleet, count: int, folder: Path) -> Took:
    """Measure one ship."""
    warehouse = sailed(fleet, count, folder)
    with ThreadPoolExecutor(usable()) as workers:
        began, processor = perf_counter(), process_time()
        runs = laid_out(warehouse, fleet)
        begun = perf_counter()
        fit = pooled(runs, workers)
        fitted, processor = perf_counter(), process_time() - processor
        for one in runs.runs:
            staged((one,), runs.spec, (), workers)
        single = perf_counter() - fitted
    instants = sum(one.run.measured.shape[0] for one in fit.runs)
    return Took(
        *(fleet.hull, len(runs.runs), instants, fit.iterations, fit.converged),
        *(begun - began, fitted - begun, processor, single),
    )


def page(found: Sequence[Took]) -> list[str]:
    """Return the lines of the page."""
    head = (
        *("ship", "zigzags", "instants", "iterations", "begun", "fitted together", "both"),
        *("of the processor", "one by one", "together beside one by one"),
    )
    rows = [
        (
            *(one.hull, str(one.runs), str(one.instants), f"{one.iterations}{'' if one.converged else ', no top'}"),
            *(f"{one.begun_s:.1f} s", f"{one.fitted_s:.1f} s", f"{one.begun_s + one.fitted_s:.1f} s"),
            *(f"{one.processor_s:.1f} s", f"{one.single_s:.1f} s", f"{one.fitted_s / one.single_s:.2f}"),
        )
        for one in found
    ]
    within = [one.hull for one in found if one.begun_s + one.fitted_s <= AIM_S]
    return [
        f"Logs at {RATE_HZ:g} Hz. Aim: {AIM_S:g} s for both; kept by {len(within)} of {len(found)}"
        f"{' (' + ', '.join(within) + ')' if within else ''}, on {usable()} cores.",
        "",
        *result_page.table(head, rows),
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark and write its page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=18)
    asked = parser.parse_args(arguments)
    with TemporaryDirectory() as folder:
        found = [measure(fleet, asked.runs, Path(folder)) for fleet in FLEETS]
    options = "" if asked.runs == 18 else f"--runs {asked.runs}"
    result_page.write("identify.pool_speed", "Eighteen zigzags, one hull", page(found), options=options)


if __name__ == "__main__":
    main()
