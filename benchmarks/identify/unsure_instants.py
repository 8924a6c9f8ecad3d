"""What is gained where instants of measurement are found with the hull: simulated ships, then every log at hand.

A log whose rows repeat the last value of every instrument does not say when it was measured, nor does one whose stamps
several sentences share. The simulated ships carry instruments whose clocks nobody has set by these; their hulls are
known. Of the others it is shown what moves: the hull, its errors, and the free runs. Logs are those of ``../shared``,
where there.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import astuple, dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks import measured_ships, result_page
from benchmarks.identify.prediction import plain_ship
from benchmarks.ingest.restamped import burst, restamped, whole_second
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.vessel_runs import VesselRuns, assembled
from kempf.flows.process.cores import usable
from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.unsure_instants import with_instants
from kempf.pipeline.estimate.plain_fit import fit_plain
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.predict.free_run import free_run_of
from kempf.pipeline.simulate.nmea_log import to_nmea
from kempf.schemas.confidence import NORMAL_95
from kempf.schemas.errors import KempfError
from kempf.schemas.model_spec import HULL_PARAMETERS

_SHIPS = 40
#: Fields of `InstantErrors`.
_CLOCKS = ("velocity_s", "heading_s", "yaw_rate_s", "rudder_s", "smoothing_s")
#: Rows a second: as fast as data acquisition writes them, as fast as a compass, slower than one, as slow as a receiver.
_RATES_HZ = (10.0, 5.0, 2.0, 1.0)
_IN_ROWS = {f"rows of {rate_hz:g} Hz": plain_ship.in_rows(rate_hz) for rate_hz in _RATES_HZ}
#: NMEA 0183, by what the logger writes in front of a sentence: the instant of its arrival, the second in which it
#: came, when it last looked (once a second), and nothing.
_IN_SENTENCES = {
    "stamps of milliseconds": ("trial.nmea.gz", to_nmea),
    "stamps of whole seconds": ("trial.nmea", partial(restamped, stamp=whole_second)),
    "bursts of a second": ("trial.nmea", partial(restamped, stamp=burst)),
    "no stamps": ("trial.nmea", partial(restamped, stamp=None)),
}
_LOGS: dict[str, plain_ship.Written] = {**_IN_ROWS, **_IN_SENTENCES}


@dataclass(frozen=True, eq=False)
class Outcome:
    """One ship, with instants as they are taken and with instants free."""

    name: str
    #: How many runs there are, and how many are of logs whose instants are not known.
    runs: int
    unsure: int
    #: Standard error of the instants of each instrument, s, the largest of the runs.
    errors_s: dict[str, float]
    #: fixed, free: Shape (6,). Hull with instants as they are taken and with instants free.
    fixed: Float
    free: Float
    #: fixed_std, free_std: Shape (6,). Their standard errors.
    fixed_std: Float
    free_std: Float
    #: Shape (runs, 2). Errors of the free runs of both, shares of the measured ones.
    free_runs: Float


def outcome(name: str, runs: VesselRuns, workers: Executor) -> Outcome:
    """Fit the plain model to a ship's runs."""
    fit = fit_plain(runs.runs, runs.spec, workers).fit
    found = with_instants(fit, workers)
    errors = {clock: max(getattr(run.instant_errors, clock) for run in runs.runs) for clock in _CLOCKS}
    return Outcome(
        name=name,
        runs=len(runs.runs),
        unsure=sum(not run.instant_errors.known for run in runs.runs),
        errors_s=errors,
        fixed=fit.hull,
        free=found.fit.hull,
        fixed_std=fit.std[: len(HULL_PARAMETERS)],
        free_std=np.sqrt(np.diag(fit.covariance + found.covariance))[: len(HULL_PARAMETERS)],
        free_runs=np.column_stack([_free_runs(fit), _free_runs(found.fit)]),
    )


def _free_runs(fit: PooledFit) -> list[float]:
    return [free_run_of(filtered, fit.hull, fit.values).relative_error for filtered in fit.runs]


def simulated(number: int, written: plain_ship.Written, workers: Executor) -> tuple[Outcome, Float]:
    """Return a simulated ship, and the hull that she truly has, shape (6,)."""
    hull, _ = plain_ship.drawn(number)
    with TemporaryDirectory() as folder:
        warehouse = plain_ship.taken_in(hull, number, Path(folder), written)
        runs = assembled(warehouse, choose(warehouse, hull.name), default_model_of(warehouse, hull.name))
    return outcome(hull.name, runs, workers), np.array(astuple(hull.parameters))


def measured(data: Path, workers: Executor) -> Iterator[Outcome]:
    """Fit every ship at hand that can be fitted."""
    for name, runs in measured_ships.every(data):
        try:
            yield outcome(name, runs, workers)
        except KempfError as error:
            print(f"{name}: {error.message}")


