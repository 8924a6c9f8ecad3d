"""``kill -9`` at random moments of ingest and of reprocessing: after one more run the tables say what they should.

Each job runs in a process of its own that is killed at a moment drawn with a fixed seed. What is seen then must be
whole; the same job is run once more, and every table is held against those of a run that nobody disturbed.
"""

from __future__ import annotations

import argparse
import json
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
import yaml

from benchmarks.result_page import table, write
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import runs, vessels
from tests.flows import content as contents

VESSEL = "mariner"
_ENDINGS = ("nmea.gz", "csv.gz", "mcap")
#: Starts a job on a warehouse with the logs of a folder; what it returns can be killed and waited for. Another way to
#: run the same jobs, on a cluster for example, is another function of this kind.
Launch = Callable[[str, Path, Path], BaseProcess]


def harbour(folder: Path) -> Path:
    """Write three logs of one ship and her profile."""
    from kempf.pipeline.simulate.csv_log import to_csv
    from kempf.pipeline.simulate.logger_profile import logger_profile
    from kempf.pipeline.simulate.mcap_log import to_mcap
    from kempf.pipeline.simulate.nmea_log import to_nmea
    from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings

    folder.mkdir(parents=True)
    for seed, (ending, made) in enumerate(zip(_ENDINGS, (to_nmea, to_csv, to_mcap), strict=True)):
        settings = zigzag_settings(VESSEL, duration_s=400.0, seed=seed)
        (folder / f"day{seed}.{ending}").write_bytes(made(simulate_trial(settings)))
    profile = logger_profile(settings).model_dump(mode="json", exclude_defaults=True)
    (folder / "profile.yaml").write_text(yaml.safe_dump(profile), encoding="utf-8")
    return folder


def take_in(warehouse: Warehouse, logs: Path) -> None:
    """Ingest the three logs and identify the ship."""
    from kempf.flows.jobs.ingest.files import read_profiles
    from kempf.flows.jobs.ingest.ingest_logs import ingest
    from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel

    paths = [logs / f"day{k}.{ending}" for k, ending in enumerate(_ENDINGS)]
    outcomes = ingest(warehouse, paths, given=read_profiles([logs / "profile.yaml"]))
    failed = [o.error for o in outcomes if o.error]
    report = reprocess_vessel(warehouse, VESSEL)
    if failed or report.failures:
        raise RuntimeError(f"the job failed: {failed} {report.failures}")


def bring_up_to_date(warehouse: Warehouse, logs: Path) -> None:
    """Change the profile and reprocess: every log is read anew, every zigzag found and identified anew."""
    from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel

    vessels.register(warehouse, VESSEL, vessels.current(warehouse, VESSEL).model_copy(update={"wind_arm_per_m": 0.005}))
    report = reprocess_vessel(warehouse, VESSEL)
    if report.failures:
        raise RuntimeError(f"the job failed: {report.failures}")


JOBS: Mapping[str, Callable[[Warehouse, Path], None]] = {"ingest": take_in, "reprocess": bring_up_to_date}
_SERVER = multiprocessing.get_context("forkserver")


def _work(job: str, place: Path, logs: Path) -> None:
    JOBS[job](Warehouse(str(place)), logs)


def locally(job: str, place: Path, logs: Path) -> BaseProcess:
    """Start a job in a process of its own on this machine, with everything imported already."""
    process = _SERVER.Process(target=_work, args=(job, place, logs))
    process.start()
    return process


def finished(job: str, place: Path, logs: Path, launch: Launch) -> float:
    """Run a job to its end; return how long that took, s."""
    begin = time.perf_counter()
    process = launch(job, place, logs)
    process.join()
    if process.exitcode != 0:
        raise RuntimeError(f"{job} ended with {process.exitcode}")
    return time.perf_counter() - begin


def halves(content: Mapping[str, list[dict[str, Any]]]) -> list[str]:
    """Name what is in, but not whole."""
    found = []
    readings = Counter(row["ingest_id"] for row in content["readings"])
    refused = Counter(row["ingest_id"] for row in content["rejected"])
    zigzags = Counter(row["ingest_id"] for row in content["segments"])
    for row in content["logs"]:
        name, wanted = row["file_name"], row["records_rejected"] + row["values_rejected"]
        if (readings[row["ingest_id"]], refused[row["ingest_id"]]) != (row["records_kept"], wanted):
            found.append(f"{name}: {readings[row['ingest_id']]} readings of {row['records_kept']}")
        if not zigzags[row["ingest_id"]]:
            found.append(f"{name}: no zigzag")
        if {"name": row["log_id"], "size": row["size_bytes"]} not in content["raw"]:
            found.append(f"{name}: no raw bytes")
    known = {row["parameter_set_id"] for row in content["parameter_sets"]}
    found += [f"alias {a['alias']} of nothing" for a in content["aliases"] if a["parameter_set_id"] not in known]
    return found


@dataclass(frozen=True)
class Killed:
    """One kill: how far the undisturbed job would have been, how far this one was, and whether all came right."""

    moment: float
    in_time: bool
    logs: int
    sets: int
    halves: tuple[str, ...]
    equal: bool
    rows: bool


