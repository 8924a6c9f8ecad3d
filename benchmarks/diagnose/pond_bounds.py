"""Whether what is named on the pond hangs on single seconds: her manoeuvres with bounds a few seconds further in.

Where a manoeuvre begins and ends is a choice, and no effect of the ship's. The effects that belong together are looked
for anew with the bounds of every manoeuvre moved in at random.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks import measured_ships, result_page
from kempf.flows.jobs.identify.chosen_manoeuvres import Chosen, choose
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN, known_effects
from kempf.flows.jobs.identify.vessel_runs import assembled
from kempf.pipeline.diagnose.split import split
from kempf.pipeline.diagnose.steps.joint import better_together
from kempf.pipeline.shooting.ahead import shooting_range
from kempf.warehouse.storage.store import Warehouse

MOVED_S, TIMES = 5.0, 12


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=Path(__file__).parents[3] / "shared")
    ship = measured_ships.pond(parser.parse_args().data)
    with TemporaryDirectory() as folder, ThreadPoolExecutor(2) as workers:
        warehouse = Warehouse(folder)
        measured_ships.take_in(warehouse, ship)
        chosen = choose(warehouse, ship.name)
        rows = [_row(warehouse, _moved(chosen, seed) if seed else chosen, seed, workers) for seed in range(TIMES + 1)]
    lines = [
        f"{len(chosen.segments)} manoeuvres; the first row has the bounds that the search gives them, in each of the "
        f"others every bound is up to {MOVED_S:g} s further in, at random. The effects that predict clearly better "
        "together, and what could be in the place of the last one; the share of the repetitions without one manoeuvre "
        "each whose best set has effects of the same kinds.",
        "",
        *result_page.table(["bounds", "held out", "effects that belong together", "or, for the last", "share"], rows),
    ]
    result_page.write("diagnose.pond_bounds", "Pond runs: what is named, with other bounds", lines)


def _moved(chosen: Chosen, seed: int) -> Chosen:
    random = np.random.default_rng(seed)
    moved = []
    for one in chosen.segments:
        later, earlier = (round(1e9 * second) for second in random.uniform(0.0, MOVED_S, 2))
        moved.append(replace(one, start_utc_ns=one.start_utc_ns + later, end_utc_ns=one.end_utc_ns - earlier))
    return replace(chosen, segments=tuple(moved))


def _row(warehouse: Warehouse, chosen: Chosen, seed: int, workers: ThreadPoolExecutor) -> list[str]:
    """Return one row: which bounds, the held-out manoeuvres, and what better_together found."""
    spec = default_model_of(warehouse, chosen.vessel)
    runs = assembled(warehouse, chosen, spec).runs
    fitted, held = split(runs)
    shooting = shooting_range([runs[i] for i in fitted], [runs[i] for i in held], spec, workers)
    channels = set.intersection(*(set(run.channels) for run in runs))
    effects = [e for e in known_effects(NONE_OF_ONES_OWN).values() if set(e.needs) <= channels]
    found = better_together(shooting, shooting.plain, effects)
    what = ["none", "-", "-"]
    if found is not None:
        others = [effect.name for effect in found.alternatives if effect is not found.effects[-1]]
        names = [*sorted(effect.name for effect in found.effects[:-1]), found.effects[-1].name]
        what = [", ".join(names), ", ".join(others) or "-", f"{found.stability:.2f}"]
    return [f"moved, {seed}" if seed else "as found", ", ".join(map(str, held)), *what]


if __name__ == "__main__":
    main()
