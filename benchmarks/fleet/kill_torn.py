"""``kill -9`` at random moments, and then the newest file cut off: one more run, or `kempf repair`, makes all whole.

``python -m benchmarks.fleet.kill_torn``. After the kill the file that was written last loses a random part of its end,
as where the power fails before it is on the disk. The same job is run once more; where it refuses, or `kempf verify`
names something, `kempf repair` is run and then the job. Then every table is held against an undisturbed run's.
"""

from __future__ import annotations

import argparse
import multiprocessing
import shutil
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.fleet.kill import VESSEL, bring_up_to_date, harbour, seen, take_in
from benchmarks.result_page import table, write
from kempf.flows.jobs.repair_warehouse import repair
from kempf.schemas.errors import KempfError, UsageError
from kempf.warehouse import compaction, segments
from kempf.warehouse.store import Warehouse
from kempf.warehouse.verify import verify

_KILLS, _SEED = 50, 31
_SERVER = multiprocessing.get_context("forkserver")


def exclude(warehouse: Warehouse, logs: Path) -> None:
    """Exclude a zigzag and reprocess."""
    from kempf.flows.jobs.correct_segments import plan_for
    from kempf.flows.jobs.reprocess_vessel import reprocess_vessel

    zigzag = min((s for s in segments.found_in(warehouse, VESSEL) if s.is_zigzag), key=lambda s: s.start_utc_ns)
    try:
        plan_for(warehouse, zigzag.segment_id, "exclude", "engine slowed").store(warehouse)
    except UsageError as error:
        if error.code != "nothing_to_correct":
            raise
    reprocess_vessel(warehouse, VESSEL)


def compact(warehouse: Warehouse, logs: Path) -> None:
    """Put the files of the tables into few."""
    compaction.compact(warehouse, more_files_than=1)


#: In this order: each begins with what the one before leaves.
JOBS: Mapping[str, Callable[[Warehouse, Path], None]] = {
    "ingest": take_in,
    "reprocess": bring_up_to_date,
    "exclude": exclude,
    "compact": compact,
}


@dataclass(frozen=True)
class Torn:
    """One kill with a cut: what was cut, and how it ended."""

    cut: str
    #: again: one more run made all whole. repaired: `kempf verify` named it, or the run refused, and repair mended it.
    #: wrong: neither.
    ended: str


def _work(job: str, place: Path, logs: Path) -> None:
    JOBS[job](Warehouse(str(place)), logs)


def start(job: str, place: Path, logs: Path) -> BaseProcess:
    """Start a job in a process of its own."""
    process = _SERVER.Process(target=_work, args=(job, place, logs))
    process.start()
    return process


def ended_well(job: str, place: Path, logs: Path) -> bool:
    """Run a job to its end; return whether it ended well."""
    process = start(job, place, logs)
    process.join()
    return process.exitcode == 0


def cut_newest(place: Path, random: np.random.Generator) -> str:
    """Cut the end of the file that was written last; return what it is."""
    files = [path for path in place.rglob("*") if path.is_file() and path.stat().st_size > 0]
    if not files:
        return "nothing"
    newest = max(files, key=lambda path: (path.stat().st_mtime_ns, str(path)))
    size = newest.stat().st_size
    with newest.open("r+b") as stream:
        stream.truncate(int(random.integers(size)))
    parts = newest.relative_to(place).parts
    if len(parts) == 1:
        return "marker"
    if parts[0] == "raw":
        return "raw"
    return "seal" if "_seals" in parts else "commit" if "_delta_log" in parts else "data"


def kill_once(
    job: str, begin: Path, folder: Path, logs: Path, wanted: Any, wait_s: float, random: np.random.Generator
) -> Torn:
    """Kill a job after a while, cut what it wrote last, go on, compare."""
    place = folder / "killed"
    shutil.rmtree(place, ignore_errors=True)
    if begin.exists():
        shutil.copytree(begin, place)
    process = start(job, place, logs)
    time.sleep(wait_s)
    process.kill()
    process.join()
    cut = cut_newest(place, random) if place.exists() else "nothing"
    warehouse = Warehouse(str(place))
    how = "again"
    if not ended_well(job, place, logs) or _named(warehouse):
        how = "repaired"
        repair(warehouse)
        ended_well(job, place, logs)
    try:
        whole = seen(warehouse) == wanted and not _named(warehouse)
    except KempfError:
        whole = False
    return Torn(cut, how if whole else "wrong")


def _named(warehouse: Warehouse) -> bool:
    try:
        return bool(verify(warehouse))
    except KempfError:
        return True


def measure(folder: Path, kills: int, seed: int) -> dict[str, list[Torn]]:
    """Kill every job so many times."""
    logs = harbour(folder / "logs")
    random = np.random.default_rng(seed)
    begin = folder / "nothing"
    found: dict[str, list[Torn]] = {}
    ended_well("ingest", folder / "compiling", logs)
    for job in JOBS:
        done = folder / f"{job}-undisturbed"
        if begin.exists():
            shutil.copytree(begin, done)
        since = time.perf_counter()
        if not ended_well(job, done, logs):
            raise RuntimeError(f"{job} failed undisturbed")
        whole_s = time.perf_counter() - since
        wanted = seen(Warehouse(str(done)))
        waits = whole_s * random.uniform(0.0, 1.0, kills)
        found[job] = [kill_once(job, begin, folder, logs, wanted, float(w), random) for w in waits]
        begin = done
    return found


def page(found: Mapping[str, Sequence[Torn]]) -> list[str]:
    """Return the lines of the page."""
    rows = []
    for job, torn in found.items():
        ends, cuts = Counter(one.ended for one in torn), Counter(one.cut for one in torn)
        cut = ", ".join(f"{count} {what}" for what, count in sorted(cuts.items()))
        rows.append([job, str(len(torn)), cut, *(str(ends[how]) for how in ("again", "repaired", "wrong"))])
    every = [one for torn in found.values() for one in torn]
    good = sum(one.ended != "wrong" for one in every)
    return [
        f"After **{good} of {len(every)}** kills with a cut everything was whole: by one more run, or because "
        "`kempf verify` named the damage and `kempf repair` mended it.",
        "",
        *table(["job", "kills", "file cut", "whole after one more run", "named and repaired", "wrong"], rows),
        "",
        "*Whole*: the rows of every table that a recorded log leads to, and the raw bytes, are those of an undisturbed "
        "run, and `kempf verify` finds nothing.",
    ]


def main() -> None:
    """Kill, cut and write ``results/kill_torn.md``."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=_KILLS, help="of each job")
    parser.add_argument("--seed", type=int, default=_SEED)
    given = parser.parse_args()
    _SERVER.set_forkserver_preload(["kempf.flows.jobs.reprocess_vessel", "kempf.flows.jobs.ingest_logs"])
    with TemporaryDirectory() as name:
        found = measure(Path(name), given.kills, given.seed)
    defaults = {"kills": _KILLS, "seed": _SEED}
    options = " ".join(f"--{key} {getattr(given, key)}" for key, n in defaults.items() if getattr(given, key) != n)
    write("fleet.kill_torn", "Killed, and the file written last cut off", page(found), options=options)


if __name__ == "__main__":
    main()
