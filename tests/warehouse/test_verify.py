"""A table that is lost whole is told from one that was never written, and nobody goes on without it."""

from __future__ import annotations

import time
from pathlib import Path
from shutil import copytree, rmtree

import pytest

from kempf.schemas.errors import KempfError
from kempf.schemas.tables import TABLES
from kempf.warehouse.storage import delta, written
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, parameter_sets
from kempf.warehouse.tables.deposit import deposit
from kempf.warehouse.upkeep import compaction
from kempf.warehouse.upkeep.verify import verify
from tests.warehouse.samples import START_NS, delivery, inputs, parameter_set


@pytest.fixture
def filled(warehouse: Warehouse) -> Warehouse:
    deposit(warehouse, [delivery()])
    return warehouse


def lose(warehouse: Warehouse, table: str) -> None:
    assert warehouse.folder is not None
    rmtree(warehouse.folder / table)


def gone(warehouse: Warehouse) -> list[str]:
    return [one.table for one in verify(warehouse) if one.kind == "table"]


@pytest.mark.parametrize("part", ["rejected", "rejected/_delta_log"])
def test_a_lost_table_is_named_and_neither_read_nor_written(filled: Warehouse, part: str, tmp_path: Path) -> None:
    assert filled.folder is not None
    copy = Warehouse(str(copytree(filled.folder, tmp_path / "copy")))
    for warehouse in (filled, copy):
        lose(warehouse, part)
        if part != "rejected":
            lose(warehouse, "rejected/_seals")
        assert gone(warehouse) == ["rejected"]
        with pytest.raises(KempfError) as caught:
            delta.read(warehouse, "rejected")
        assert caught.value.code == "table_damaged" and "kempf repair" in caught.value.next_step
        with pytest.raises(KempfError):
            deposit(warehouse, [delivery(data=b"log two")])
        assert len(logs.current(warehouse)) == 1 and gone(warehouse) == ["rejected"]
        delta.make_anew(warehouse, "rejected")
        assert gone(warehouse) == [] and delta.read(warehouse, "rejected").is_empty()
    assert delta.read(filled, "segments").is_empty()  # never written


def test_a_table_from_before_it_was_kept_is_noted_by_the_next_writer(filled: Warehouse) -> None:
    lose(filled, written.FOLDER)
    assert not written.is_noted(filled, "logs")
    deposit(filled, [delivery(data=b"log two")])
    compaction.compact(Warehouse(filled.uri))
    there = [name for name in TABLES if delta.open_table(filled, name) is not None]
    assert [name for name in TABLES if written.is_noted(filled, name)] == there != []


def test_a_table_that_another_writer_makes_meanwhile_is_no_lost_one(
    filled: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = written.is_noted

    def made_meanwhile(warehouse: Warehouse, name: str) -> bool:
        monkeypatch.setattr(written, "is_noted", real)
        delta.ensure_table(warehouse, name)
        written.note(warehouse, name)
        return real(warehouse, name)

    monkeypatch.setattr(written, "is_noted", made_meanwhile)
    table = delta.open_table(filled, "segments")
    assert table is not None and table.version() == 0


def test_versions_of_a_lost_table_stop_no_vacuum(filled: Warehouse) -> None:
    def store(start_utc_ns: int) -> None:
        asked = inputs(start_utc_ns=start_utc_ns)
        stored = parameter_set("aurora", asked, provenance={"table_versions": {"logs": 7}})
        parameter_sets.insert(filled, [stored])

    store(START_NS)
    with pytest.raises(KempfError, match="versions 7"):
        compaction.vacuum(filled, 0.0)
    assert written.made_anew_at_ms(filled, "logs") is None
    lose(filled, "logs")
    time.sleep(0.01)
    delta.make_anew(filled, "logs")
    assert written.made_anew_at_ms(filled, "logs") is not None
    assert compaction.pinned(filled) == {} and compaction.vacuum(filled, 0.0)
    time.sleep(0.01)
    store(START_NS + 1)  # of the table as it is now: an older copy of it is noticed
    with pytest.raises(KempfError, match="versions 7"):
        compaction.vacuum(filled, 0.0)
