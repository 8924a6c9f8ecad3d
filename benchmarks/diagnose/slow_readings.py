"""A quick ship without any effect whose instruments are read seldom: what a diagnosis makes of her.

What she does between two readings is not in the logs, and what that leaves of a misfit is no missing physics
(decision 0112); nor is what goes with the noise of a speed log (decision 0113). A boat of 3 m sails two zigzags on each
of two days, or of six; instruments stamp their readings, or a table has rows of as many a second.
"""

from __future__ import annotations

import argparse
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks import measured_ships, result_page
from benchmarks.diagnose.diagnosed import CLAIMED, outcome_of
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.vessel_runs import LENGTH_M, VesselRuns, layout_of
from kempf.flows.jobs.ingest.ingest_logs import ingest_log
from kempf.flows.process.cores import usable
from kempf.pipeline.diagnose.screening.found_instants import fitted_runs
from kempf.pipeline.diagnose.screening.resolution import unresolved
from kempf.pipeline.diagnose.screening.ridge_reference import ridge_reference_of
from kempf.pipeline.diagnose.screening.speed_noise import speed_noise
from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis, diagnose
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.trial import Trial, TrialSettings, simulate_trial, zigzag_settings
from kempf.schemas.effects import catalogue
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.units import DAY_NS
from kempf.warehouse.storage.store import Warehouse

_HULL, _RATES_HZ, _BASE_HZ = "usv", (1.0, 2.0, 5.0, 10.0), 10.0
#: which instruments have the rate; the others have ten readings a second; none: rows of a table, all of it
_SLOW: dict[str, tuple[str, ...]] = {
    "every instrument": ("gnss", "heading", "yaw_rate", "rudder", "log", "wind", "shaft", "depth", "roll"),
    "the rudder": ("rudder",),
    "the heading": ("heading",),
    "the rate gyro": ("yaw_rate",),
    "the GNSS": ("gnss",),
    "the log": ("log",),
    "the log, on six days": ("log",),
    "the log, of three times the noise": ("log",),
    "rows of a table": (),
}
_NOISY, _DAYS = {"the log, of three times the noise": 3.0}, {"the log, on six days": 6}
_OUTCOMES = ("insufficient_data", "adequate", "unexplained")


@dataclass(frozen=True)
class _Case:
    slow: str
    rate_hz: float
    seed: int


def _settings(case: _Case, day: int) -> TrialSettings:
    first, second = (
        zigzag_settings(
            _HULL,
            heading_deg=deg,
            rudder_deg=deg,
            first_side="starboard" if deg == 20.0 else "port",
            duration_s=60.0,
            steady_s=10.0,
            seed=10 * case.seed + day,
        )
        for deg in (20.0, 10.0)
    )
    slow = _SLOW[case.slow]
    instruments = tuple(
        replace(
            one,
            rate_hz=case.rate_hz if one.name in slow else _BASE_HZ,
            jitter_s=0.01,
            noise={
                what: std * (_NOISY.get(case.slow, 1.0) if one.name == "log" else 1.0)
                for what, std in one.noise.items()
            },
        )
        for one in first.instruments
    )
    return replace(
        first,
        programme=(*first.programme, *second.programme),
        instruments=instruments,
        start_utc_ns=first.start_utc_ns + day * DAY_NS,
        heading_deg=90.0 * day,
    )


def _log_of(case: _Case, trial: Trial) -> tuple[str, bytes]:
    if _SLOW[case.slow]:
        return "mcap", to_mcap(trial)
    return "csv.gz", to_csv(trial, rate_hz=case.rate_hz)


def _outcomes(case: _Case) -> tuple[str, str]:
    """Return the verdict, and what it would be were the readings close enough."""
    with TemporaryDirectory() as folder, ThreadPoolExecutor(1) as workers:
        warehouse = Warehouse(folder)
        for day in range(_DAYS.get(case.slow, 2)):
            trial = simulate_trial(_settings(case, day))
            ending, data = _log_of(case, trial)
            profile = logger_profile(trial.settings)
            ingest_log(warehouse, _HULL, f"day{day}.{ending}", LogFile(data), profile, _HULL)
        layout = layout_of(warehouse, choose(warehouse, _HULL), ModelSpec())
        runs = layout.runs()
        found = diagnose(runs.runs, runs.spec, catalogue(), workers, lay_out=layout.runs_at)
        return outcome_of(found), outcome_of(_were_it_resolved(found))


def _were_it_resolved(found: Diagnosis) -> Diagnosis:
    if found.unresolved is None or found.something_left:
        return replace(found, unresolved=None)
    return replace(found, unresolved=None, steps=(*found.steps, *found.imitating), imitating=())


