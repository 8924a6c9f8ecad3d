"""Whether the lasting noise of instruments depends on the last digits: looked for anew from fits that differ there.

The likelihood of several noises has several maxima. Rounding, another processor or another version of a library must
not decide which of them a model comes to, as all that is diagnosed is counted from there.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks import measured_ships, result_page
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.vessel_runs import assembled
from kempf.flows.jobs.ingest.files import read_model
from kempf.pipeline.diagnose.screening.instrument_noise import with_instrument_noise
from kempf.pipeline.diagnose.split import split
from kempf.pipeline.estimate.plain_fit import fit_plain
from kempf.pipeline.estimate.pooled_fit import PooledFit, linearise
from kempf.warehouse.storage.store import Warehouse

#: how much the fits differ, of each number, and how many there are beside the fit itself
_DIFFER, _TIMES = 1e-8, 6
_TANK = Path(__file__).parents[2] / "docs" / "models" / "tank.yaml"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=Path(__file__).parents[3] / "shared")
    data = parser.parse_args().data
    rows = []
    with ThreadPoolExecutor(2) as workers:
        for ship in (measured_ships.tank(data), measured_ships.pond(data)):
            plain = _plain(ship, workers)
            for seed in range(_TIMES + 1):
                found = with_instrument_noise(_moved(plain, seed, workers), workers)
                names = ", ".join(sorted(effect.name for effect in found.model.effects)) or "none"
                rows.append([ship.name, str(seed or "-"), names, f"{found.log_likelihood:.2f}", f"{found.hull[3]:.5f}"])
    lines = [
        f"The plain model of the fitted manoeuvres, and lasting noise looked for from it: the first row of a ship from "
        f"the fit as it is, the others with each of its numbers moved by {_DIFFER:g} of it at random.",
        "",
        *result_page.table(["ship", "seed", "lasting noise", "log-likelihood", "a22, 1/m"], rows),
    ]
    result_page.write("diagnose.noise_hills", "Lasting noise: which maximum is found", lines)


def _plain(ship: measured_ships.Ship, workers: ThreadPoolExecutor) -> PooledFit:
    with TemporaryDirectory() as folder:
        warehouse = Warehouse(folder)
        measured_ships.take_in(warehouse, ship)
        spec = default_model_of(warehouse, ship.name)
        if ship.name == "hsva_kvlcc2":
            # as on the page of her ladder
            spec = read_model(_TANK).model_copy(update={"rate_bias": False})
        runs = assembled(warehouse, choose(warehouse, ship.name), spec).runs
    fitted, _ = split(runs)
    return fit_plain([runs[i] for i in fitted], spec, workers).fit


def _moved(fit: PooledFit, seed: int, workers: ThreadPoolExecutor) -> PooledFit:
    if not seed:
        return fit
    random = np.random.default_rng(seed)
    hull, levels = (x * (1.0 + _DIFFER * random.standard_normal(x.shape)) for x in (fit.hull, fit.levels))
    moved = replace(fit, hull=hull, levels=levels)
    lines = linearise(moved.runs, [moved.point(run) for run in range(len(moved.runs))], workers)
    return replace(moved, linearised=lines, log_likelihood=sum(line.passed.log_likelihood for line in lines))


if __name__ == "__main__":
    main()