def kill_once(job: str, begin: Path, folder: Path, logs: Path, wanted: Any, wait_s: float, launch: Launch) -> Killed:
    """Kill a job after a while, look, run it once more, compare."""
    place = folder / "killed"
    if begin.exists():
        shutil.copytree(begin, place)
    process = launch(job, place, logs)
    time.sleep(wait_s)
    in_time = process.is_alive()
    process.kill()
    process.join()
    warehouse = Warehouse(str(place))
    content = seen(warehouse) if warehouse.exists() else {}
    half = tuple(halves(content)) if content else ()
    finished(job, place, logs, launch)
    said, rows = wanted
    after = seen(warehouse)
    result = Killed(
        moment=wait_s,
        in_time=in_time,
        logs=len(content.get("logs", [])),
        sets=len(content.get("parameter_sets", [])),
        halves=half,
        equal=after == said,
        rows=stored_rows(warehouse) == rows,
    )
    shutil.rmtree(place)
    return result


def stored_rows(warehouse: Warehouse) -> dict[str, int]:
    """Count every row of the tables, reachable or not: what is there twice would show. Runs come on top."""
    return {name: delta.read(warehouse, name).height for name in delta.versions(warehouse) if name not in contents.RUNS}


def seen(warehouse: Warehouse) -> dict[str, list[dict[str, Any]]]:
    """Return what the warehouse says, but for the run that said it."""
    found = contents.seen(warehouse)
    for row in found["parameter_sets"]:
        known = json.loads(row["provenance_json"])
        row["provenance_json"] = json.dumps({k: v for k, v in known.items() if k != "flow_run"}, sort_keys=True)
    return found


def measure(
    folder: Path, kills: int, seed: int, launch: Launch, *, jobs: Sequence[str], begin: Path
) -> dict[str, tuple[float, list[Killed]]]:
    """Kill each job so many times; return how long it takes undisturbed, s, and what became of each.

    Each begins with the warehouse that the one before left, the first with ``begin``, which need not be there.
    """
    logs = harbour(folder / "logs")
    random = np.random.default_rng(seed)
    found: dict[str, tuple[float, list[Killed]]] = {}
    for k, job in enumerate(jobs):
        done, first = folder / f"{job}-undisturbed", folder / "compiling"
        for place in (first, done) if k == 0 else (done,):
            if begin.exists():
                shutil.copytree(begin, place)
            if place is first:
                finished(job, place, logs, launch)
        whole_s = finished(job, done, logs, launch)
        warehouse = Warehouse(str(done))
        wanted = (seen(warehouse), stored_rows(warehouse))
        waits = whole_s * random.uniform(0.0, 1.0, kills)
        found[job] = whole_s, [kill_once(job, begin, folder, logs, wanted, float(w), launch) for w in waits]
        begin = done
    if runs.all_runs(Warehouse(str(begin)))[0].status != "changed":
        raise RuntimeError("the undisturbed run did nothing")
    return found


def stated(found: Mapping[str, tuple[float, list[Killed]]]) -> list[str]:
    """Lines that say what became of the kills."""
    head = [
        "job",
        "kills",
        "before its end",
        "readings of logs in when killed",
        "sets in when killed",
        "half in",
        "equal after",
    ]
    head.append("no row too many")
    rows = []
    for job, (_, killed) in found.items():
        logs, sets = (Counter(getattr(k, what) for k in killed) for what in ("logs", "sets"))
        rows.append(
            [
                job,
                str(len(killed)),
                str(sum(k.in_time for k in killed)),
                ", ".join(f"{n}: {logs[n]}" for n in sorted(logs)),
                ", ".join(f"{n}: {sets[n]}" for n in sorted(sets)),
                str(sum(bool(k.halves) for k in killed)),
                f"{sum(k.equal for k in killed)} of {len(killed)}",
                f"{sum(k.rows for k in killed)} of {len(killed)}",
            ]
        )
    kills = sum(len(killed) for _, killed in found.values())
    good = sum(k.equal and k.rows and not k.halves for _, killed in found.values() for k in killed)
    return [
        f"After **{good} of {kills}** kills nothing was half in, and one more run made of every table what an "
        "undisturbed run makes of it.",
        "",
        *table(head, rows),
    ]


def page(found: Mapping[str, tuple[float, list[Killed]]], seed: int) -> list[str]:
    """Lines of the page."""
    return [
        *stated(found),
        "",
        "`ingest` takes in three logs of one ship (NMEA, delimited text, MCAP) and identifies her; `reprocess` then "
        "changes her profile, so that every log is read anew (six readings in all) and every set made anew. Moments "
        f"are drawn evenly over the time that the undisturbed job takes, seed {seed}; one that is faster than that is "
        "done before it is killed. *Half in*: a log that counts without all its readings, refusals, raw bytes or its "
        "zigzag, or an alias of nothing. *Equal*: the rows of every table that a recorded log leads to, and the raw "
        "bytes; versions of tables in a set's provenance tell how the work went and are left out. *No row too many*: "
        "rows of every table but the list of runs, also those that nothing leads to.",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=25, help="of each job")
    parser.add_argument("--seed", type=int, default=9)
    options = parser.parse_args()
    _SERVER.set_forkserver_preload(
        ["kempf.flows.jobs.reprocess.reprocess_vessel", "kempf.flows.jobs.ingest.ingest_logs"]
    )
    with TemporaryDirectory() as name:
        folder = Path(name)
        found = measure(folder, options.kills, options.seed, locally, jobs=tuple(JOBS), begin=folder / "nothing")
    asked = f"--kills {options.kills} --seed {options.seed}"
    path = write("fleet.kill", "Killed at random moments", page(found, options.seed), options=asked)
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
