"""Random subsets of the measured runs: what each is diagnosed with, and what becomes of the runs it does not hold.

``python -m benchmarks.diagnose.run_subsets``.

Of the towing-tank and of the pond runs seeded subsets are drawn, from a single log to all but two, and each is
diagnosed as `kempf diagnose` does it, with the model that her profile's surroundings choose. The manoeuvres of the
other logs are then predicted one leg ahead by every rung of the ladder; nothing shared is fitted to them. An accepted
effect is to make none of these worse beyond its standard error. With ``--work DIR`` an answer that lies there is not
asked for again.
"""

from __future__ import annotations

import argparse
import json
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks import measured_ships, result_page
from benchmarks.diagnose.one_hidden_effect import kept
from benchmarks.measured_ships import Ship
from kempf.flows.jobs.diagnose.diagnose_vessel import FullDiagnosis, examine
from kempf.flows.jobs.identify.chosen_manoeuvres import choose_refreshed
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN
from kempf.flows.jobs.identify.vessel_runs import Like, assembled
from kempf.flows.process.cores import usable
from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.steps.ladder_step import Step
from kempf.pipeline.diagnose.verdicts.diagnosis_json import as_json
from kempf.pipeline.estimate.record.grid_run import GridRun, common_slip
from kempf.pipeline.shooting.ahead import Ahead
from kempf.pipeline.shooting.left_out import LeftOut
from kempf.pipeline.shooting.paired import paired
from kempf.pipeline.shooting.shooting_fit import alone
from kempf.pipeline.shooting.shot_run import ShotRun
from kempf.pipeline.shooting.windows import windows_of
from kempf.schemas.errors import KempfError
from kempf.warehouse.storage.store import Warehouse

_SEED, _SUBSETS = 20261130, 10
#: Standard errors beyond which the runs of other logs are predicted worse.
_WORSE = 1.0
_SHIPS: dict[str, Callable[[Path], Ship]] = {"pond": measured_ships.pond, "tank": measured_ships.tank}
_HEAD = (
    *("subset", "logs", "fitted + held out", "matters", "immaterial", "suspected", "fitted, %", "left out, %"),
    *("held out, %", "other logs, %", "other logs, in s.e.", "better", "worst, %", "remarks"),
)


def with_manoeuvres(ship: Ship) -> Ship:
    """Leave out the logs that hold no manoeuvre to which a model is fitted."""
    with TemporaryDirectory() as place:
        warehouse = Warehouse(place)
        measured_ships.take_in(warehouse, ship)
        names = set(choose_refreshed(warehouse, ship.name).file_names.values())
    return replace(ship, logs=tuple(log for log in ship.logs if log.name in names))


def drawn(ship: Ship, seed: int, number: int) -> Ship:
    """Return a subset of the logs: the first has one log, the second two, the others from two to all but two."""
    rng = np.random.default_rng([seed, number])
    many = number + 1 if number < 2 else int(rng.integers(2, len(ship.logs) - 1))
    chosen = sorted(rng.choice(len(ship.logs), many, replace=False))
    return replace(ship, logs=tuple(ship.logs[k] for k in chosen))


def examined(ship: Ship, subset: Ship) -> dict[str, Any]:
    """Diagnose a subset of the logs and let every rung predict the manoeuvres of the others."""
    begun = perf_counter()
    answer: dict[str, Any] = {"logs": [log.name for log in subset.logs]}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            answer |= _examined(ship, subset)
        except KempfError as error:
            answer["refused"] = str(error)
        except Exception:  # noqa: BLE001  what is looked for here
            answer["exception"] = traceback.format_exc()
    answer["warnings"] = sorted({f"{w.category.__name__}: {w.message} ({Path(w.filename).name})" for w in caught})
    answer["seconds"] = perf_counter() - begun
    plain: dict[str, Any] = json.loads(json.dumps(answer, default=lambda array: array.tolist()))
    return plain


def _examined(ship: Ship, subset: Ship) -> dict[str, Any]:
    with TemporaryDirectory() as place:
        warehouse = Warehouse(place)
        measured_ships.take_in(warehouse, subset)
        spec = default_model_of(warehouse, ship.name)
        full = examine(warehouse, choose_refreshed(warehouse, ship.name), spec, NONE_OF_ONES_OWN)
    others = _others(ship, subset, full)
    stated = as_json(full.diagnosis)
    return {
        "diagnosis": stated,
        "skipped": full.runs.skipped,
        "others": [run.name for run in others],
        "rungs": _rungs(full.diagnosis.steps, others),
        "converged": [step.fit.converged for step in full.diagnosis.steps],
    }


