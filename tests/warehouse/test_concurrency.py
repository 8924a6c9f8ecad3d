from __future__ import annotations

import multiprocessing
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.managers import SyncManager

import pytest

from kempf.schemas.errors import DataRejected, KempfError
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage import delta, retry
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, parameter_sets, readings, vessels
from kempf.warehouse.tables.deposit import deposit
from tests.warehouse.samples import delivery, inputs, parameter_set

SPAWN = multiprocessing.get_context("spawn")


class Crew:
    """Four processes that wait for work, so that what they are given starts together."""

    def __init__(self, pool: ProcessPoolExecutor, manager: SyncManager) -> None:
        self.pool, self.manager = pool, manager

    def at_once(self, work: Callable, arguments: list[tuple]) -> list:
        gate = self.manager.Barrier(len(arguments))
        return [f.result(120) for f in [self.pool.submit(work, gate, *given) for given in arguments]]


@pytest.fixture(scope="module")
def crew() -> Iterator[Crew]:
    with SPAWN.Manager() as manager, ProcessPoolExecutor(4, mp_context=SPAWN) as pool:
        yield Crew(pool, manager)


def ingest_some(gate, uri: str, vessel: str, names: list[bytes]) -> list[str]:
    gate.wait(60)
    return [deposit(Warehouse(uri), [delivery(vessel, name)])[0].outcome for name in names]


def claim(gate, uri: str, vessel: str) -> str:
    gate.wait(60)
    try:
        return deposit(Warehouse(uri), [delivery(vessel)])[0].outcome
    except DataRejected as error:
        return error.code


def insert_some(gate, uri: str, worker: int, count: int) -> None:
    gate.wait(60)
    for i in range(count):
        one = parameter_set("aurora", inputs(settings={"worker": worker, "i": i}))
        shared = parameter_set("aurora", inputs(settings={"shared": i}))
        parameter_sets.insert(Warehouse(uri), [one, shared])


def register_one(gate, uri: str, length_m: float) -> None:
    gate.wait(60)
    vessels.register(Warehouse(uri), "aurora", VesselProfile(length_m=length_m))


def test_two_processes_with_the_same_logs_leave_one_of_each(warehouse: Warehouse, crew: Crew) -> None:
    names = [f"log {i}".encode() for i in range(4)]
    outcomes = crew.at_once(ingest_some, [(warehouse.uri, "aurora", names)] * 2)
    assert sorted(o for both in outcomes for o in both) == ["new"] * 4 + ["unchanged"] * 4
    assert [row.revision for row in logs.all_ingests(warehouse)] == [1] * 4
    assert delta.read(warehouse, "readings").height == 4 * 5
    assert delta.read(warehouse, "rejected").height == 4 * 2
    for row in logs.current(warehouse):
        assert readings.read(warehouse, row.ingest_id)["record"].to_list() == [0, 1, 2, 3, 4]


def test_two_vessels_cannot_both_claim_a_log(warehouse: Warehouse, crew: Crew) -> None:
    outcomes = crew.at_once(claim, [(warehouse.uri, "aurora"), (warehouse.uri, "boreas")])
    assert sorted(outcomes) == ["log_of_another_vessel", "new"]
    assert len(logs.all_ingests(warehouse)) == 1


def test_four_processes_lose_no_parameter_set(warehouse: Warehouse, crew: Crew) -> None:
    crew.at_once(insert_some, [(warehouse.uri, worker, 4) for worker in range(4)])
    listed = parameter_sets.summaries(warehouse)["parameter_set_id"].to_list()
    assert len(listed) == len(set(listed)) == 4 * 4 + 4


def test_profiles_registered_at_once_are_all_kept(warehouse: Warehouse, crew: Crew) -> None:
    crew.at_once(register_one, [(warehouse.uri, 10.0 + i) for i in range(3)])
    found = vessels.versions(warehouse, "aurora")
    assert [v.revision for v in found] == [1, 2, 3]
    assert {v.profile.length_m for v in found} == {10.0, 11.0, 12.0}


def ingest_for_ever(uri: str) -> None:
    i = 0
    while True:
        deposit(Warehouse(uri), [delivery("aurora", f"log {i}".encode())])
        i += 1


def test_a_killed_process_leaves_whole_logs(warehouse: Warehouse) -> None:
    for pause in (0.05, 0.17):
        process = SPAWN.Process(target=ingest_for_ever, args=(warehouse.uri,))
        process.start()
        deadline = time.monotonic() + 60
        seen = len(logs.current(warehouse)) if warehouse.exists() else 0
        while time.monotonic() < deadline and (not warehouse.exists() or len(logs.current(warehouse)) <= seen):
            time.sleep(0.02)
        time.sleep(pause)
        process.kill()
        process.join(30)
        assert process.exitcode == -signal.SIGKILL
        rows = logs.all_ingests(warehouse)
        assert len(rows) > seen
        for row in rows:
            assert readings.read(warehouse, row.ingest_id).height == 5
            assert readings.read_rejected(warehouse, row.ingest_id).height == 2
    deposit(warehouse, [delivery("aurora", f"log {i}".encode()) for i in range(len(rows) + 1)])
    ingests = delta.read(warehouse, "readings")["ingest_id"]
    assert len(ingests) == 5 * ingests.n_unique()


def test_retrying_ends_with_a_clear_error() -> None:
    from deltalake.exceptions import CommitFailedError

    waits: list[float] = []

    def lose() -> None:
        raise CommitFailedError("another was first")

    with pytest.raises(KempfError) as caught:
        retry.with_retry(lose, sleep=waits.append)
    assert caught.value.code == "warehouse_busy"
    assert len(waits) == retry.ATTEMPTS
    assert max(waits) <= retry.LONGEST_WAIT_S
    lost = iter([True, True, False])

    def win_the_third() -> str:
        if next(lost):
            raise CommitFailedError("another was first")
        return "won"

    assert retry.with_retry(win_the_third, sleep=waits.append) == "won"