def _simulated(cases: int) -> list[list[str]]:
    asked = [_Case(slow, rate, seed) for slow, rate, seed in product(_SLOW, _RATES_HZ, range(1, cases + 1))]
    counts: dict[tuple[str, float], tuple[Counter[str], Counter[str]]] = {}
    with ProcessPoolExecutor(usable()) as pool:
        for case, outcomes in zip(asked, pool.map(_outcomes, asked), strict=True):
            both = counts.setdefault((case.slow, case.rate_hz), (Counter(), Counter()))
            for count, outcome in zip(both, outcomes, strict=True):
                count[outcome] += 1
            print(case, *outcomes, flush=True)
    return [
        [slow, f"{rate:g}", *(cell for count in both[::-1] for cell in _cells(count))]
        for (slow, rate), both in counts.items()
    ]


def _cells(count: Counter[str]) -> list[str]:
    claims = [
        f"{number} {one.removeprefix(CLAIMED)}" for one, number in sorted(count.items()) if one.startswith(CLAIMED)
    ]
    return [*(str(count[one]) for one in _OUTCOMES), "; ".join(claims)]


def _measured(data: Path) -> tuple[list[list[str]], list[list[str]]]:
    """Return how far apart the readings of measured ships are, and what the noise of their logs does."""
    ships = dict(measured_ships.every(data))
    noisy = [[name, *_by_noise(laid_out)] for name, laid_out in ships.items() if len(laid_out.runs) > 1]
    for make in (measured_ships.tank, measured_ships.pond):
        ship = make(data)
        ships[f"{ship.name}, a row a second"] = measured_ships.thinned(ship, 1.0).runs()
    rows = []
    for name, laid_out in ships.items():
        periods = [max(run.rudder_period_s, run.heading_period_s) for run in laid_out.runs]
        shares = [one * run.approach_m_s / run.ship.length_m for one, run in zip(periods, laid_out.runs, strict=True)]
        found = unresolved(laid_out.runs)
        apart = ", ".join(sorted({f"{one:.2g}" for one in periods}))
        known = laid_out.runs[0].ship.length_m != LENGTH_M
        part = f"{min(shares):.2g} to {max(shares):.2g}" if known else "her length is not known"
        rows.append([name, apart, part, "no" if found else "yes" if known else "taken to be"])
        print(*rows[-1], flush=True)
    return rows, noisy


def _by_noise(laid_out: VesselRuns) -> tuple[str, str]:
    """Return what the noise of the log does at most in a manoeuvre, and what the flexible reference gains."""
    with ThreadPoolExecutor(usable()) as workers:
        fit = fitted_runs(laid_out.runs, laid_out.spec, (), workers).fits[-1]
        most = max(float(column @ column) for column in speed_noise(fit, workers).columns)
        gain = ridge_reference_of(fit, workers).gain
    print(most, gain, flush=True)
    return f"{most:.2g}", f"{gain:.1f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    parser.add_argument("--cases", type=int, default=2, help="of every rate")
    given = parser.parse_args()
    head = [f"{when}: {one}" for when in ("before", "now") for one in ("not testable", *_OUTCOMES[1:], "a claim")]
    # its processes are forked, before anything here has threads
    simulated = _simulated(given.cases)
    apart, noisy = _measured(given.data)
    lines = [
        f"{given.cases} boats of every kind, none with an effect; the rest of the instruments gives "
        f"{_BASE_HZ:g} readings a second. Before is what a verdict was without regard to the time between readings.",
        "",
        "Rows hold the last reading of each instrument, so that heading and rate of turn are of instants up to 0.1 s "
        "apart, and nothing in a table shows it: latencies of less than that are in the logs, not in the ship.",
        "",
        *result_page.table(["slow is", "readings a second", *head], simulated),
        "",
        "## Measured ships",
        "",
        "Time between readings of rudder or heading, whichever is longer, and that as a part of the time in which she "
        "sails her length, over the manoeuvres. The trial logs are simulated.",
        "",
        *result_page.table(["ship", "s between readings", "part of a length", "resolved"], apart),
        "",
        "What of the speed's changes may be noise of the log: what a standard deviation of that does to the whitened "
        "innovations of a manoeuvre, squared and summed, in the manoeuvre that has most of it; and the log-likelihood "
        "that the flexible reference gains beside the plain model, allowing for it.",
        "",
        *result_page.table(["ship", "by noise of the log", "reference"], noisy),
    ]
    result_page.write("diagnose.slow_readings", "Readings too far apart for a quick ship", lines)


if __name__ == "__main__":
    main()