def _others(ship: Ship, subset: Ship, full: FullDiagnosis) -> list[GridRun]:
    """Return the manoeuvres of the other logs, laid out as those of the subset are."""
    runs = full.runs.runs
    with TemporaryDirectory() as place:
        warehouse = Warehouse(place)
        measured_ships.take_in(warehouse, replace(ship, logs=tuple(x for x in ship.logs if x not in subset.logs)))
        chosen = choose_refreshed(warehouse, ship.name)
        return list(assembled(warehouse, chosen, full.runs.spec, like=Like(runs[0].step_s, common_slip(runs))).runs)


def _rungs(steps: Sequence[Step], others: Sequence[GridRun]) -> list[dict[str, Any]]:
    """Predict other manoeuvres by every rung, with parameters fitted to legs and with those that predictions take."""
    rungs, first, last = [], None, None
    for step in steps:
        if step.ahead is None:
            return []
        legs = predicted(step.ahead, step.ahead.fit.shared, others)
        one_step = predicted(step.ahead, step.fit.ship.parameters, others)
        taken = legs if step.predicts_by_legs else one_step
        now = (legs, taken)
        first, last = first or now, last or now
        rungs.append(
            {
                "added": None if step.added is None else step.added.name,
                "stability": step.stability,
                "predicts_by_legs": step.predicts_by_legs,
                "own": step.ahead.percent(step.ahead.own).tolist(),
                "left_out": step.ahead.percent(step.ahead.left_out).tolist(),
                "held_out": step.ahead.percent(step.ahead.held).tolist(),
                "others": step.ahead.percent(legs).tolist(),
                "others_one_step": step.ahead.percent(one_step).tolist(),
                "others_as_predicted": step.ahead.percent(taken).tolist(),
                "legs_beside_one_step": _beside(one_step, legs),
                "beside_plain": [_beside(a, b) for a, b in zip(first, now, strict=True)],
                "beside_last": [_beside(a, b) for a, b in zip(last, now, strict=True)],
            }
        )
        last = now
    return rungs


def predicted(ahead: Ahead, shared: Float, runs: Sequence[GridRun]) -> LeftOut:
    """Return how a model predicts other manoeuvres one leg ahead; what is theirs alone is fitted to them."""
    shot = ahead.fit.shots[0]
    with ThreadPoolExecutor(usable()) as workers:
        found = list(
            workers.map(
                lambda run: alone(
                    ShotRun(windows_of(run, ahead.horizon_s), shot.model, shot.spec), shared, ahead.fit.scales
                ),
                runs,
            )
        )
    return LeftOut(np.array([misfit for misfit, _, _ in found]), tuple(errors for _, _, errors in found))


def _beside(before: LeftOut, after: LeftOut) -> dict[str, float]:
    comparison = paired(before, after)
    return {
        "falls_by": comparison.falls_by,
        "in_std": comparison.in_std,
        "better": comparison.better,
        "of": comparison.of,
    }


def row(number: int, one: dict[str, Any]) -> list[str]:
    """Return the line of a subset in the table."""
    label, logs = str(number), str(len(one["logs"]))
    if "diagnosis" not in one:
        return [label, logs, *[""] * (len(_HEAD) - 3), one.get("refused") or one["exception"].splitlines()[-1]]
    said, rungs = one["diagnosis"], one["rungs"]
    sets = [" or ".join(s["effects"]) for s in said["sets"]]
    listed = {
        verdict: [c["effect"] for c in said["candidates"] if c["verdict"] == verdict]
        for verdict in ("immaterial", "suspected", "not_testable")
    }
    remarks = [*one["warnings"], *_remarks(one)]
    return [
        label,
        logs,
        f"{len(said['fitted'])} + {len(said['held_out'])}",
        "; ".join(sets) or said["verdict"].replace("_", " "),
        *(", ".join(listed[v]) for v in ("immaterial", "suspected")),
        *(_from_to(rungs, key) for key in ("own", "left_out", "held_out", "others")),
        f"{rungs[-1]['beside_plain'][0]['in_std']:+.1f}" if len(rungs) > 1 else "",
        "{better}/{of}".format(**rungs[-1]["beside_plain"][0]) if len(rungs) > 1 else "",
        f"{max(rungs[-1]['others']):.1f}" if rungs else "",
        "; ".join(remarks),
    ]


