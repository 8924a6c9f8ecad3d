"""The figures to reach on one page, before and after: ``python -m benchmarks.aims``, after the other benchmarks."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks import measured_ships, result_page
from benchmarks.aims.figures import FIGURES, shown
from benchmarks.aims.prototype_units import Misfits, climbed, in_units, misfits
from benchmarks.measured_ships import Ship
from kempf.flows.jobs.identify.chosen_manoeuvres import choose_refreshed
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.vessel_runs import VesselRuns, assembled
from kempf.flows.jobs.ingest.files import read_model
from kempf.pipeline.diagnose.split import split
from kempf.pipeline.shooting.windows import windows_of
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import segments

_TANK = Path(__file__).parents[2] / "docs" / "models" / "tank.yaml"
_FOLDS, _TANK_S = 4, 20.0
_TANK_UNITS = np.array([0.03, np.deg2rad(0.4), np.deg2rad(3.0)])
_POND_UNITS = np.array([0.01, np.deg2rad(0.3), np.deg2rad(2.0)])
_RACE, _DRAG, _WIND = "propeller_wash", "cross_flow_drag", "wind_force"
#: effects that are added one after the other, and what the prototype found held out with each: quoted
_PROTOTYPE_ON_TANK = (
    ("yaw_v3", _RACE, "flow_straightening", "sway_vr2"),
    ("3.20", "1.29", "0.338", "0.255", "0.196"),
)
_OURS_ON_TANK = (_RACE, _DRAG)
#: effects together, and what the prototype found for three held-out zigzags and for circles: quoted
_PROTOTYPE_ON_POND = (
    ((), "20.0", "8.4"),
    ((_DRAG,), "19.4", "8.1"),
    ((_WIND, _DRAG), "17.1", "4.7"),
    ((_RACE, _DRAG), "11.7", "6.3"),
    ((_WIND, _RACE, _DRAG), "6.8", "2.3"),
)


def tank(data: Path, workers: Executor) -> list[str]:
    """Return the part of the page with the tank's runs."""
    spec = read_model(_TANK).model_copy(update={"rudder_speed_exponent": 2.0})
    made = _assembled(measured_ships.tank(data), spec)
    rows, windows = [], 0
    steps, quoted = _PROTOTYPE_ON_TANK
    for names, others in ((steps, quoted), (_OURS_ON_TANK, ("",) * (len(_OURS_ON_TANK) + 1))):
        found: list[list[Misfits]] = [[] for _ in range(len(names) + 1)]
        for fold in range(_FOLDS):
            inside = [run for k, run in enumerate(made.runs) if k % _FOLDS != fold]
            outside = [run for k, run in enumerate(made.runs) if k % _FOLDS == fold]
            shooting = in_units(inside, outside, made.spec, _TANK_UNITS, _TANK_S, workers)
            windows = sum(one.begins.size for one in (*shooting.fitted, *shooting.held))
            for step, model in enumerate(climbed(shooting, names)):
                found[step].append(misfits(model, shooting.held, made.spec))
        for step, (folds, other) in enumerate(zip(found, others, strict=True)):
            words = " + ".join(("plain", *names[:step]))
            if step or other:
                rows.append([words, other, *_cells(folds)])
    head = ["model", "prototype", "ours, states as measured", "ours, states fitted"]
    return [
        "## The prototype's selection on the tank's runs, held out",
        "",
        f"{len(made.runs)} runs in {_FOLDS} folds, {windows} windows of {_TANK_S:g} s, units of 0.03 m/s, 0.4 deg/s "
        "and 3 deg; the rudder's force goes with the square of the speed, as in eq. (16). The prototype: 144 windows.",
        "",
        *result_page.table(head, rows),
        "",
    ]


