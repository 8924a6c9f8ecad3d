"""The two likelihoods of eq. (16) on the same zigzags: ``python -m benchmarks.identify.engines``.

The linear filter takes every measurement at its own instant and has its derivatives in closed form; the extended one,
which carries effects, takes means over a grid and differences of passes. How far apart are their hulls, and what does
one evaluation with derivatives, and one fit, cost? Between them stands the linear filter on the means of the grid.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import TypeVar

import numpy as np

from benchmarks import measured_ships, result_page
from kempf.flows.jobs.demonstrate import demonstrate
from kempf.flows.jobs.files import read_model
from kempf.flows.jobs.log_channels import channels_of
from kempf.flows.jobs.parameter_set_of import arm_of
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate import maximum_likelihood, pooled_fit
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings
from kempf.pipeline.estimate.pooled_fit import CommonLikelihood
from kempf.pipeline.estimate.record import grid_run
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.record.rudder_inflow import with_rudder_inflow
from kempf.pipeline.estimate.search.pooled_start import start_of
from kempf.pipeline.estimate.uncertainty import from_information
from kempf.pipeline.model import effect_model
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse import segments, vessels
from kempf.warehouse.store import Warehouse

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


def linear(one: Zigzag, record: Record) -> Outcome:
    """Fit by the linear filter."""
    arm, settings = arm_of(one.spec, one.profile) or 0.0, MaximumLikelihoodSettings()
    given = with_rudder_inflow(record, one.spec)

    def search() -> tuple[maximum_likelihood.Likelihood, maximum_likelihood.Search[Float]]:
        return maximum_likelihood.search(given, one.spec, arm, settings)[:2]

    search()  # compiled
    (objective, best), fit_ms = _timed(search)
    _, evaluation_ms = _timed(lambda: objective.full(best.theta))
    index = np.flatnonzero(np.diag(best.information) > 0.0)
    std = np.sqrt(np.diag(from_information(best.information, index).covariance)[:_HULL])
    return Outcome(best.theta[:_HULL], std, given.time_s.size, evaluation_ms, fit_ms, best.converged)


def extended(one: Zigzag) -> Outcome:
    """Fit by the extended filter on the grid, from where the fits of a diagnosis begin."""
    run = grid(one)
    with ThreadPoolExecutor(max_workers=1) as workers:

        def fit() -> pooled_fit.PooledFit:
            start = start_of([one.record], [run], one.spec, [0], workers)
            nothing = np.zeros(0)
            return pooled_fit.fit(
                effect_model.EffectModel(), [run], one.spec, start.hull, start.levels, nothing, workers
            )

        fit()
        found, fit_ms = _timed(fit)
        theta = np.concatenate([found.hull, found.levels[0]])
        _, evaluation_ms = _timed(lambda: CommonLikelihood(found.runs, workers).full(theta))
    return Outcome(found.hull, found.std[:_HULL], run.measured.shape[0], evaluation_ms, fit_ms, found.converged)


def grid(one: Zigzag) -> grid_run.GridRun:
    """Lay a zigzag on the grid of the extended filter."""
    length, arm = one.profile.length_m or 100.0, arm_of(one.spec, one.profile) or 0.0
    ship = grid_run.ShipConstants(length, one.profile.draught_m or 1.0, arm)
    step = grid_run.step_of([one.record], length)
    return grid_run.make_run(one.name, one.record, one.instruments, one.spec, ship, step)


def averaged(one: Zigzag) -> Record:
    """Return the record of a zigzag with the means of the grid, each at the mean instant of its readings."""
    run, record = grid(one), one.record
    own = [run.time_s + run.offset_s[:, i] for i in range(3)]
    made = [np.isfinite(run.measured[:, i]) for i in range(3)]
    fine = run.fine_time_s[::2]
    time = np.unique(np.concatenate([fine, *(t[m] for t, m in zip(own, made, strict=True))]))
    time = time[(time >= 0.0) & (time <= record.time_s[-1])]
    measured = np.full((time.size, 3), np.nan)
    for i in range(3):
        there = np.searchsorted(time, own[i][made[i]])
        inside = there < time.size
        measured[there[inside], i] = run.measured[made[i], i][inside]
    known = np.isfinite(record.heading_rad)

    def laid(column: Float) -> Float:
        return np.interp(time, record.time_s, column)

    return replace(
        record,
        time_s=time,
        speed_m_s=laid(record.speed_m_s),
        rudder_rad=laid(record.rudder_rad),
        rudder_noise_rad_sqrt_s=laid(record.rudder_noise_rad_sqrt_s),
        speed_error=replace(record.speed_error, gain_rad_s_m=laid(record.speed_error.gain_rad_s_m)),
        measured=measured,
        heading_rad=np.interp(time, record.time_s[known], record.heading_rad[known]),
    )


def _timed(work: Callable[[], T]) -> tuple[T, float]:
    times = []
    for _ in range(3):
        begin = process_time()
        done = work()
        times.append(process_time() - begin)
    return done, 1e3 * float(np.median(times))


def page(found: list[tuple[Zigzag, Outcome, Outcome, Outcome]]) -> list[str]:
    """Lines of the page."""
    rows, farthest = [], []
    for one, own, means, ekf in found:
        far = [np.max(np.abs(other.hull - own.hull) / own.std) for other in (means, ekf)]
        farthest.append(far)
        rows.append(
            [
                one.name,
                *(f"{o.instants}" for o in (own, means, ekf)),
                *(f"{o.evaluation_ms:.1f}" for o in (own, means, ekf)),
                *(f"{o.fit_ms:.0f}" for o in (own, means, ekf)),
                *(f"{x:.2f}" for x in far),
                "yes" if all(o.converged for o in (own, means, ekf)) else "**no**",
            ]
        )
    head = ["zigzag", "instants: own", "means", "grid", "evaluation, ms: linear, own instants", "linear, means"]
    head += ["extended, grid", "fit, ms: linear, own instants", "linear, means", "extended, grid"]
    head += ["hull apart, s.e.: linear, means", "extended, grid", "all converged"]
    ratios = [
        np.median([getattr(f[k], a) / getattr(f[1], a) for f in found])
        for a in ("evaluation_ms", "fit_ms")
        for k in (2, 3)
    ]
    middle = np.median(np.array(farthest), axis=0)
    return [
        f"Median over {len(found)} zigzags, beside the linear filter at the measurements' own instants: an "
        f"evaluation with derivatives takes {ratios[0]:.2f} times as long by the linear filter on means and "
        f"{ratios[1]:.2f} times by the extended one; a fit {ratios[2]:.2f} and {ratios[3]:.2f} times. The "
        f"farthest of the six parameters is {middle[0]:.2f} and {middle[1]:.2f} standard errors away.",
        "",
        *result_page.table(head, rows),
        "",
        "Times are those of the processor in one thread, median of three, warm. The fit of the extended filter "
        "includes the search for its start, which is a fit of the linear filter to a thinned record.",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    options = parser.parse_args()
    found = []
    for one in zigzags(options.data):
        found.append((one, linear(one, one.record), linear(one, averaged(one)), extended(one)))
        print(one.name, flush=True)
    path = result_page.write("identify.engines", "Two likelihoods of one model", page(found))
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
