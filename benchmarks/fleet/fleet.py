"""A fleet of simulated vessels reprocessed: the cost, Prefect's share, nothing changed, one log changed, Dask.

A real Prefect server on this machine; Dask with a real scheduler and workers that have one core each. Times are of one
run on one machine: look at their ratios. ``--draw`` makes the pages anew from the figures of the last run.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.fleet import fleet_commits, fleet_figures, fleet_logs, fleet_page, fleet_run
from kempf.flows.process.cores import usable
from kempf.warehouse.storage.store import Warehouse
from tests.scale.cluster import Cluster
from tests.scale.servers import environment, free_port, running

#: The fleet grows in these steps: what a vessel costs is measured at each.
STEPS = (0.125, 0.25, 0.5, 1.0)
#: Vessels of the comparisons that have to do everything twice.
SUBSET = 24
#: Rounds of Prefect, plain threads, plain threads, Prefect: a drift is in both pairs of a round, one way each.
ROUNDS = 2


@contextmanager
def prefect_server(folder: Path) -> Iterator[dict[str, str]]:
    """Start a server as docs/fleet.md says, and let this process report to it."""
    port = free_port()
    settings = {
        "PREFECT_HOME": str(folder / "prefect"),
        "PREFECT_API_URL": f"http://127.0.0.1:{port}/api",
        "PREFECT_SERVER_API_PORT": str(port),
        "DO_NOT_TRACK": "1",
        "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
    }
    command = [sys.executable, "-m", "prefect", "server", "start", "--host", "127.0.0.1"]
    os.environ.update(settings)
    with running(command, environment(**settings), folder / "server.log", port=port, within_s=300.0):
        yield settings


@contextmanager
def dask_cluster(folder: Path, n_workers: int, settings: dict[str, str]) -> Iterator[str]:
    """Start a scheduler and workers, the k-th on the k-th core alone, as if each were a machine."""
    cores = sorted(os.sched_getaffinity(0))
    with ExitStack() as stack:
        env = environment(**settings, PREFECT_LOGGING_LEVEL="WARNING")
        cluster = Cluster(folder / f"dask{n_workers}", env, stack)
        for k in range(n_workers):
            cluster.worker(cores[k % len(cores)])
        yield cluster.address


def grow(warehouse: Warehouse, voyages: fleet_logs.Voyages, n_vessels: int) -> list[dict[str, Any]]:
    """Let the fleet grow step by step; at each reprocess the new vessels, and then nothing."""
    found, there = [], 0
    for step in STEPS:
        wanted = max(round(step * n_vessels), there + 1)
        begun = time.perf_counter()
        fleet_logs.take_in(warehouse, voyages, range(there, wanted))
        took = time.perf_counter() - begun
        first, again = fleet_run.with_prefect(warehouse), fleet_run.with_prefect(warehouse)
        assert (first.changed, again.changed) == (wanted - there, 0), (first, again)
        found.append(
            {
                "vessels": wanted,
                "new": wanted - there,
                "take_in_s": took,
                "first": asdict(first),
                "again": asdict(again),
            }
        )
        print(
            f"{wanted} vessels: {first.wall_s:.1f} s for {wanted - there}, {again.wall_s:.1f} s for nothing", flush=True
        )
        there = wanted
    return found


def side_by_side(warehouse: Warehouse, names: list[str]) -> list[dict[str, dict[str, float]]]:
    """Do the same by Prefect and by plain threads in turns; return what each cost, in pairs."""

    def one(way: str) -> dict[str, float]:
        fleet_logs.touch(warehouse, names)
        run = (fleet_run.with_prefect if way == "engine" else fleet_run.without_prefect)(warehouse, names)
        return {"wall_s": run.wall_s, "cpu_s": run.cpu_s}

    found = []
    for order in (("engine", "plain"), ("plain", "engine")) * ROUNDS:
        found.append({way: one(way) for way in order})
        print(f"beside plain threads: {found[-1]}", flush=True)
    return found


def by_workers(folder: Path, settings: dict[str, str], warehouse: Warehouse, names: list[str]) -> dict[int, float]:
    """Let one Dask worker and then two do the same; return the seconds by their number."""
    found = {}
    for n_workers in (1, 2):
        with dask_cluster(folder, n_workers, settings) as address:
            fleet_logs.touch(warehouse, names[:n_workers])  # each worker loads its compiled code
            fleet_run.with_prefect(warehouse, names[:n_workers], address)
            fleet_logs.touch(warehouse, names)
            found[n_workers] = fleet_run.with_prefect(warehouse, names, address).wall_s
        print(f"{n_workers} Dask workers: {found[n_workers]:.1f} s", flush=True)
    return found


def dask_again(folder: Path, n_logs: int) -> dict[str, Any]:
    """Measure Dask alone, on a fleet of its own."""
    warehouse = Warehouse(str(folder / "w"))
    with prefect_server(folder) as settings:
        fleet_logs.take_in(warehouse, fleet_logs.simulate(n_logs), range(SUBSET))
        fleet_run.with_prefect(warehouse)
        found = by_workers(folder, settings, warehouse, [fleet_logs.name_of(k) for k in range(SUBSET)])
    return {"dask_s": {str(n): wall for n, wall in found.items()}, "dask_of": SUBSET}


def measure(folder: Path, n_vessels: int, n_logs: int, sizes: Sequence[int]) -> dict[str, Any]:
    """Measure everything on a fleet of some size, and commits to tables of several."""
    commits = fleet_commits.measure(folder / "commits", sizes)
    voyages = fleet_logs.simulate(n_logs)
    warehouse = Warehouse(str(folder / "w"))
    names = [fleet_logs.name_of(k) for k in range(n_vessels)]
    subset = names[: min(SUBSET, n_vessels)]
    with prefect_server(folder) as settings:
        warm = Warehouse(str(folder / "warm"))
        fleet_logs.take_in(warm, voyages, range(1))
        fleet_run.with_prefect(warm)  # what is compiled once is no part of the figures
        steps = grow(warehouse, voyages, n_vessels)
        fleet_logs.touch(warehouse, names)
        whole = fleet_run.with_prefect(warehouse)
        print(f"whole fleet: {whole.wall_s:.1f} s", flush=True)
        again = fleet_run.with_prefect(warehouse)
        fleet_logs.one_more(warehouse, voyages, n_vessels // 2)
        one = fleet_run.with_prefect(warehouse)
        pairs = side_by_side(warehouse, subset)
        dask = by_workers(folder, settings, warehouse, subset)
    return {
        "vessels": n_vessels,
        "logs": n_logs,
        "cores": usable(),
        "steps": steps,
        "whole": {**asdict(whole), "engine_share": whole.engine_share},
        "again": asdict(again),
        "one": asdict(one),
        "subset": len(subset),
        "pairs": pairs,
        "dask_s": {str(n): wall for n, wall in dask.items()},
        "dask_of": n_vessels,
        "commits": commits,
        "bytes": fleet_run.size_bytes(warehouse),
        "log_bytes": len(voyages.rows[fleet_logs.HULLS[0]][0]),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vessels", type=int, default=200)
    parser.add_argument("--logs", type=int, default=5)
    parser.add_argument(
        "--commit-vessels",
        type=int,
        nargs="+",
        default=[100, 1000, 10_000],
        metavar="N",
        help="commits are measured to tables of so many vessels, of which docs/scale.md is about the largest",
    )
    parser.add_argument("--dask", action="store_true", help="only Dask anew, beside the other figures of the last run")
    parser.add_argument("--draw", action="store_true", help="only the pages, from the figures of the last run")
    options = parser.parse_args()
    if min(options.commit_vessels) < fleet_commits.TOGETHER:
        parser.error(f"--commit-vessels: {fleet_commits.TOGETHER} or more each")
    fleet_run.quiet()
    try:
        if not options.draw:
            before = fleet_figures.stored() if options.dask else {}
            with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
                figures = (
                    {**before, **dask_again(Path(folder), options.logs)}
                    if options.dask
                    else measure(Path(folder), options.vessels, options.logs, options.commit_vessels)
                )
            fleet_figures.store(figures)
        path = fleet_page.write(fleet_figures.stored())
    except fleet_figures.OldFigures as error:
        raise SystemExit(str(error)) from error
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
