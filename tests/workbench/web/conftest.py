from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest
from starlette.testclient import TestClient

from kempf.warehouse.storage.store import Warehouse
from kempf.workbench.web.app import create_app
from kempf.workbench.web.jobs.engine_supervisor import EngineSupervisor
from kempf.workbench.web.jobs.queue import Queue
from kempf.workbench.web.settings import Settings
from tests.workbench.conftest import _filled, filled, logs, own  # noqa: F401
from tests.workbench.web.browsing import Server, launched, served

TOKEN = "of-this-test"  # noqa: S105
OURS = {"origin": "http://127.0.0.1"}


def until(true: Callable[[], Any], seconds: float = 90.0) -> Any:
    """Wait for a condition."""
    end = time.monotonic() + seconds
    while not (found := true()):
        assert time.monotonic() < end, "it never came true"
        time.sleep(0.05)
    return found


def client_of(place: Path, state: Path) -> TestClient:
    """A browser without script at a warehouse's pages."""
    return TestClient(
        create_app(Warehouse(str(place)), Settings(token=TOKEN), state),
        base_url="http://127.0.0.1",
        follow_redirects=False,
        raise_server_exceptions=False,
    )


@pytest.fixture
def client(filled: Path, tmp_path: Path) -> Iterator[TestClient]:  # noqa: F811
    with client_of(filled, tmp_path / "state") as one:
        yield one


@pytest.fixture
def writing(client: TestClient) -> TestClient:
    client.get(f"/?token={TOKEN}")
    return client


@contextmanager
def at_work(place: Path, state: Path) -> Iterator[tuple[TestClient, EngineSupervisor, Queue]]:
    """A browser that may write at a warehouse's pages, and an engine at work."""
    supervisor = EngineSupervisor(state, Warehouse(str(place)))
    supervisor.start()
    try:
        with client_of(place, state) as client:
            client.get(f"/?token={TOKEN}")
            yield client, supervisor, Queue(state / "jobs.sqlite")
    finally:
        supervisor.stop()


@pytest.fixture
def working(own: Path, tmp_path: Path) -> Iterator[tuple[TestClient, EngineSupervisor, Queue]]:  # noqa: F811
    """A browser that may write, and an engine at work."""
    with at_work(own, tmp_path / "state") as one:
        yield one


@pytest.fixture
def browser() -> Iterator[Any]:
    yield from launched()


@pytest.fixture
def server(late_ingested: Path, tmp_path: Path) -> Iterator[Server]:
    """The pages of a ship whose rudder answers late, one log, nothing identified yet."""
    yield from served(copytree(late_ingested / "w", tmp_path / "w"), tmp_path / "state")
