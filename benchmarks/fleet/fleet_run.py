"""One run of the flow `reprocess` with what it costs: wall time, time in the batches, tasks, commits; for `fleet`."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any
from unittest.mock import patch

from kempf.flows.fleet import plan
from kempf.flows.process.cores import usable
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse


@dataclass(frozen=True)
class Run:
    """What one run did and cost."""

    #: In the fleet, or asked for.
    vessels: int
    #: changed, sets, reread: Vessels that something was done for, new parameter sets, logs read anew.
    changed: int
    sets: int
    reread: int
    #: From the call of the flow to its end.
    wall_s: float
    #: Of the processor, all threads of this process together.
    cpu_s: float
    #: Time inside the batches, summed over the threads; 0 where they ran elsewhere.
    busy_s: float = 0.0
    batches: int = 0
    #: By table.
    commits: dict[str, int] = field(default_factory=dict)
    #: Time for finding out who has something to do.
    plan_s: float = 0.0

    @property
    def engine_share(self) -> float:
        """Share of the threads' time that was not spent in batches: Prefect's, and waiting for the last batch."""
        return 1.0 - self.busy_s / (usable() * self.wall_s)


def with_prefect(warehouse: Warehouse, names: list[str] | None = None, dask: str | None = None) -> Run:
    """Run the flow; on the workers of a Dask cluster where an address is given."""
    from kempf.flows.fleet.engine import task_runner
    from kempf.flows.fleet.flows import reprocess

    flow = reprocess.with_options(task_runner=task_runner(dask or ""))
    before, watch = delta.versions(warehouse), _Watch()
    with watch.patched():
        begun, worked = time.perf_counter(), time.process_time()
        reports = flow(warehouse.uri, names)
        took = time.perf_counter() - begun, time.process_time() - worked
    assert isinstance(reports, list)
    commits = {name: at - before.get(name, 0) for name, at in delta.versions(warehouse).items()}
    return _run(reports, took, watch, commits)


def without_prefect(warehouse: Warehouse, names: list[str]) -> Run:
    """Do the same batches by plain threads."""
    watch = _Watch()
    with watch.patched():
        begun, worked = time.perf_counter(), time.process_time()
        reports = plan.do_fleet(warehouse, names)
        took = time.perf_counter() - begun, time.process_time() - worked
    return _run(reports, took, watch, {})


def _run(reports: list[dict[str, Any]], took: tuple[float, float], watch: _Watch, commits: dict[str, int]) -> Run:
    assert not any(report["failures"] for report in reports), reports
    return Run(
        vessels=len(reports),
        changed=sum(report["status"] == "changed" for report in reports),
        sets=sum(report["new_sets"] for report in reports),
        reread=sum(report["reread"] for report in reports),
        wall_s=took[0],
        cpu_s=took[1],
        busy_s=sum(watch.batches),
        batches=len(watch.batches),
        commits=commits,
        plan_s=sum(watch.plans),
    )


class _Watch:
    """Times of the batches and of the plan."""

    def __init__(self) -> None:
        self.batches: list[float] = []
        self.plans: list[float] = []

    @contextmanager
    def patched(self) -> Iterator[None]:
        with (
            patch.object(plan, "do_batch", _timed(plan.do_batch, self.batches)),
            patch.object(plan, "plan", _timed(plan.plan, self.plans)),
        ):
            yield


def _timed(function: Any, into: list[float]) -> Any:
    def wrapped(*arguments: Any, **named: Any) -> Any:
        begun = time.perf_counter()
        try:
            return function(*arguments, **named)
        finally:
            into.append(time.perf_counter() - begun)

    return wrapped


def size_bytes(warehouse: Warehouse) -> dict[str, int]:
    """Bytes of every folder of a warehouse."""
    assert warehouse.folder is not None
    return {
        folder.name: sum(f.stat().st_size for f in folder.rglob("*") if f.is_file())
        for folder in sorted(warehouse.folder.iterdir())
        if folder.is_dir()
    }


def quiet() -> None:
    """What the flows log is of no interest here."""
    os.environ.setdefault("PREFECT_LOGGING_LEVEL", "WARNING")
