"""Diagnose the hidden cases: ``python -m benchmarks.diagnose.hidden_effects.examine --cases DIR/cases --out ANSWERS``.

Raw logs through the whole job: ingest, zigzags, diagnosis, as `kempf ingest` and `kempf diagnose` do it. One JSON file
a case; one that is there is not made again, so an interrupted run goes on, and several processes may share the work
with ``--part 1/2`` and ``--part 2/2``. Nothing here knows the answers.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_vessel
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.schemas.errors import KempfError
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse


def examine(folder: Path) -> dict[str, Any]:
    """Return what the program says of one case, JSON content: `diagnosis` or `error`, zigzags found, seconds taken.

    Parameters
    ----------
    folder : Path
        With the logs and ``profile.yaml``; its name is the vessel's.
    """
    begun = time.perf_counter()
    with TemporaryDirectory() as place:
        warehouse = Warehouse(place)
        logs = sorted(p for p in folder.iterdir() if p.name != "profile.yaml")
        taken = ingest(warehouse, logs, None, read_profiles([folder / "profile.yaml"]))
        read = time.perf_counter()
        found: dict[str, Any] = {"zigzags": [len(one.segments) for one in taken]}
        try:
            stored, _ = diagnose_vessel(warehouse, folder.name, ModelSpec())
            found["diagnosis"] = dict(stored.content)
        except KempfError as error:
            found |= error.as_json()
    done = time.perf_counter()
    return found | {"seconds": {"ingest": read - begun, "diagnose": done - read}}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--part", default="1/1", help="which part of the cases, such as 1/2")
    parser.add_argument("--at-most", type=int, help="stop after so many cases")
    given = parser.parse_args(arguments)
    part, parts = (int(x) for x in given.part.split("/"))
    given.out.mkdir(parents=True, exist_ok=True)
    # ids are random, so their order is a sample whichever part of it is done
    folders = sorted(p for p in given.cases.iterdir() if p.is_dir())[part - 1 :: parts][: given.at_most]
    for number, folder in enumerate(folders, start=1):
        path = given.out / f"{folder.name}.json"
        if path.exists():
            continue
        answer = examine(folder)
        unfinished = path.with_suffix(".part")
        unfinished.write_text(json.dumps(answer), encoding="utf-8")
        unfinished.rename(path)
        said = answer.get("diagnosis", {}).get("verdict") or answer["error"]["code"]
        print(f"{number} of {len(folders)}: {folder.name} {said}, {answer['seconds']['diagnose']:.0f} s", flush=True)


if __name__ == "__main__":
    main()
