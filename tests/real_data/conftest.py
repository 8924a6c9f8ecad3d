"""Every source is taken in once a session; identification, which costs, is left to the tests that look at it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from benchmarks import measured_ships
from kempf.warehouse.storage.store import Warehouse
from tests.real_data.voyage import SHARED, Voyage, require, sail
from tests.workbench.web.browsing import launched


@pytest.fixture
def browser() -> Iterator[Any]:
    yield from launched()


@pytest.fixture(scope="session")
def tank(tmp_path_factory: pytest.TempPathFactory) -> Voyage:
    require("data", "kvlcc2_hsva")
    return sail(measured_ships.tank(SHARED), Warehouse(str(tmp_path_factory.mktemp("tank"))))


@pytest.fixture(scope="session")
def boat(tmp_path_factory: pytest.TempPathFactory) -> Voyage:
    require("data", "usv_open_water")
    return sail(measured_ships.boat(SHARED), Warehouse(str(tmp_path_factory.mktemp("boat"))))


@pytest.fixture(scope="session")
def pond(tmp_path_factory: pytest.TempPathFactory) -> Voyage:
    require("data", "esso_osaka")
    return sail(measured_ships.pond(SHARED), Warehouse(str(tmp_path_factory.mktemp("pond"))))


@pytest.fixture(scope="session")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> list[Voyage]:
    require("trials")
    warehouse = Warehouse(str(tmp_path_factory.mktemp("fleet")))
    return [sail(ship, warehouse) for ship in measured_ships.fleet(SHARED)]
