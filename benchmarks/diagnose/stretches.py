"""How honest the scores of a short stretch are, and how often they name what is wrong with the ship.

Ships of the hidden effects' plant, which shares no code with the estimator, each sailed twice from the same seed: with
nothing hidden, and with a rudder that answers two seconds late. Every manoeuvre is cut into stretches of half a minute.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks import result_page
from benchmarks.diagnose.hidden_effects import programme, readings, sail
from benchmarks.diagnose.hidden_effects.effects import CATALOGUE
from benchmarks.diagnose.late_rudder import LAG_S
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.vessel_runs import assembled
from kempf.flows.jobs.ingest.ingest_logs import ingest_log
from kempf.flows.process.cores import usable
from kempf.pipeline.diagnose.screening.staged import staged
from kempf.pipeline.diagnose.stretches.stretch import Explained, explain
from kempf.pipeline.diagnose.stretches.stretch_json import verdict
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.trial import TrialSettings
from kempf.schemas.effects import catalogue
from kempf.warehouse.storage.store import Warehouse

_STRETCH_S = 30.0
#: effects that say that the rudder is late: half a minute does not tell one from another
_LATE = ("rudder_lag", "dead_time", "rate_limit", "backlash")
_SHIPS = 4


@dataclass(frozen=True)
class Counted:
    """What was found in the stretches of all ships."""

    hidden: str
    stretches: int
    #: Effects scored, and those with p below 0.05 before it is adjusted.
    scored: int
    below: int
    #: Stretches in which an effect stands out, and in which the first is one of those that the rudder is late.
    stands_out: int
    named: int


def fitted(seed: int, hidden: str, folder: Path, workers: ThreadPoolExecutor) -> PooledFit:
    """Sail a ship and fit the plain model to her manoeuvres."""
    hull = programme.ship("mariner", seed)
    weather = programme.weather(hull, "moderate", seed, 0)
    effect = CATALOGUE[hidden] if hidden else None
    voyage = sail.voyage(hull, weather, effect, LAG_S if hidden else 0.0, seed, 0)
    settings = TrialSettings(hull, (), instruments=readings.instruments(hull), seed=seed)
    trial = readings.read(hull, voyage, weather.wind_from_rad, settings, None)
    name = f"ship{seed}{hidden}"
    warehouse = Warehouse(str(folder / name))
    profile = logger_profile(settings).model_copy(update={"vessel": name})
    ingest_log(warehouse, name, "day.mcap", LogFile(to_mcap(trial)), profile, name)
    runs = assembled(warehouse, choose(warehouse, name), default_model_of(warehouse, name))
    return staged(runs.runs, runs.spec, (), workers)[1][-1]


def stretches(base: PooledFit, workers: ThreadPoolExecutor) -> Iterator[Explained]:
    """Score every stretch of every manoeuvre."""
    known = catalogue()
    for number, one in enumerate(base.runs):
        time = one.run.time_s
        for start in np.arange(0.0, float(time[-1]) - _STRETCH_S, _STRETCH_S):
            inside = (start <= time) & (time < start + _STRETCH_S)
            yield explain(base, [True] * len(base.runs), number, inside, known, workers)


def count(hidden: str, ships: int, folder: Path) -> Counted:
    """Count over all ships."""
    every: list[Explained] = []
    with ThreadPoolExecutor(usable()) as workers:
        for seed in range(1, ships + 1):
            every += [one for one in stretches(fitted(seed, hidden, folder, workers), workers) if not one.too_short]
    scored = [e.p_value for one in every for e in one.effects if np.isfinite(e.here.score)]
    out = [one for one in every if verdict(one) == "stands_out"]
    named = sum(one.effects[0].effect.name in _LATE for one in out)
    return Counted(hidden, len(every), len(scored), sum(p < 0.05 for p in scored), len(out), named)


def page(found: Sequence[Counted], ships: int) -> list[str]:
    """Return the lines of the page."""
    head = (
        *("hidden", "stretches", "scores", "p below 0.05, %", "an effect stands out", "the first says: rudder late"),
    )
    rows = [
        (
            one.hidden.replace("_", " ") or "nothing",
            str(one.stretches),
            str(one.scored),
            f"{100.0 * one.below / one.scored:.1f}",
            f"{one.stands_out} ({100.0 * one.stands_out / one.stretches:.1f} %)",
            str(one.named),
        )
        for one in found
    ]
    return [
        f"{ships} ships, stretches of {_STRETCH_S:g} s. With nothing hidden at most 5 % of the scores should have p "
        "below 0.05, and no effect should stand out in more than 1 % of the stretches.",
        "",
        *result_page.table(head, rows),
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark and write its page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ships", type=int, default=_SHIPS)
    asked = parser.parse_args(arguments)
    with TemporaryDirectory() as folder:
        found = [count(hidden, asked.ships, Path(folder)) for hidden in ("", "rudder_lag")]
    options = "" if asked.ships == _SHIPS else f"--ships {asked.ships}"
    result_page.write("diagnose.stretches", "Stretches explained", page(found, asked.ships), options=options)


if __name__ == "__main__":
    main()
