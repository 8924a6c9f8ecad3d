from __future__ import annotations

import hashlib
from io import BytesIO

import pytest

from kempf.pipeline.ingest.log_file import LogFile
from kempf.schemas.errors import DataRejected, KempfError, NotFound
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import raw
from tests.warehouse.samples import raw_bytes


def place(warehouse: Warehouse, name: str):
    assert warehouse.folder is not None
    return warehouse.folder / "raw" / name[:2] / name


@pytest.mark.parametrize("data", [b"", b"\x00\xff" * 1000, "Ærø".encode()])
def test_bytes_come_back_as_they_were(warehouse: Warehouse, data: bytes) -> None:
    name = raw.put(warehouse, LogFile(data))
    assert name == hashlib.sha256(data).hexdigest()
    assert raw_bytes(warehouse, name) == data


def test_putting_twice_writes_once(warehouse: Warehouse) -> None:
    name = raw.put(warehouse, LogFile(b"log"))
    stamp = place(warehouse, name).stat().st_mtime_ns
    assert raw.put(warehouse, LogFile(b"log")) == name
    assert place(warehouse, name).stat().st_mtime_ns == stamp


def test_damage_is_found_and_mended(warehouse: Warehouse) -> None:
    name = raw.put(warehouse, LogFile(b"log"))
    place(warehouse, name).write_bytes(b"lo")
    with pytest.raises(KempfError) as caught:
        raw_bytes(warehouse, name)
    assert caught.value.code == "raw_bytes_damaged"
    assert caught.value.details["log_id"] == name
    raw.put(warehouse, LogFile(b"log"))
    assert raw_bytes(warehouse, name) == b"log"


@pytest.mark.parametrize("name", ["0" * 64, "../../etc/passwd", "", "..", "A" * 64, "a/b", "x\x00"])
def test_what_is_not_there_is_not_found(warehouse: Warehouse, name: str) -> None:
    raw.put(warehouse, LogFile(b"log"))
    with pytest.raises(NotFound) as caught:
        raw_bytes(warehouse, name)
    assert caught.value.code == "no_raw_log"


def test_a_failed_write_leaves_nothing(warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch) -> None:
    from pyarrow import fs

    warehouse.create()

    def fail(self, source, target):
        raise OSError("no space left on device")

    class Full(fs.LocalFileSystem):
        move = fail

    monkeypatch.setattr(fs, "LocalFileSystem", Full)
    full = Warehouse(warehouse.uri)
    with pytest.raises(KempfError) as caught:
        raw.put(full, LogFile(b"log"))
    assert caught.value.code == "disk_full"
    assert warehouse.folder is not None
    assert [p for p in (warehouse.folder / "raw").rglob("*") if p.is_file()] == []


class Growing(BytesIO):
    """A log that a logger writes over while it is read."""

    def read(self, size: int | None = -1) -> bytes:
        found = super().read(size)
        self.seek(0)
        self.write(b"L")
        return found


@pytest.mark.parametrize("kept", [False, True])
def test_a_log_that_changes_while_it_is_read_is_not_kept(warehouse: Warehouse, kept: bool) -> None:
    if kept:
        raw.put(warehouse, LogFile(b"log"))
    with pytest.raises(DataRejected) as caught:
        raw.put(warehouse, LogFile(Growing(b"log")))
    assert caught.value.code == "log_changed"
    assert warehouse.folder is not None
    held = [p.read_bytes() for p in (warehouse.folder / "raw").rglob("*") if p.is_file()]
    assert held == ([b"log"] if kept else [])


def test_a_long_log_is_read_where_it_lies(warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(raw, "_SHORT", 2)
    name = raw.put(warehouse, LogFile(b"log"))
    with raw.opened(warehouse, name) as log:
        assert (log.read(1, 5), log.read(0, 2), log.size) == (b"og", b"lo", 3)


class Rotten(BytesIO):
    def read(self, size: int | None = -1) -> bytes:
        raise OSError(5, "Input/output error")


def test_a_disk_that_fails_is_reported_with_the_place(warehouse: Warehouse) -> None:
    with pytest.raises(KempfError, match="byte 0 of 3: Input/output error") as caught:
        raw.put(warehouse, LogFile(Rotten(b"log")))
    assert caught.value.code == "log_unreadable"
