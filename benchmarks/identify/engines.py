"""The likelihood of eq. (16) three ways on the same zigzags: ``python -m benchmarks.identify.engines``.

The linear filter takes means of the readings over a grid and has its derivatives in closed form; the extended one takes
the same means, carries effects, and its derivatives are differences of passes. The linear filter at the readings'
own instants is there for comparison. How far apart are their hulls, and what does an evaluation with derivatives, and a
fit, cost? A single run without effects goes through the linear one, and pools, which are compared with models with
effects, through the extended one (decision 0094).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import TypeVar

import numpy as np

from benchmarks import measured_ships, result_page
from kempf.flows.jobs.demo.demonstrate import demonstrate
from kempf.flows.jobs.identify.parameter_set_of import arm_of
from kempf.flows.jobs.ingest.files import read_model
from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate import maximum_likelihood
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.likelihood import Likelihood
from kempf.pipeline.estimate.plain_fit import fit_plain
from kempf.pipeline.estimate.pooled_fit import DECREMENT, MAX_ITERATIONS, CommonLikelihood, PooledFit, ended
from kempf.pipeline.estimate.record import grid_run
from kempf.pipeline.estimate.record.average import step_of
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.record import Instants, Record
from kempf.pipeline.estimate.record.rudder_inflow import with_rudder_inflow
from kempf.pipeline.estimate.search.climb import Search
from kempf.pipeline.estimate.search.variances import climb_in_variances
from kempf.pipeline.estimate.uncertainty import from_information
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import segments, vessels

#: ships and runs that take part; every one of them would take an hour
SHIPS, RUNS = ("aurora", "dorado", "gannet"), ("Z_10_10_P", "Z_20_10_S", "Z_35_10_P")
_TANK = Path(__file__).parents[2] / "docs" / "models" / "tank.yaml"
_HULL = 6
T = TypeVar("T")


@dataclass(frozen=True)
class Zigzag:
    """One zigzag with all that a fit of it takes."""

    name: str
    record: Record
    instruments: Instruments
    profile: VesselProfile
    spec: ModelSpec


@dataclass(frozen=True, eq=False)
class Outcome:
    """One fit: hull and its standard errors, points in time, ms of one evaluation with derivatives and of the fit."""

    hull: Float
    std: Float
    instants: int
    evaluation_ms: float
    fit_ms: float
    converged: bool


def zigzags(data: Path) -> Iterator[Zigzag]:
    """Zigzags of the demonstration, of three ships' trials and of three runs in the tank."""
    with TemporaryDirectory() as folder:
        shown = demonstrate(Path(folder))
        yield from _of(Warehouse(str(Path(folder) / "warehouse")), shown.vessel, "demo", ModelSpec())
    for ship in [s for s in measured_ships.fleet(data) if s.name in SHIPS]:
        with TemporaryDirectory() as folder:
            measured_ships.take_in(Warehouse(folder), ship)
            yield from _of(Warehouse(folder), ship.name, ship.name, ModelSpec())
    tank = measured_ships.tank(data)
    with TemporaryDirectory() as folder:
        logs = tuple(path for path in tank.logs if any(name in path.stem for name in RUNS))
        measured_ships.take_in(Warehouse(folder), replace(tank, logs=logs))
        yield from _of(Warehouse(folder), tank.name, "tank", read_model(_TANK))


def _of(warehouse: Warehouse, vessel: str, title: str, spec: ModelSpec) -> Iterator[Zigzag]:
    profile = vessels.current(warehouse, vessel)
    for number, segment in enumerate(segments.current(warehouse, vessel), start=1):
        instruments = channels_of(warehouse, segment.ingest_id)
        record = make_record(instruments, segment.start_utc_ns, segment.end_utc_ns)
        ready = spec.with_arm(arm_of(spec, profile))
        yield Zigzag(
            f"{title} {number}, {segment.psi0_deg:g}/{segment.delta0_deg:g}", record, instruments, profile, ready
        )


def linear(one: Zigzag, instants: Instants) -> Outcome:
    """Fit by the linear filter."""
    arm, settings = arm_of(one.spec, one.profile) or 0.0, maximum_likelihood.STANDARD
    given = with_rudder_inflow(instants, one.spec)

    def search() -> tuple[Likelihood, Search[Float]]:
        return maximum_likelihood.search(given, one.spec, arm, settings)[:2]

    search()  # compiled
    (objective, best), fit_ms = _timed(search)
    _, evaluation_ms = _timed(lambda: objective.full(best.theta))
    index = np.flatnonzero(np.diag(best.information) > 0.0)
    std = np.sqrt(np.diag(from_information(best.information, index).covariance)[:_HULL])
    return Outcome(best.theta[:_HULL], std, given.time_s.size, evaluation_ms, fit_ms, best.converged)


