"""``kill -9`` at random moments of a fleet's reprocessing on Dask: the run itself, or one of the two workers.

A real scheduler, two workers of one core each and a Prefect server; what was killed is started anew, as its service
would be, and the same run is made once more. Every table is then held against that of a run that nobody disturbed.
"""

from __future__ import annotations

import argparse
import multiprocessing
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Protocol

from benchmarks.fleet import fleet, fleet_logs, kill
from benchmarks.result_page import write
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels
from tests.scale.cluster import Cluster
from tests.scale.servers import environment

FLEET, WORKERS = 4, 2


class Mortal:
    """A cluster of which each worker can die and come back."""

    def __init__(self, folder: Path, settings: dict[str, str], stack: ExitStack) -> None:
        self.cluster = Cluster(folder / "dask", environment(**settings, PREFECT_LOGGING_LEVEL="WARNING"), stack)
        self.workers = [self.cluster.worker().process for _ in range(WORKERS)]

    def kill(self, number: int) -> None:
        """Kill one worker."""
        self.workers[number].kill()
        self.workers[number].wait()

    def mend(self) -> None:
        """Start what died, and wait until nobody works any more for a run that is gone."""
        from distributed import Client

        self.workers = [self.cluster.worker().process if one.poll() is not None else one for one in self.workers]
        with Client(self.cluster.address) as client:  # a worker has one thread: this waits behind what it does
            there = list(client.scheduler_info(n_workers=-1)["workers"])
            client.gather([client.submit(abs, k, workers=[one], pure=False) for k, one in enumerate(there)])


class Process(Protocol):
    """What `multiprocessing` gives."""

    exitcode: int | None

    def is_alive(self) -> bool: ...
    def kill(self) -> None: ...
    def join(self) -> None: ...


class Run:
    """One run of the fleet; to kill it is to kill its own process, or a worker below it, in turn."""

    def __init__(self, mortal: Mortal, kills: list[str], job: str, place: Path, logs: Path) -> None:
        self.mortal, self.kills = mortal, kills
        mortal.mend()
        self.process: Process = multiprocessing.get_context("spawn").Process(
            target=bring_up_to_date, args=(mortal.cluster.address, str(place))
        )
        self.process.start()

    @property
    def exitcode(self) -> int | None:
        return self.process.exitcode

    def is_alive(self) -> bool:
        return self.process.is_alive()

    def kill(self) -> None:
        victim = len(self.kills) % (1 + WORKERS)
        self.kills.append("run" if victim == WORKERS else "worker")
        if victim == WORKERS:
            self.process.kill()
        else:
            self.mortal.kill(victim)

    def join(self) -> None:
        self.process.join()
        self.mortal.mend()


def bring_up_to_date(address: str, place: str) -> None:
    """Change every profile to the same new one and reprocess the fleet on the cluster."""
    from benchmarks.fleet import fleet_run

    warehouse = Warehouse(place)
    for name in vessels.names(warehouse):
        profile = vessels.current(warehouse, name).model_copy(update={"wind_arm_per_m": 0.005})
        vessels.register(warehouse, name, profile)
    fleet_run.with_prefect(warehouse, dask=address)


def stocked(place: Path) -> Path:
    """A fleet that was taken in and identified."""
    warehouse, voyages = Warehouse(str(place)), fleet_logs.simulate(1)
    fleet_logs.take_in(warehouse, voyages, range(FLEET))
    from kempf.flows.fleet.plan import do_fleet

    assert not any(report["failures"] for report in do_fleet(warehouse))
    return place


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=26)
    parser.add_argument("--seed", type=int, default=9)
    options = parser.parse_args()
    fleet.fleet_run.quiet()
    with TemporaryDirectory(ignore_cleanup_errors=True) as name, ExitStack() as stack:
        folder = Path(name)
        settings = stack.enter_context(fleet.prefect_server(folder))
        mortal, victims = Mortal(folder, settings, stack), list[str]()
        launch = partial(Run, mortal, victims)
        found = kill.measure(
            folder, options.kills, options.seed, launch, jobs=("reprocess",), begin=stocked(folder / "stocked")
        )
    stated = kill.stated(found)
    path = write(
        "fleet.kill_dask",
        "Killed at random moments, on Dask",
        [
            *stated,
            "",
            f"{FLEET} ships with a log each are read and identified anew on {WORKERS} Dask workers. Killed were "
            f"{victims.count('worker')} times a worker, in which case the run goes on with the other one, and "
            f"{victims.count('run')} times the run's own process, whose workers finish what they have begun. Moments, "
            f"seed {options.seed}, and columns as in [kill.md](kill.md).",
        ],
        options=f"--kills {options.kills} --seed {options.seed}",
    )
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
