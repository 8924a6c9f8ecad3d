from __future__ import annotations

import hashlib

import pytest

from schemas.errors import KempfError, NotFound
from warehouse import raw
from warehouse.store import Warehouse


def place(warehouse: Warehouse, name: str):
    assert warehouse.folder is not None
    return warehouse.folder / "raw" / name[:2] / name


@pytest.mark.parametrize("data", [b"", b"\x00\xff" * 1000, "Ærø".encode()])
def test_bytes_come_back_as_they_were(warehouse: Warehouse, data: bytes) -> None:
    name = raw.put(warehouse, data)
    assert name == hashlib.sha256(data).hexdigest()
    assert raw.get(warehouse, name) == data


def test_putting_twice_writes_once(warehouse: Warehouse) -> None:
    name = raw.put(warehouse, b"log")
    stamp = place(warehouse, name).stat().st_mtime_ns
    assert raw.put(warehouse, b"log") == name
    assert place(warehouse, name).stat().st_mtime_ns == stamp


def test_damage_is_found_and_mended(warehouse: Warehouse) -> None:
    name = raw.put(warehouse, b"log")
    place(warehouse, name).write_bytes(b"lo")
    with pytest.raises(KempfError) as caught:
        raw.get(warehouse, name)
    assert caught.value.code == "raw_bytes_damaged"
    assert caught.value.details["log_id"] == name
    raw.put(warehouse, b"log")
    assert raw.get(warehouse, name) == b"log"


@pytest.mark.parametrize("name", ["0" * 64, "../../etc/passwd", "", "..", "A" * 64, "a/b", "x\x00"])
def test_what_is_not_there_is_not_found(warehouse: Warehouse, name: str) -> None:
    raw.put(warehouse, b"log")
    with pytest.raises(NotFound) as caught:
        raw.get(warehouse, name)
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
        raw.put(full, b"log")
    assert caught.value.code == "disk_full"
    assert warehouse.folder is not None
    assert [p for p in (warehouse.folder / "raw").rglob("*") if p.is_file()] == []
