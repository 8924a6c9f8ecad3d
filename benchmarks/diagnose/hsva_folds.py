"""The towing-tank runs in four folds: which effects predict legs better, chosen without a fold and tried on it."""

from __future__ import annotations

import argparse
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks import measured_ships, result_page
from kempf.flows.jobs.identify.chosen_manoeuvres import choose_refreshed
from kempf.flows.jobs.identify.vessel_runs import VesselRuns, assembled
from kempf.flows.jobs.ingest.files import read_model
from kempf.pipeline.diagnose.steps.improves_prediction import better_ahead
from kempf.pipeline.shooting.ahead import shooting_range
from kempf.schemas import effects
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse

_MODEL = Path(__file__).parents[2] / "docs" / "models" / "tank.yaml"
_FOLDS, _MOST = 4, 4
_HEAD = ("fold", "step", "added, with what predicts alike", "fitted, misfit", "left out, misfit", "of the fold, misfit")
_PERCENT = ("left out, %", "of the fold, %", "of the fold, worst, %")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    given = parser.parse_args()
    tank = read_model(_MODEL)
    lines = [
        f"Of the {_FOLDS} folds every fourth run belongs to one. Effects are chosen by the runs outside the fold, each "
        "left out in turn, and the fold's runs are predicted one leg ahead; nothing shared is fitted to them. Misfit: "
        "mean square error in units of the plain model's own, summed over three channels. Per cent: of the motion.",
        "",
    ]
    for words, spec in (
        ("docs/models/tank.yaml, whose rudder force goes with V to the power of 1", tank),
        ("the same with the power of 2, as eq. (16) has it", tank.model_copy(update={"rudder_speed_exponent": 2.0})),
    ):
        lines += [f"## {words}", "", *result_page.table([*_HEAD, *_PERCENT], _ladders(given.data, spec)), ""]
    result_page.write("diagnose.hsva_folds", "Towing-tank runs in four folds, one leg ahead", lines)


def _ladders(data: Path, spec: ModelSpec) -> list[list[str]]:
    made = _runs(data, spec)
    rows = []
    with ThreadPoolExecutor() as workers:
        for fold in range(_FOLDS):
            inside = [run for k, run in enumerate(made.runs) if k % _FOLDS != fold]
            outside = [run for k, run in enumerate(made.runs) if k % _FOLDS == fold]
            shooting = shooting_range(inside, outside, made.spec, workers)
            known = [
                effect
                for effect in effects.catalogue().values()
                if all(channel in run.channels for channel in effect.needs for run in made.runs)
            ]
            now, words = shooting.plain, "plain model"
            for step in range(_MOST + 1):
                percent, held = now.percent(now.left_out), now.percent(now.held)
                rows.append(
                    [
                        *(str(fold + 1), str(step), words),
                        *(f"{one.mean:.3f}" for one in (now.own, now.left_out, now.held)),
                        *(f"{x:.1f}" for x in (np.mean(percent), np.mean(held), np.max(held))),
                    ]
                )
                print(*rows[-1], flush=True)
                choice = better_ahead(shooting, now, [e for e in known if e.name not in now.names])
                if choice is None:
                    break
                now = choice.close[0]
                words = " or ".join(one.model.effects[-1].name for one in choice.close)
    return rows


def _runs(data: Path, spec: ModelSpec) -> VesselRuns:
    with TemporaryDirectory() as place:
        warehouse = Warehouse(place)
        ship = measured_ships.tank(data)
        measured_ships.take_in(warehouse, ship)
        return assembled(warehouse, choose_refreshed(warehouse, ship.name), spec)


if __name__ == "__main__":
    main()
