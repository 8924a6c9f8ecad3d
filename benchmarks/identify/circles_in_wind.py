"""Circles sailed in the wind beside their predictions: ``python -m benchmarks.identify.circles_in_wind``.

The ships of `benchmarks.identify.prediction` without an effect sail their zigzags on one day and circles on another,
each day in a wind and a stream of its own. What was measured of the circles is held against ``kempf predict
--compare``: without an error of the wind force, and as it is (docs/decisions/0101).
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import numpy as np

from benchmarks import result_page
from benchmarks.diagnose.hidden_effects.tally import Share
from benchmarks.identify.prediction.plain_ship import drawn, taken_in
from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
from kempf.flows.jobs.identify.pool_vessel import pool_vessel
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.predict import as_sailed
from kempf.flows.jobs.predict.checked_prediction import CheckedPredictions
from kempf.flows.jobs.predict.compare_predicted import ComparedFigure, measured_beside
from kempf.flows.jobs.predict.predict_request import PredictRequest
from kempf.pipeline.simulate.disturbances import Disturbance, Environment
from kempf.pipeline.simulate.hulls import SimulatedHull
from kempf.pipeline.simulate.manoeuvre import SteadyCourse, TurningCircle
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT, TrialSettings, simulate_trial
from kempf.schemas.errors import DataRejected

RUDDERS_DEG = (35.0, -20.0)
_SEED, _COUNT = 20261129, 24
_BEFORE, _NOW = "without the wind", "as it is"


@dataclass(frozen=True)
class Circle:
    """One figure of a circle beside its prediction."""

    figure: str
    wind: str
    inside: bool
    agrees: bool


def environment(number: int) -> Environment:
    """Return the wind and the stream of the day of a ship's circles."""
    random = np.random.default_rng([_SEED, number])
    usual = PAPER_ENVIRONMENT.wind_force
    force = replace(usual, mean=float(usual.mean * random.standard_normal()))
    north, east = 0.3 * random.standard_normal(2)
    return Environment(wind_force=force, current_north=Disturbance(north), current_east=Disturbance(east))


def circles(hull: SimulatedHull, number: int, folder: Path) -> Path:
    """Sail the circles and write their log."""
    steps = [SteadyCourse(180.0)]
    for rudder_deg in RUDDERS_DEG:
        steps += [TurningCircle(rudder_deg, 560.0), SteadyCourse(900.0)]
    settings = TrialSettings(
        hull, tuple(steps), environment(number), seed=_SEED + number, start_utc_ns=1_760_000_000 * 10**9
    )
    log = folder / "circles.mcap"
    log.write_bytes(to_mcap(simulate_trial(settings)))
    return log


def compared(number: int) -> tuple[list[Circle], tuple[int, int]]:
    """Return what was measured of a ship's circles beside its predictions, without the wind and with it.

    The other numbers are those of her own zigzags: overshoots within the intervals of the errors alone, and overshoots.
    """
    hull, _ = drawn(number)
    found: list[Circle] = []
    own = (0, 0)
    with TemporaryDirectory() as folder:
        warehouse = taken_in(hull, number, Path(folder))
        pool_vessel(warehouse, hull.name, Request(), identify_vessel(warehouse, hull.name))
        ingest(warehouse, [circles(hull, number, Path(folder))], hull.name)
        for rudder_deg in map(abs, RUDDERS_DEG):
            asked = PredictRequest("turning-circle", rudder_deg=rudder_deg)
            try:
                predicted = CheckedPredictions(warehouse, hull.name, asked).predict(asked)
            except DataRejected:
                continue
            if predicted.own_zigzags is not None:
                own = (predicted.own_zigzags.inside, predicted.own_zigzags.overshoots)
            with patch.object(as_sailed, "_usual_wind", return_value=(0.0, 0.0)):
                before = measured_beside(warehouse, predicted)
            for wind, measured in ((_BEFORE, before), (_NOW, measured_beside(warehouse, predicted))):
                found += _held([one for run in measured for one in run.figures], wind)
    return found, own


def _held(figures: Sequence[ComparedFigure], wind: str) -> Iterator[Circle]:
    for one in figures:
        if one.inside is not None:
            yield Circle(one.name, wind, one.inside, bool(one.agrees))


def page(found: Sequence[Circle], own: Share, ships: int) -> list[str]:
    """Return the lines of the page."""
    by: dict[tuple[str, str], list[Circle]] = defaultdict(list)
    for one in found:
        by[one.figure, one.wind].append(one)
        by["all", one.wind].append(one)
    names = [*sorted({one.figure for one in found}), "all"]
    rows = []
    for name in names:
        cells = []
        for wind in (_BEFORE, _NOW):
            these = by[name, wind]
            cells += [
                Share(sum(one.inside for one in these), len(these)),
                Share(sum(one.agrees for one in these), len(these)),
            ]
        rows.append([name, *map(str, cells)])
    head = ["figure"]
    head += [f"{what}, {wind}" for wind in (_BEFORE, _NOW) for what in ("in the interval", "agrees by both intervals")]
    rudders = " and ".join(f"{abs(one):g}" for one in RUDDERS_DEG)
    return [
        f"{ships} ships without an effect, each with circles of {rudders} deg of rudder on another day than her "
        "zigzags. The force of the wind that day is drawn with the size that it has on the day of the zigzags, from "
        "either side; it stays on one side of the ship while she turns, as in eq. (16). *Agrees by both*: measured and "
        "predicted differ by no more than the intervals of both allow together. Wanted 95 %.",
        "",
        *result_page.table(head, rows),
        "",
        "First and second overshoots of her own zigzags, closed loop in the wind that the filter finds, within the "
        f"intervals of the errors alone: {own}.",
    ]


def main() -> None:
    """Sail the ships and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.partition(":")[0])
    parser.add_argument("--ships", type=int, default=_COUNT)
    given = parser.parse_args()
    found: list[Circle] = []
    inside, overshoots = 0, 0
    with ProcessPoolExecutor(2) as workers:
        for done, (circles_of_ship, own) in enumerate(workers.map(compared, range(given.ships)), start=1):
            found += circles_of_ship
            inside, overshoots = inside + own[0], overshoots + own[1]
            print(f"{done} of {given.ships} ships", flush=True)
    options = "" if given.ships == _COUNT else f"--ships {given.ships}"
    path = result_page.write(
        "identify.circles_in_wind",
        "Circles in the wind beside their predictions",
        page(found, Share(inside, overshoots), given.ships),
        options=options,
    )
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
