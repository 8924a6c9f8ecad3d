"""Whether the zigzag that `kempf next-trial` orders parts what fits alike: ``python -m benchmarks.diagnose.parted``.

Ships of the hidden cases whose diagnosis names several effects between which it cannot choose. The first of them is
added and the next trial asked for, as a user does it. The plant, which shares no code with the estimator, sails that
zigzag on a third day; for comparison it sails a 20/20 zigzag instead. Each ship is then diagnosed anew, from the plain
model, with all three days. ``--work DIR`` keeps what was found, ship by ship.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import partial
from math import radians
from pathlib import Path
from shutil import copytree
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks import result_page
from benchmarks.diagnose.hidden_effects import programme, readings, sail
from benchmarks.diagnose.hidden_effects.cases import Case, design
from benchmarks.diagnose.hidden_effects.effects import CATALOGUE
from benchmarks.diagnose.hidden_effects.sail import VoyageFailed
from benchmarks.diagnose.hidden_effects.taken_in import taken_in
from benchmarks.diagnose.hidden_effects.tally import Share
from benchmarks.diagnose.hidden_effects.write import logs_of
from benchmarks.diagnose.one_hidden_effect import kept
from kempf.flows.jobs.diagnose.add_effect import add_effect
from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_vessel
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.predict.next_trial import next_trial
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.trial import TrialSettings
from kempf.schemas.errors import KempfError
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse

_SEED, _CASES, _SHIPS = 20261129, 336, 12
_STANDARD_DEG = (20.0, 20.0)
#: Of the cases: the third day is another month, with a weather and noise of its own.
_OTHER_DAY, _LATER_DAYS = 7919, 400
_LEGS = 5.0


@dataclass(frozen=True)
class Parted:
    """What became of one ship."""

    ship: str
    hidden: str
    before: tuple[str, ...]
    ordered_deg: tuple[float, float]
    #: That the trial parts the models, whichever is true.
    probability: float
    #: Sets with the ordered zigzag and with the standard one.
    after: tuple[str, ...]
    after_standard: tuple[str, ...]


def third_day(case: Case, c: float, angles_deg: tuple[float, float]) -> tuple[str, bytes]:
    """Let the plant sail one zigzag more; return name and bytes of its log."""
    hull, seed = programme.ship(case.hull, case.seed), case.seed + _OTHER_DAY
    weather = programme.weather(hull, case.disturbance, seed, 1)
    heading, psi, delta = float(np.random.default_rng([seed, 1]).uniform(0.0, 2.0 * np.pi)), *map(radians, angles_deg)
    around = (hull.shaft_speed_per_s, 10.0 * hull.draught_m)
    orders = np.array(programme.zigzag(hull, heading, (psi, delta), 1.0, _LEGS, *around))
    voyage = sail.by_orders(orders, hull, weather, case.hidden, c, seed, 1)
    settings = TrialSettings(
        hull, (), instruments=readings.instruments(hull), seed=seed, noise_scale=case.noise,
        start_utc_ns=round((datetime(2025, 1, 5, 6, tzinfo=UTC).timestamp() + _LATER_DAYS * 86400.0) * 1e9),
    )  # fmt: skip
    sensor = (case.hidden.name, c) if case.hidden and case.hidden.sensor else None
    trial = readings.read(hull, voyage, weather.wind_from_rad, settings, sensor, sold=case.sold)
    return f"third-{angles_deg[0]:g}-{angles_deg[1]:g}.mcap", to_mcap(trial)


def parted(case: Case) -> Parted | None:
    """Return what became of a ship, None of one that leaves nothing to be parted or cannot sail the third day."""
    try:
        files, answer = logs_of(case)
        with TemporaryDirectory() as folder:
            return _parted(case, next(iter(answer["parameters"].values())), taken_in(files, Path(folder)), Path(folder))
    except (VoyageFailed, KempfError):
        return None


def _parted(case: Case, c: float, warehouse: Warehouse, folder: Path) -> Parted | None:
    before = _first_set(warehouse, case)
    if len(before) < 2:
        return None
    add_effect(warehouse, case.case_id, before[0], begin=(ModelSpec(), NONE_OF_ONES_OWN))
    ordered = next_trial(warehouse, case.case_id)
    if not ordered.parting:
        return None
    best = ordered.trials[0]
    found = []
    for which, angles in (("ordered", best.angles_deg), ("standard", _STANDARD_DEG)):
        place = Warehouse(str(copytree(warehouse.uri, folder / which)))
        name, data = third_day(case, c, angles)
        (folder / name).write_bytes(data)
        ingest(place, [folder / name], case.case_id)
        found.append(_first_set(place, case))
    return Parted(
        f"{case.hull}, noise {case.noise:g}, {case.disturbance}{', as sold' if case.sold else ''}",
        *(case.effect, before, best.angles_deg, best.probability or 0.0, *found),
    )


def _first_set(warehouse: Warehouse, case: Case) -> tuple[str, ...]:
    """Return the set with the true effect, or the first."""
    content = diagnose_vessel(warehouse, case.case_id, ModelSpec())[0].content
    sets = [tuple(one["effects"]) for one in content["sets"]]
    return next((one for one in sets if case.effect in one), sets[0] if sets else ())


def cases(seed: int) -> Iterator[Case]:
    """Draw ships whose effect moves the hull, in the order of the design."""
    for case in design(_CASES, seed):
        if case.kind == "catalogue" and not CATALOGUE[case.effect].sensor and case.strength > 0:
            yield case


def _content(case: Case) -> dict[str, Any]:
    """Return what became of a ship as JSON content, empty where nothing was to be parted."""
    found = parted(case)
    return {} if found is None else asdict(found)


def _kept(case: Case, work: Path) -> Parted | None:
    content = kept(work / f"{case.case_id}.json", partial(_content, case))
    return Parted(**{k: tuple(v) if isinstance(v, list) else v for k, v in content.items()}) if content else None


def page(found: list[Parted], looked_at: int) -> list[str]:
    """Return the lines of the page."""

    def smaller(after: tuple[str, ...], one: Parted) -> bool:
        return one.hidden in after and len(after) < len(one.before)

    rows = [
        [
            *(one.ship, one.hidden, " or ".join(one.before)),
            *("{:g}/{:g}".format(*one.ordered_deg), f"{100.0 * one.probability:.0f} %"),
            *(" or ".join(one.after) or "none", " or ".join(one.after_standard) or "none"),
        ]
        for one in found
    ]
    head = ["ship", "hidden", "named before", "ordered", "parts with", "named after it", "after a 20/20 instead"]
    true = [one for one in found if one.hidden in one.before]
    shares = [
        Share(sum(smaller(after, one) for one, after in ((one, getattr(one, which)) for one in true)), len(true))
        for which in ("after", "after_standard")
    ]
    alone = [
        Share(sum(getattr(one, which) == (one.hidden,) for one in true), len(true))
        for which in ("after", "after_standard")
    ]
    return [
        f"{len(found)} of {looked_at} ships with a medium or large effect on the hull had several effects named, "
        "between which the diagnosis could not choose. *Parts with*: the probability with which the ordered zigzag was "
        "said to part the models, whichever is true.",
        "",
        *result_page.table(head, rows),
        "",
        f"Of the sets that held the true effect, smaller afterwards and with it: {shares[0]}; after a 20/20 zigzag "
        f"instead {shares[1]}. The true effect alone: {alone[0]} and {alone[1]}.",
    ]


def main() -> None:
    """Sail the ships and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.partition(":")[0])
    parser.add_argument("--ships", type=int, default=_SHIPS, help="how many with something to be parted")
    parser.add_argument("--work", type=Path)
    given = parser.parse_args()
    found: list[Parted] = []
    looked_at = 0
    with nullcontext(given.work) if given.work else TemporaryDirectory() as place, ProcessPoolExecutor(2) as workers:
        work = Path(place)
        work.mkdir(parents=True, exist_ok=True)
        drawn = list(cases(_SEED))
        # as many at a time as there are processes: no more ships are sailed than are shown
        for pair in zip(drawn[::2], drawn[1::2], strict=False):
            for one in workers.map(partial(_kept, work=work), pair):
                looked_at += 1
                found += [one] if one is not None else []
                print(f"{looked_at} ships, {len(found)} with something to be parted: {one}", flush=True)
            if len(found) >= given.ships:
                break
    options = "" if given.ships == _SHIPS else f"--ships {given.ships}"
    path = result_page.write("diagnose.parted", "Trials that part models", page(found, looked_at), options=options)
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
