"""The file that marks a warehouse: what it says, to this version and to earlier ones."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest

from kempf.schemas.errors import KempfError
from kempf.warehouse.storage import marker
from kempf.warehouse.storage.marker import LAYOUT, MARKER, Marker
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs


def layout_for_layout_2(written: bytes) -> int | None:
    """What versions that know of layout 2 alone take a marker for, word by word as they have it; None is damaged."""

    def _check(layout: int) -> str:
        return hashlib.sha256(f"kempf layout {layout}".encode()).hexdigest()[:12]

    try:
        content = json.loads(written)
        layout = int(content["layout"])
        return layout if content.keys() == {"layout"} or content["check"] == _check(layout) else None
    except (ValueError, KeyError, TypeError, AttributeError):
        return None


@pytest.mark.parametrize("one", [Marker(LAYOUT), Marker(LAYOUT, migrating=2), Marker(2)])
def test_earlier_versions_find_its_layout_and_no_damage(one: Marker) -> None:
    assert layout_for_layout_2(one.written()) == one.layout
    assert marker.read(one.written()) == one


@pytest.mark.parametrize("one", [Marker(LAYOUT), Marker(LAYOUT, migrating=2)])
def test_no_flipped_bit_is_read_as_something_else(one: Marker) -> None:
    whole = one.written()
    for k in range(8 * len(whole)):
        data = bytearray(whole)
        data[k // 8] ^= 1 << k % 8
        assert marker.read(bytes(data)) in (None, one), data


def test_a_bit_does_not_bring_a_warehouse_forward() -> None:
    assert marker.read(b'{"layout": 2}') == Marker(2), "as the first versions wrote it"
    assert marker.read(b'{"layout": 3}') is None


@pytest.mark.parametrize(
    ("found", "code", "said", "next_step"),
    [
        (b'{"layout": 2}', "warehouse_layout_old", "has layout 2; this version works with layout 4", "kempf migrate"),
        (Marker(2).written(), "warehouse_layout_old", "has layout 2", "kempf migrate"),
        (Marker(3).written(), "warehouse_layout_old", "has layout 3", "kempf migrate"),
        (Marker(4, 3).written(), "warehouse_migrating", "from layout 3 to layout 4", "kempf migrate"),
        (Marker(3, 2).written(), "warehouse_migrating", "from layout 2 to layout 3", "kempf migrate"),
        (Marker(9).written(), "warehouse_layout", "has layout 9; this version reads layout 4", "Update kempf"),
        (Marker(9, 3).written(), "warehouse_layout", "has layout 9; this version reads layout 4", "Update kempf"),
    ],
)
def test_each_says_which_way_to_go(tmp_path: Path, found: bytes, code: str, said: str, next_step: str) -> None:
    (tmp_path / MARKER).write_bytes(found)
    for ask in (logs.current, Warehouse.create, Warehouse.require):
        with pytest.raises(KempfError) as caught:
            ask(Warehouse(str(tmp_path)))
        assert caught.value.code == code
        assert said in caught.value.message and next_step in caught.value.next_step
    assert (tmp_path / MARKER).read_bytes() == found
