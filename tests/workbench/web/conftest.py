from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from kempf.warehouse.store import Warehouse
from kempf.workbench.web.app import create_app
from kempf.workbench.web.settings import Settings
from tests.workbench.conftest import _filled, filled, logs, own  # noqa: F401

TOKEN = "of-this-test"  # noqa: S105


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
