from __future__ import annotations

import pytest

from kempf.schemas.errors import NotFound, UsageError
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import vessel_key
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, readings, vessels
from kempf.warehouse.tables.deposit import deposit
from tests.warehouse.samples import delivery

ODD_NAMES = [
    "../../etc",
    "a/b=c",
    "Ærø 7",
    "CON",
    "%2F",
    "O'Brien",
    "x' OR '1'='1",
    "a",
    "A",
    "\u202e",
    "日本丸",
    "x\ny",
]


def test_the_latest_profile_is_current_and_all_are_kept(warehouse: Warehouse) -> None:
    first, second = VesselProfile(length_m=10.0), VesselProfile(length_m=11.0)
    assert vessels.register(warehouse, "aurora", first)
    version = delta.versions(warehouse)
    assert not vessels.register(warehouse, "aurora", first)
    assert delta.versions(warehouse) == version
    assert vessels.register(warehouse, "aurora", second)
    assert vessels.current(warehouse, "aurora") == second
    assert vessels.register(warehouse, "aurora", first)  # back to the first
    assert vessels.current(warehouse, "aurora") == first
    assert [v.revision for v in vessels.versions(warehouse, "aurora")] == [1, 2, 3]
    assert vessels.get(warehouse, second.sha256) == second
    assert vessels.names(warehouse) == ["aurora"]


def test_a_batch_is_one_commit(warehouse: Warehouse) -> None:
    profiles = [("b", VesselProfile(length_m=1.0)), ("a", VesselProfile()), ("b", VesselProfile(length_m=2.0))]
    assert vessels.register_all(warehouse, profiles) == tuple(profiles)
    assert delta.versions(warehouse) == {"vessels": 1}
    assert vessels.current(warehouse, "b").length_m == 2.0
    assert vessels.register_all(warehouse, []) == ()


def test_unknown_ones_are_not_found(warehouse: Warehouse) -> None:
    vessels.register(warehouse, "aurora", VesselProfile())
    with pytest.raises(NotFound) as caught:
        vessels.current(warehouse, "Aurora")
    assert caught.value.code == "no_vessel"
    assert caught.value.details["known"] == ["aurora"]
    with pytest.raises(NotFound) as caught:
        vessels.get(warehouse, "f" * 64)
    assert caught.value.code == "no_profile"


@pytest.mark.parametrize("name", ["", " ", "\t\n", "a\udcff"])
def test_a_name_that_is_none_is_refused_before_anything_is_written(warehouse: Warehouse, name: str) -> None:
    with pytest.raises(UsageError) as caught:
        deposit(warehouse, [delivery(name)])
    assert caught.value.code == "vessel_name"
    assert not warehouse.exists()


def test_no_name_becomes_a_path(warehouse: Warehouse) -> None:
    done = deposit(warehouse, [delivery(name, name.encode()) for name in ODD_NAMES])
    assert vessels.names(warehouse) == sorted(ODD_NAMES)
    assert len({vessel_key(name) for name in ODD_NAMES}) == len(ODD_NAMES)
    for name, one in zip(ODD_NAMES, done, strict=True):
        assert [row.vessel for row in logs.current(warehouse, name)] == [name]
        assert readings.read(warehouse, one.ingest_id).height == 5
    assert warehouse.folder is not None
    folders = {p.name for p in (warehouse.folder / "readings").iterdir()}
    assert folders == {"_delta_log", "_seals"} | {f"vessel_key={vessel_key(name)}" for name in ODD_NAMES}
    assert {p.name for p in warehouse.folder.parent.iterdir()} == {warehouse.folder.name}
