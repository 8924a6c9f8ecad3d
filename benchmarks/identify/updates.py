"""How far a pooled fit that is brought forward log by log lies from one of all logs anew, ship by ship.

The first runs of a ship are fitted together, then one after the other is added as the nightly run does; beside it all
are fitted anew. Simulated ships are sailed as in the standard trial, on a day of its own each; the others are those of
``../shared``, where there: measured ones, and logs of ships whose model lacks something.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np

from benchmarks import measured_ships, result_page
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.errors_of_fit import errors_of
from kempf.flows.jobs.identify.update_model import FEWEST, GROWN
from kempf.flows.jobs.identify.vessel_runs import VesselRuns, assembled
from kempf.flows.jobs.ingest.ingest_logs import ingest_log
from kempf.flows.process.cores import usable
from kempf.pipeline.diagnose.screening.staged import staged
from kempf.pipeline.estimate.agreement import agreement_of
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.pooled_uncertainty import uncertainty_of
from kempf.pipeline.estimate.posterior import Posterior, posterior_of
from kempf.pipeline.estimate.updated import Updated, updated
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.warehouse.storage.store import Warehouse

_DAY_NS = 86_400_000_000_000
#: Hulls, and the rate at which their logs repeat what the instruments said last, Hz: the slower, the less is known of
#: the instants of measurement.
SIMULATED = (
    *((hull, 10.0) for hull in ("mariner", "container", "tanker", "ferry", "usv")),
    *((hull, 2.0) for hull in ("mariner", "container", "tanker", "ferry")),
)


@dataclass(frozen=True)
class Outcome:
    """One ship: a fit of all her runs, and one of the first ones brought forward to as many."""

    ship: str
    first: int
    runs: int
    #: Whether both found the same lasting noise.
    same_model: bool
    #: How often all had to be fitted anew on the way.
    anew: int
    #: Largest difference of a hull parameter, in its standard error; ratio of standard errors farthest from one.
    off_std: float
    widest: float
    #: Log-likelihood of the others' runs at both, the fit of all less the other.
    agrees: tuple[float, float]
    #: Processor seconds of the last run's update, of all fitted anew.
    seconds: tuple[float, float]


def _left(fit: PooledFit) -> Posterior:
    errors = errors_of(fit, uncertainty_of(fit))
    return posterior_of(fit, errors.fit, errors.together, agreement_of(fit), fit.log_likelihood, errors.late)


def _left_then(made: Updated) -> Posterior:
    errors = errors_of(made.fit, made.known, made.step)
    return posterior_of(made.logged, errors.fit, errors.together, made.agreement, made.log_likelihood, errors.late)


def _anew(runs: VesselRuns, count: int, workers: Executor) -> PooledFit:
    return staged(runs.runs[:count], runs.spec, (), workers)[1][-1]


def compare(ship: str, runs: VesselRuns, first: int, last: int, workers: Executor) -> Outcome:
    """Bring a fit of some runs forward to more, and fit all of these."""
    fit = _anew(runs, first, workers)
    left, model, anew, took = _left(fit), fit.model, 0, 0.0
    for count in range(first, last):
        began = process_time()
        made = updated(left, model, [runs.runs[count]], runs.spec, workers)
        took = process_time() - began
        if made is None:
            fit = _anew(runs, count + 1, workers)
            left, model, anew = _left(fit), fit.model, anew + 1
        else:
            left = _left_then(made)
    began = process_time()
    whole = _anew(runs, last, workers)
    took_whole = process_time() - began
    known = _left(whole)
    std = np.sqrt(np.diag(known.stated)[:6])
    ratio = np.sqrt(np.diag(left.stated)[:6]) / std
    off = float(np.max(np.abs(left.point[:6] - known.point[:6]) / std))
    widest = float(ratio[np.argmax(np.abs(np.log(ratio)))])
    same = left.names == known.names
    agrees = (left.agreement.p_value, known.agreement.p_value)
    return Outcome(ship, first, last, same, anew, off, widest, agrees, (took, took_whole))


def simulated(hull: str, rate_hz: float, count: int) -> VesselRuns:
    """Sail a ship on so many days and lay the zigzags out, logged at a rate."""
    with TemporaryDirectory() as folder:
        warehouse = Warehouse(str(Path(folder) / "warehouse"))
        for day in range(count):
            angle = (10.0, 20.0)[day % 2]
            settings = zigzag_settings(hull, heading_deg=angle, rudder_deg=angle, duration_s=900.0, seed=500 + day)
            settings = replace(settings, start_utc_ns=settings.start_utc_ns + day * _DAY_NS)
            log = LogFile(to_csv(simulate_trial(settings), rate_hz=rate_hz))
            ingest_log(warehouse, hull, f"day{day}.csv.gz", log, logger_profile(settings), hull)
        return assembled(warehouse, choose(warehouse, hull), default_model_of(warehouse, hull))


def page(outcomes: Sequence[Outcome]) -> list[str]:
    """Return the lines of the page."""
    head = (
        *("ship", "fitted at once", "brought forward to", "anew on the way", "same noise"),
        *("largest difference, s.e.", "s.e. beside", "p of one hull", "processor s: one run, all anew"),
    )
    rows = [
        (
            *(one.ship, str(one.first), str(one.runs), str(one.anew), "yes" if one.same_model else "no"),
            *(f"{one.off_std:.2f}", f"{one.widest:.2f}", " and ".join(f"{p:.1g}" for p in one.agrees)),
            f"{one.seconds[0]:.2f}, {one.seconds[1]:.1f}",
        )
        for one in outcomes
    ]
    return [
        "Of the hull parameter that differs most, in standard errors of the fit of all runs; the ratio of standard "
        "errors that is farthest from one; the probability under one hull by both. All runs are fitted here, none is "
        "held out. *Anew* is how often the runs so far had to be fitted at once on the way.",
        "",
        f"The product brings forward from {FEWEST} manoeuvres on, to {GROWN:g} times as many: lines that begin with "
        "fewer show what it spares its users.",
        "",
        *result_page.table(head, rows),
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark and write its page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    parser.add_argument("--runs", type=int, default=24, help="of each simulated ship")
    asked = parser.parse_args(arguments)
    with ThreadPoolExecutor(usable()) as workers:
        outcomes = []
        for name, runs in measured_ships.every(asked.data):
            if len(runs.runs) >= 4:
                outcomes.append(compare(name, runs, len(runs.runs) // 2, len(runs.runs), workers))
                print(outcomes[-1], flush=True)
        for hull, rate_hz in SIMULATED:
            runs = simulated(hull, rate_hz, asked.runs)
            for first, last in ((2, 4), (FEWEST, int(GROWN * FEWEST))):
                if last <= len(runs.runs):
                    outcomes.append(compare(f"{hull}, simulated, {rate_hz:g} Hz", runs, first, last, workers))
                    print(outcomes[-1], flush=True)
    result_page.write("identify.updates", "Fits brought forward", page(outcomes))


if __name__ == "__main__":
    main()
