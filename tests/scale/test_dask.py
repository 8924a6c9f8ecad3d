"""The fleet on two Dask workers with its warehouse in a bucket: real scheduler, real workers, real S3 server."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from shutil import copytree
from threading import Thread
from typing import Any

import pytest

from kempf.flows.fleet.plan import do_fleet
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import runs
from tests.flows.content import seen
from tests.scale.cluster import Cluster, Worker
from tests.scale.conftest import FLEET, Bucket, Server, touch
from tests.scale.servers import environment, wait_for

pytest.importorskip("prefect_dask", reason="kempf[dask] is not installed")


@dataclass(frozen=True)
class Two:
    address: str
    workers: list[Worker]


@pytest.fixture(scope="module")
def cluster(bucket: Bucket, server: Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Two]:
    with ExitStack() as stack:
        started = Cluster(tmp_path_factory.mktemp("dask"), environment(**bucket.settings, **server.settings), stack)
        yield Two(started.address, [started.worker(), started.worker()])


@pytest.fixture
def fleet(bucket: Bucket, stocked: Path, tmp_path: Path) -> Warehouse:
    """The stocked warehouse, copied into the bucket as it stands."""
    from pyarrow import fs

    warehouse = Warehouse(f"{bucket.uri}/{tmp_path.name}", bucket.settings)
    files, root = warehouse._files
    fs.copy_files(str(stocked), root, source_filesystem=fs.LocalFileSystem(), destination_filesystem=files)
    return warehouse


def run(cluster: Two, warehouse: Warehouse, bucket: Bucket, **options: Any) -> list[dict[str, Any]]:
    """Run the flow in this process on the cluster's workers."""
    from kempf.flows.fleet.engine import task_runner
    from kempf.flows.fleet.flows import reprocess

    with pytest.MonkeyPatch.context() as patched:
        for name, value in bucket.settings.items():
            patched.setenv(name, value)
        found = reprocess.with_options(task_runner=task_runner(cluster.address))(warehouse.uri, **options)
    assert isinstance(found, list)
    return found


def test_two_workers_do_what_one_process_does(
    cluster: Two, fleet: Warehouse, bucket: Bucket, stocked: Path, tmp_path: Path, on_server: None
) -> None:
    alone = Warehouse(str(copytree(stocked, tmp_path / "alone")))
    for warehouse in (fleet, alone):
        touch(warehouse, *FLEET)
    reports = run(cluster, fleet, bucket)
    assert [(r["vessel"], r["status"], r["reread"], r["new_sets"]) for r in reports] == [
        (name, "changed", 1, 1) for name in FLEET
    ]
    did = [worker.log.read_text() for worker in cluster.workers]
    assert all(any(f"{name}: changed" in text for name in FLEET) for text in did), "each of the two had a share"
    do_fleet(alone)
    there, here = seen(fleet), seen(alone)
    for stated in (there, here):  # which run made a set differs, what it says does not
        for row in stated["parameter_sets"]:
            row["provenance_json"] = without_run(row["provenance_json"])
    assert there == here
    assert [r["status"] for r in run(cluster, fleet, bucket)] == ["unchanged"] * len(FLEET)


def without_run(text: str) -> str:
    return json.dumps({k: v for k, v in json.loads(text).items() if k != "flow_run"}, sort_keys=True)


def test_a_worker_that_dies_takes_nothing_with_it(
    cluster: Two, fleet: Warehouse, bucket: Bucket, on_server: None
) -> None:
    touch(fleet, *FLEET)
    victim, log = cluster.workers[1].process, cluster.workers[1].log
    before = len(log.read_text())

    def kill_at_work() -> None:
        wait_for(lambda: len(log.read_text()) > before, every_s=0.02)
        victim.kill()

    killer = Thread(target=kill_at_work)
    killer.start()
    reports = run(cluster, fleet, bucket)
    killer.join()
    victim.wait(timeout=30)
    assert victim.returncode == -signal.SIGKILL
    assert [(r["vessel"], bool(r["failures"])) for r in reports] == [(name, False) for name in FLEET]
    assert len(seen(fleet)["parameter_sets"]) == 2 * len(FLEET)
    assert {one.status for one in runs.all_runs(fleet, "reprocess")} <= {"changed", "unchanged"}
