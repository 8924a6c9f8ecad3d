"""What a fit with the true structure attains: made after the answers are opened, never before.

For every case with an effect of the catalogue: the model with that effect alone, fitted to the runs that the program
fitted too, and its free-run error on those that it held out.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from os import cpu_count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.vessel_runs import layout_of
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.pipeline.diagnose.screening.found_instants import at_found_instants, fitted_runs
from kempf.pipeline.diagnose.split import split
from kempf.pipeline.predict.free_run import free_run
from kempf.schemas.effects import catalogue
from kempf.schemas.errors import KempfError
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse


def with_the_truth(folder: Path, effect: str) -> dict[str, Any]:
    """Return the fit with the true structure as JSON content; ``error`` where it cannot be made.

    Parameters
    ----------
    folder : Path
        Of the case.
    effect : str
        Its name in the catalogue.
    """
    with TemporaryDirectory() as place:
        warehouse = Warehouse(place)
        logs = sorted(p for p in folder.iterdir() if p.name != "profile.yaml")
        ingest(warehouse, logs, None, read_profiles([folder / "profile.yaml"]))
        try:
            layout = layout_of(warehouse, choose(warehouse, folder.name), ModelSpec())
            laid = layout.runs()
            with ThreadPoolExecutor(max_workers=cpu_count()) as workers:
                plain = fitted_runs(laid.runs, laid.spec, (), workers)
                made = at_found_instants(plain, layout.runs_at, (), workers)
                fits = fitted_runs(made.runs, laid.spec, [catalogue()[effect]], workers).fits
            held = [made.runs[i] for i in split(made.runs)[1]]
            # lasting noise of instruments as they are sold may stand before it
            first = int(np.argmax(fits[1].model.own(effect)))
            return {
                "plain_held_out": float(np.mean([free_run(fits[0], run).relative_error for run in held])),
                "held_out": float(np.mean([free_run(fits[1], run).relative_error for run in held])),
                "likelihood_ratio": 2.0 * (fits[1].log_likelihood - fits[0].log_likelihood),
                "value": float(fits[1].values[first]),
                "std": float(fits[1].std[6 + first]),
            }
        except KempfError as error:
            return error.as_json()


def all_with_the_truth(cases: Path, truth: Mapping[str, Mapping[str, Any]], out: Path) -> None:
    """Make the fits of every case that the catalogue holds; one that is there is not made again.

    Parameters
    ----------
    cases : Path
        Folder of the cases.
    truth : mapping
        Opened answers by case.
    out : Path
        Gets one JSON file a case.
    """
    out.mkdir(parents=True, exist_ok=True)
    for name, one in sorted(truth.items()):
        path = out / f"{name}.json"
        if one["kind"] == "catalogue" and not path.exists():
            path.write_text(json.dumps(with_the_truth(cases / name, one["effect"])), encoding="utf-8")
