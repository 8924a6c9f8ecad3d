"""docs/notebook.md is true: its session prints what is shown, and every call is named."""

from __future__ import annotations

import re
from pathlib import Path

from kempf.workbench.notebook.vessel_view import VesselView
from kempf.workbench.notebook.warehouse_view import WarehouseView
from tests.docs.console import follow, sailed

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "notebook.md").read_text(encoding="utf-8")


def test_the_session_prints_what_is_shown(late_ingested: Path, tmp_path: Path) -> None:
    assert follow(TEXT, tmp_path, f"export PYTHONPATH='{ROOT}'", sailed(late_ingested)) > 20


def test_every_call_is_named() -> None:
    listed = TEXT.partition("## All of it")[2]
    for home, kind in (("data", WarehouseView), ("ship", VesselView)):
        calls = {name for name, value in vars(kind).items() if callable(value) and not name.startswith("_")}
        assert set(re.findall(rf"`{home}\.(\w+)\(", listed)) == calls