def pond(data: Path, workers: Executor) -> list[str]:
    """Return the part of the page with the runs on a pond."""
    made, circles = _with_circles(measured_ships.pond(data))
    refused = len(circles & made.skipped.keys())
    zigzags = [run for run in made.runs if run.name not in circles]
    chosen, apart = split(zigzags)
    shooting = in_units(
        *([zigzags[k] for k in chosen], [zigzags[k] for k in apart], made.spec, _POND_UNITS, None, workers)
    )
    turned = [windows_of(run, shooting.horizon_s) for run in made.runs if run.name in circles]
    rows = []
    for names, held, circle in _PROTOTYPE_ON_POND:
        model = climbed(shooting, names)[-1]
        ours = [_cells([misfits(model, windows, made.spec)]) for windows in (shooting.held, turned)]
        rows.append([" + ".join(("plain", *names)), held, *ours[0], circle, *ours[1]])
    head = ["model", "held out: prototype (zigzags)", "ours, states as measured", "ours, states fitted"]
    head += ["circles: prototype", "ours, states as measured", "ours, states fitted"]
    return [
        "## The prototype's models of the ship on a pond",
        "",
        f"{len(chosen)} manoeuvres fitted, zigzags and random ones, {len(apart)} held out, {len(turned)} circles not "
        f"({refused} more hold one order of the rudder alone, which makes no record), windows of "
        f"{shooting.horizon_s:.3g} s, units of 0.01 m/s, 0.3 deg/s and 2 deg. The prototype's: 6 zigzags and 2 random "
        "runs fitted, 3 zigzags held out, 15 circles.",
        "",
        *result_page.table(head, rows),
        "",
    ]


def _cells(found: Sequence[Misfits]) -> Iterator[str]:
    for name in ("measured_states", "fitted_states"):
        values = [x for one in found for x in getattr(one, name)]
        yield f"{np.mean(values):.3g}" if np.all(np.isfinite(values)) else "runs away"


def _assembled(ship: Ship, spec: ModelSpec) -> VesselRuns:
    with TemporaryDirectory() as place:
        warehouse = Warehouse(place)
        measured_ships.take_in(warehouse, ship)
        return assembled(warehouse, choose_refreshed(warehouse, ship.name), spec)


def _with_circles(ship: Ship) -> tuple[VesselRuns, frozenset[str]]:
    """Return the zigzags and the turning circles of a ship as runs, and the names of the circles."""
    with TemporaryDirectory() as place:
        warehouse = Warehouse(place)
        outcomes = measured_ships.take_in(warehouse, ship)
        chosen = choose_refreshed(warehouse, ship.name)
        circles = [s for s in segments.every(warehouse, ship.name) if s.kind == "turning_circle"]
        names = {outcome.log_id: Path(outcome.path).name for outcome in outcomes if outcome.log_id is not None}
        both = replace(
            chosen,
            segments=(*chosen.segments, *circles),
            ingests=chosen.ingests | {s.log_id: s.ingest_id for s in circles},
            file_names=names | chosen.file_names,
            # by the number of the log, those of circles among them
            loads={},
        )
        made = assembled(warehouse, both, default_model_of(warehouse, ship.name))
    return made, frozenset(s.segment_id for s in circles)


def main() -> None:
    """Write ``results/aims.md``."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    given = parser.parse_args()
    head = ["what", "before", "prototype", "aim", "now", "from"]
    lines = [
        "Before, prototype and aim are quoted from the brief that set them, in its words. Now is read off the page "
        "that is named beside it, as its own command wrote it.",
        "",
        *result_page.table(head, [shown(figure) for figure in FIGURES]),
        "",
        "Below, the prototype's figures are quoted too; ours are made by this command. From states as measured a "
        "window begins as the prototype's do; with states fitted, as in `kempf diagnose`, the misfit is smaller by "
        "what a measured beginning is wrong by.",
        "",
    ]
    with ThreadPoolExecutor() as workers:
        lines += [*tank(given.data, workers), *pond(given.data, workers)]
    result_page.write("aims", "The figures to reach", lines[:-1])


if __name__ == "__main__":
    main()
