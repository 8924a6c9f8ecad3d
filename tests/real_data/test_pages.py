"""A measured ship on the pages, in a real browser: effect by effect is added and the error falls."""

from __future__ import annotations

from pathlib import Path
from shutil import copytree
from typing import Any

from tests.real_data.voyage import Voyage
from tests.workbench.web.browsing import NEEDS_BROWSER, accessible, opened, served

pytestmark = NEEDS_BROWSER


def test_what_the_pond_s_ship_lacks_is_added_and_the_error_falls(browser: Any, pond: Voyage, tmp_path: Path) -> None:
    place = copytree(pond.warehouse.uri, tmp_path / "w")
    for server in served(place, tmp_path / "state"):
        tab = opened(browser, server)
        vessel_page = f"{server.base}/v/{pond.ship.name}"
        tab.goto(server.start)
        tab.goto(vessel_page)
        tab.click("button:has-text('Diagnose')")
        tab.wait_for_url("**/diagnoses/dx-**")
        found = tab.url
        accessible(tab)
        for effect in ("propeller_wash", "wind_force", "cross_flow_drag"):
            tab.goto(found)
            tab.click(f"button:has-text('Add {effect.replace('_', ' ')}')")
            tab.wait_for_url("**/ladder")
            tab.wait_for_selector(f"th[scope=row]:has-text('{effect.replace('_', ' ')}')")
        accessible(tab)
        assert "which predictions of manoeuvres take" in tab.inner_text("main")
        # the columns a leg ahead and of free runs, fitted and held out; left out in turn between them
        rows = [[float(cell) for cell in row] for row in _figures(tab)]
        assert len(rows) == 4
        for before, after in zip(rows[0], rows[-1], strict=True):
            assert after < 0.65 * before, rows
        # before and after, over a manoeuvre that was held out, by the parameters that predictions take
        tab.click("text=Model before and after")
        tab.wait_for_url("**beside=**")
        assert tab.query_selector("strong:has-text('free run, fitted to legs')") is not None
        assert tab.query_selector("button:has-text('Flip')") is not None
        accessible(tab)
        # the stretch that is missed most can be explained although her logs share their instants
        tab.click("text=explain it >> nth=0")
        tab.wait_for_url("**segment=seg-**")
        tab.click("button:has-text('Explain it')")
        tab.wait_for_selector(".verdict")
        tab.goto(f"{vessel_page}/ladder")
        tab.click("button:has-text('Undo')")
        tab.wait_for_selector("main:has(th:has-text('wind force')):not(:has(th:has-text('cross flow drag')))")
        assert [rung["added"] for rung in server.json(f"/v/{pond.ship.name}/ladder.json")] == [
            *(None, "propeller_wash", "wind_force")
        ]
        assert server.complaints == []


def _figures(tab: Any) -> list[list[str]]:
    """Return errors a leg ahead and of free runs of every rung, as they stand in the table."""
    rows = tab.query_selector_all("main tbody tr")
    return [[cell.inner_text() for cell in row.query_selector_all("td.n")[1:]] for row in rows]