class Extended(CommonLikelihood):
    """The plain model through the extended filter."""

    def __init__(self, filtered: Sequence[RunFilter], workers: Executor) -> None:
        super().__init__(filtered, workers)
        self.linear = ()


def extended(one: Zigzag) -> Outcome:
    """Climb by the extended filter from where the linear one ended on the same means."""
    with ThreadPoolExecutor(max_workers=1) as workers:
        plain = fit_plain([grid(one)], one.spec, workers).fit
        theta = np.concatenate([plain.hull, plain.levels[0]])

        def fit() -> PooledFit:
            layout = Extended(plain.runs, workers)
            return ended(layout, climb_in_variances(layout, theta, MAX_ITERATIONS, DECREMENT))

        fit()
        best, fit_ms = _timed(fit)
        there = np.concatenate([best.hull, best.levels[0]])
        _, evaluation_ms = _timed(lambda: Extended(plain.runs, workers).full(there))
    return Outcome(
        best.hull, best.std[:_HULL], plain.runs[0].run.measured.shape[0], evaluation_ms, fit_ms, best.converged
    )


def grid(one: Zigzag) -> grid_run.GridRun:
    """Lay a zigzag on the grid."""
    length, arm = one.profile.length_m or 100.0, arm_of(one.spec, one.profile) or 0.0
    ship = grid_run.ShipConstants(length, one.profile.draught_m or 1.0, arm)
    step = step_of([one.record], one.profile.length_m)
    return grid_run.make_run(one.name, one.record, one.instruments, one.spec, ship, step)


def _timed(work: Callable[[], T]) -> tuple[T, float]:
    times = []
    for _ in range(3):
        begin = process_time()
        done = work()
        times.append(process_time() - begin)
    return done, 1e3 * float(np.median(times))


def page(outcomes: list[tuple[Zigzag, Outcome, Outcome, Outcome]]) -> list[str]:
    """Lines of the page."""
    rows, farthest = [], []
    for one, own, means, ekf in outcomes:
        far = [np.max(np.abs(a.hull - b.hull) / own.std) for a, b in ((means, own), (ekf, means))]
        farthest.append(far)
        rows.append(
            [
                one.name,
                *(f"{o.instants}" for o in (own, means, ekf)),
                *(f"{o.evaluation_ms:.1f}" for o in (own, means, ekf)),
                *(f"{o.fit_ms:.0f}" for o in (own, means)),
                *(f"{x:.2f}" for x in far),
                "yes" if all(o.converged for o in (own, means, ekf)) else "**no**",
            ]
        )
    head = ["zigzag", "instants: own", "means", "grid", "evaluation, ms: linear, own instants", "linear, means"]
    head += ["extended, means", "fit, ms: linear, own instants", "linear, means"]
    head += ["hull apart, s.e.: means from own instants", "extended from linear, means", "all converged"]

    def ratio(attribute: str, k: int) -> float:
        return float(np.median([getattr(o[k], attribute) / getattr(o[1], attribute) for o in outcomes]))

    middle = np.median(np.array(farthest), axis=0)
    slower = [ratio("evaluation_ms", 2), ratio("evaluation_ms", 3), ratio("fit_ms", 2)]
    return [
        f"Median over {len(outcomes)} zigzags, beside the linear filter at the measurements' own instants: an "
        f"evaluation with derivatives takes {slower[0]:.2f} times as long by the linear filter on means "
        f"and {slower[1]:.2f} times by the extended one; a fit on means {slower[2]:.2f} times. "
        f"The farthest of the six parameters is {middle[0]:.2f} standard errors away on means, and by the extended "
        f"filter another {middle[1]:.3f}. Pools, which are compared with models with effects, go through the extended "
        "one; a single run through the linear one, which also takes readings at their own instants.",
        "",
        *result_page.table(head, rows),
        "",
        "Times are those of the processor in one thread, median of three, warm.",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    options = parser.parse_args()
    outcomes = []
    for one in zigzags(options.data):
        outcomes.append((one, linear(one, one.record), linear(one, grid(one).instants()), extended(one)))
        print(one.name, flush=True)
    path = result_page.write("identify.engines", "One likelihood, two filters", page(outcomes))
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