def thinned(data: Path, workers: Executor) -> Iterator[Outcome]:
    """Fit the measured ships from one row a second of their logs."""
    for make in (measured_ships.tank, measured_ships.pond):
        try:
            ship = make(data)
        except KempfError as error:
            print(error.message)
            continue
        yield outcome(ship.name, measured_ships.thinned(ship, 1.0).runs(), workers)


def page(
    ships: Mapping[str, Sequence[tuple[Outcome, Float]]], others: Sequence[Outcome], slow: Sequence[Outcome]
) -> list[str]:
    """Return the lines of the page."""
    inside, rms = [], []
    for log, of_log in ships.items():
        true = np.array([hull for _, hull in of_log])
        for words, found in (
            ("as they are taken", [(one.fixed, one.fixed_std) for one, _ in of_log]),
            ("free", [(one.free, one.free_std) for one, _ in of_log]),
        ):
            hull, std = np.array(found).swapaxes(0, 1)
            within, error = np.abs(hull - true) < NORMAL_95 * std, np.sqrt(np.mean((hull / true - 1.0) ** 2, axis=0))
            inside.append([log, words, *(f"{100.0 * np.mean(part):.0f} %" for part in (*within.T, within))])
            rms.append([log, words, *(f"{100.0 * x:.2f} %" for x in error)])
    head = ["log", "instants", *HULL_PARAMETERS, "all"]
    lines = [
        f"## {len(next(iter(ships.values())))} simulated ships",
        "",
        "A 20/20 and a 10/10 zigzag in wind and stream, with instruments of 1 to 5 Hz whose clocks stand anywhere in a "
        "row or a second: logged in rows, and as NMEA 0183 by what stands in front of a sentence. 95 % intervals of "
        "the hull that hold the truth:",
        "",
        *result_page.table(head, inside),
        "",
        "How far the hull is off, root mean square:",
        "",
        *result_page.table(head[:-1], rms),
        "",
        "## Every log at hand",
        "",
        "The plain model. Where every reading has its own instant, or fast rows do not repeat values, nothing moves.",
        "",
    ]
    columns = (
        *("ship", "runs", "of these unsure", "instants known to, s: velocity, heading, yaw rate, rudder, smoothing"),
        *("hull moved by at most, s.e.", "errors wider by at most", "free run, best: before, after", "worst"),
    )
    return [
        *lines,
        *result_page.table(columns, [_row(one) for one in others]),
        "",
        "## Measured logs, a row a second",
        "",
        "Models of 7 and 3 m, which answer within a second or two, were measured at their rows; of one row a second "
        "nobody can tell. Free runs, mean over the runs, with instants as they are in the rows and with instants free: "
        f"{'; '.join(_means(one) for one in slow)}.",
        "",
        *result_page.table(columns, [_row(one) for one in slow]),
    ]


def _means(one: Outcome) -> str:
    before, after = 100.0 * np.mean(one.free_runs, axis=0)
    return f"{one.name} {before:.1f} % and {after:.1f} %"


def _row(one: Outcome) -> tuple[str, ...]:
    best, worst = (one.free_runs[pick(one.free_runs[:, 0])] for pick in (np.argmin, np.argmax))
    moved = float(np.max(np.abs(one.free - one.fixed) / one.fixed_std))
    return (
        *(one.name, str(one.runs), str(one.unsure)),
        ", ".join(f"{std:.3f}" for std in one.errors_s.values()) if one.unsure else "as logged",
        f"{moved:.2f}",
        f"{float(np.max(one.free_std / one.fixed_std)):.2f}",
        *(f"{100.0 * before:.1f} %, {100.0 * after:.1f} %" for before, after in (best, worst)),
    )


def main() -> None:
    """Fit the ships and write ``results/unsure_instants.md``."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ships", type=int, default=_SHIPS)
    parser.add_argument("--data", type=Path, default=Path("../shared"))
    given = parser.parse_args()
    with ThreadPoolExecutor(usable()) as workers:
        ships: dict[str, list[tuple[Outcome, Float]]] = {}
        for log, written in _LOGS.items():
            for number in range(given.ships):
                ships.setdefault(log, []).append(simulated(number, written, workers))
                print(f"{log}: {number + 1} of {given.ships} simulated ships", flush=True)
        others = []
        for one in measured(given.data, workers):
            others.append(one)
            print(" | ".join(_row(one)), flush=True)
        slow = list(thinned(given.data, workers))
    options = f"--ships {given.ships}" if given.ships != _SHIPS else ""
    title = "Unsure instants: found with the hull"
    result_page.write("identify.unsure_instants", title, page(ships, others, slow), options=options)


if __name__ == "__main__":
    main()