def _remarks(one: dict[str, Any]) -> list[str]:
    said = []
    for rung in one["rungs"][1:]:
        for words, comparison in zip(("", ", as predictions take it"), rung["beside_last"], strict=True):
            if comparison["in_std"] < -_WORSE:
                said.append(f"{rung['added']} makes other logs worse, {comparison['in_std']:+.1f} s.e.{words}")
    if not all(one["converged"]):
        said.append("not converged")
    return [*said, *(f"skipped {name}: {why}" for name, why in one["skipped"].items())]


def _from_to(rungs: Sequence[dict[str, Any]], key: str) -> str:
    if not rungs or not rungs[0][key]:
        return ""
    ends = [np.mean(rung[key]) for rung in (rungs[0], rungs[-1])]
    return " to ".join(f"{x:.1f}" for x in (ends if len(rungs) > 1 else ends[:1]))


def counted(answers: Sequence[dict[str, Any]]) -> list[list[str]]:
    """Return how often each effect got each verdict that says something of it."""
    found = ("present", "immaterial", "suspected", "not_testable")
    said = [a["diagnosis"]["candidates"] for a in answers if "diagnosis" in a]
    tally = {v: Counter(c["effect"] for one in said for c in one if c["verdict"] == v) for v in found}
    names = sorted({n for v in found[:3] for n in tally[v]}, key=lambda n: (*(-tally[v][n] for v in found), n))
    return [[name, *(str(tally[v][name] or "") for v in found)] for name in names]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    parser.add_argument("--seed", type=int, default=_SEED)
    parser.add_argument("--subsets", type=int, default=_SUBSETS)
    parser.add_argument("--ships", nargs="*", choices=sorted(_SHIPS), default=sorted(_SHIPS))
    parser.add_argument("--only", type=int, nargs="*", help="numbers of subsets; no page is written then")
    parser.add_argument("--work", type=Path, help="folder in which the answers are kept")
    given = parser.parse_args()
    with nullcontext(given.work) if given.work else TemporaryDirectory() as folder:
        write(given, Path(folder))


def write(given: argparse.Namespace, work: Path) -> None:
    """Ask what is not in a folder yet, and write the page where every subset was asked."""
    work.mkdir(parents=True, exist_ok=True)
    lines = [
        "Per cent of the motion one leg ahead, from the plain model to the last: fitted manoeuvres, the same left out, "
        "those of the subset that were held out, and those of the logs that are not in it. In s.e.: the mean logarithm "
        "of the errors' ratio in its standard errors, positive where the last model predicts other logs better.",
        "",
    ]
    for name in given.ships:
        ship, answers = with_manoeuvres(_SHIPS[name](given.data)), []
        for number in given.only or range(given.subsets):
            subset = drawn(ship, given.seed, number)
            path = work / f"{name}-{given.seed}-{number}.json"
            answers.append(kept(path, lambda ship=ship, subset=subset: examined(ship, subset)))  # type: ignore[misc]
            print(*row(number, answers[-1]), f"{answers[-1]['seconds']:.0f} s", sep=" | ", flush=True)
        rows = [row(number, one) for number, one in zip(given.only or range(given.subsets), answers, strict=True)]
        lines += [f"## {ship.name}", "", *result_page.table(_HEAD, rows), ""]
        head = ["effect", "matters", "immaterial", "suspected", "not testable"]
        lines += [*result_page.table(head, counted(answers)), ""]
    if not given.only:
        asked = (given.seed, given.subsets, given.ships)
        options = "" if asked == (_SEED, _SUBSETS, sorted(_SHIPS)) else "--seed {} --subsets {} --ships {}"
        title = "Random subsets of the measured runs"
        result_page.write(
            "diagnose.run_subsets", title, lines, options=options.format(*asked[:2], " ".join(given.ships))
        )


if __name__ == "__main__":
    main()
