from __future__ import annotations

from pathlib import Path

import pytest

from kempf.warehouse.storage.store import Warehouse


@pytest.fixture
def warehouse(tmp_path: Path) -> Warehouse:
    return Warehouse(str(tmp_path / "kempf data ø"))  # a blank and a letter beyond ASCII on purpose
