"""What is said of a change of the code before it is adopted, and whether adopting it then does that.

A small fleet is simulated and identified. Copies of the source with one change each are asked by
``kempf rerun --all --preview`` what they would move; then each copy reprocesses a copy of the warehouse, and the moves
that came about are compared with those that were announced.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

from benchmarks.result_page import table, write

ROOT = Path(__file__).parents[2]
ROOMS = ("schemas", "pipeline", "warehouse", "flows", "workbench")
HULLS = ("mariner", "ferry", "tanker")
_KEMPF = "from kempf.workbench.cli import main; main()"


@dataclass(frozen=True)
class Change:
    """One change of the code: what it is called, in which file, what is there and what takes its place."""

    words: str
    file: str
    before: str
    after: str


_SETTINGS = "pipeline/estimate/maximum_likelihood.py"
CHANGES = (
    Change(
        "a remark", _SETTINGS, "from __future__ import annotations\n", "from __future__ import annotations\n# remark\n"
    ),
    Change(
        "gross errors begin at 3, not 5 deviations", _SETTINGS, "gate_width: float = 5.0", "gate_width: float = 3.0"
    ),
    Change(
        "the fit may stop a thousand times as early", _SETTINGS, "decrement: float = 1e-5", "decrement: float = 1e-2"
    ),
)


@dataclass(frozen=True)
class Stated:
    """What was said of one change, what came about, and how long either took, s."""

    change: Change
    preview: dict[str, Any]
    agreed: int
    sets: int
    preview_s: float
    adopt_s: float


def kempf(source: Path, *arguments: str) -> Any:
    """Run the command line of one copy of the source in a new process; return its JSON."""
    command = [sys.executable, "-c", _KEMPF, *arguments, "--json"]
    setting = {**os.environ, "PYTHONPATH": str(source), "DO_NOT_TRACK": "1"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=source, env=setting)
    if done.returncode:
        raise RuntimeError(f"{arguments}: {done.stdout} {done.stderr}")
    return json.loads(done.stdout)


def changed(folder: Path, change: Change) -> Path:
    """Copy the source and make one change in the copy."""
    for room in ROOMS:
        shutil.copytree(ROOT / room, folder / room)  # with what was compiled
    shutil.copytree(ROOT / "kempf", folder / "kempf", symlinks=True)
    path = folder / change.file
    text = path.read_text(encoding="utf-8")
    if text.count(change.before) != 1:
        raise RuntimeError(f"{change.file} has {text.count(change.before)} times {change.before!r}")
    path.write_text(text.replace(change.before, change.after), encoding="utf-8")
    return folder


def fleet(folder: Path, logs_each: int) -> Path:
    """Simulate the fleet, take its logs in and identify every ship; return the warehouse."""
    from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
    from kempf.flows.jobs.identify.pool_vessel import pool_vessel
    from kempf.flows.jobs.ingest.ingest_logs import ingest
    from kempf.pipeline.simulate.logger_profile import logger_profile
    from kempf.pipeline.simulate.mcap_log import to_mcap
    from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
    from kempf.warehouse.storage.store import Warehouse

    place = folder / "warehouse"
    warehouse = Warehouse(str(place))
    for hull in HULLS:
        for k in range(logs_each):
            settings = zigzag_settings(hull, duration_s=600.0, seed=100 * len(hull) + k)
            log = folder / f"{hull}-{k}.mcap"
            log.write_bytes(to_mcap(simulate_trial(settings)))
            ingest(warehouse, [log], given=logger_profile(settings))
        pool_vessel(warehouse, hull, Request(), identify_vessel(warehouse, hull))
    return place


def compared(place: Path, preview: dict[str, Any]) -> int:
    """Count the sets whose values after adopting are, bit for bit, those that were announced."""
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import parameter_sets

    wanted: dict[str, dict[str, float]] = {}
    for move in preview["moves"]:
        wanted.setdefault(move["becomes"], {})[move["parameter"]] = move["after"]
    found = 0
    for name, values in wanted.items():
        stored = {e.name: e.value for e in parameter_sets.get(Warehouse(str(place)), name).parameters}
        found += all(stored[parameter] == value for parameter, value in values.items())
    return found


def tried(folder: Path, place: Path, change: Change) -> Stated:
    """Ask a changed copy of the source, then let it do what it said."""
    source = changed(folder / "source", change)
    begin = perf_counter()
    preview = kempf(source, "rerun", "--all", "--preview", "--warehouse", str(place))
    asked = perf_counter()
    own = folder / "adopted"
    shutil.copytree(place, own)
    copied = perf_counter()
    for hull in HULLS:
        kempf(source, "reprocess", "--vessel", hull, "--warehouse", str(own))
    adopted = perf_counter()
    return Stated(change, preview, compared(own, preview), preview["moved"], asked - begin, adopted - copied)


def page(found: list[Stated], verify_s: float) -> list[str]:
    """Lines of the page."""
    head = ["change", "sets", "same bit for bit", "would move", "announced as it came", "largest move, standard errors"]
    rows = []
    for stated in found:
        p = stated.preview
        first = p["parameters"][0] if p["parameters"] else None
        largest = f"{first['largest_in_std']:+.2g} ({first['vessel']}, {first['parameter']})" if first else "-"
        same = p["up_to_date"] + p["identical"]  # of code that does the same, and of code that comes to the same
        counts = [str(p["sets"]), str(same), str(p["moved"])]
        rows.append([stated.change.words, *counts, f"{stated.agreed} of {stated.sets}", largest])
    lines = [*table(head, rows), ""]
    most = max(found, key=lambda stated: stated.preview["moved"])
    if most.preview["parameters"]:
        lines += [f"The largest moves of *{most.change.words}*:", ""]
        names = ["vessel", "parameter", "estimator", "sets", "largest, standard errors", "median", "std ratio"]
        shown = [
            [
                line["vessel"],
                line["parameter"],
                line["estimator"],
                str(line["sets"]),
                f"{line['largest_in_std']:+.3f}",
                f"{line['median_in_std']:.3f}",
                f"{line['std_ratio']:.3f}",
            ]
            for line in most.preview["parameters"][:8]
        ]
        lines += [*table(names, shown), ""]
    ratios = ", ".join(f"{stated.preview_s / stated.adopt_s:.2f}" for stated in found)
    verify = ", ".join(f"{stated.preview_s / verify_s:.2f}" for stated in found)
    return [
        f"{len(HULLS)} ships ({', '.join(HULLS)}), {found[0].preview['sets']} parameter sets. *Announced as it came*: "
        "sets whose values after `kempf reprocess` are, bit for bit, those that the preview had announced.",
        "",
        *lines,
        f"Time of the preview over that of adopting: {ratios}; over that of `kempf rerun --all --verify`: {verify}. "
        "Each with the start of its processes, one for each ship when adopting.",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=2, help="of each ship")
    options = parser.parse_args()
    with TemporaryDirectory() as name:
        place = fleet(Path(name), options.logs)
        found = []
        for k, change in enumerate(CHANGES):
            (Path(name) / str(k)).mkdir()
            found.append(tried(Path(name) / str(k), place, change))
        begin = perf_counter()
        kempf(ROOT, "rerun", "--all", "--verify", "--warehouse", str(place))
        stated = page(found, perf_counter() - begin)
    path = write(
        "fleet.adopt", "What code would move, shown before it is adopted", stated, options=f"--logs {options.logs}"
    )
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
