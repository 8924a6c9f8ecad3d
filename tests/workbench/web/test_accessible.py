"""Every page and state by axe, light and dark, wide and on a phone; skipped where there is no browser."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest

from tests.late import VESSEL
from tests.workbench.web.browsing import NEEDS_BROWSER, Server, accessible, opened, served

pytestmark = [NEEDS_BROWSER, pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 390)])]


@pytest.fixture
def with_lag(late_added: Path, tmp_path: Path) -> Iterator[Server]:
    """The pages of a ship whose rudder answers late, diagnosed, the lag in her model."""
    yield from served(copytree(late_added / "w", tmp_path / "w"), tmp_path / "state")


def test_every_page_is_accessible_and_fits(browser: Any, server: Server, scheme: str, width: int):
    tab = opened(browser, server, color_scheme=scheme, viewport={"width": width, "height": 900})
    log = server.json(f"/v/{VESSEL}/logs.json")[0]["log_id"]
    segment = server.json(f"/v/{VESSEL}/segments.json")[0]["segment_id"]
    tab.goto(server.start)  # one that may write sees more
    for path in (
        "/",
        "/ingest",
        "/compare",
        "/jobs",
        f"/v/{VESSEL}",
        f"/v/{VESSEL}/changes",
        f"/logs/{log}",
        f"/segments/{segment}",
        "/effects",
        "/effects/rudder_lag",
        "/none",
    ):
        tab.goto(server.base + path)
        if "log" in path or "segment" in path:
            tab.wait_for_selector("body[data-ready=yes]")
        accessible(tab)
    tab.goto(server.base + f"/segments/{segment}")
    tab.select_option("[name=action]", "exclude")
    tab.fill("[name=reason]", "tugs alongside")
    tab.click("button:has-text('Preview')")
    tab.click("button:has-text('Store it')")
    tab.wait_for_selector("text=Stored.")  # and the page stays, with what can be done next
    accessible(tab)
    tab.click("text=The manoeuvre as it is now")
    tab.wait_for_selector(".warning:has-text('tugs alongside')")
    accessible(tab)
    # a log without a profile: its draft, to be corrected
    tab.goto(server.base + "/ingest")
    rows = "".join(f"2025-05-03T06:00:{second:02d}Z,{second},1\n" for second in range(60))
    table = {"name": "day.csv", "mimeType": "text/csv", "buffer": f"utc,heading,rudder\n{rows}".encode()}
    tab.set_input_files("[name=log]", table)
    tab.fill("[name=vessel]", "sister")
    tab.check("[name=new_vessel]")
    tab.click("button:has-text('Take them in')")
    tab.wait_for_selector("textarea")
    accessible(tab)
    assert [words for words in server.complaints if "404" not in words] == []


def test_every_page_about_a_model_is_accessible_and_fits(browser: Any, with_lag: Server, scheme: str, width: int):
    tab = opened(browser, with_lag, color_scheme=scheme, viewport={"width": width, "height": 900})
    vessel_page = f"/v/{VESSEL}"
    plain, added = (rung["parameter_set_id"] for rung in with_lag.json(f"{vessel_page}/ladder.json"))
    segment = with_lag.json(f"{vessel_page}/segments.json")[0]["segment_id"]
    tab.goto(with_lag.start)
    for path in (
        vessel_page,
        f"{vessel_page}/ladder",
        f"{vessel_page}/model",
        f"/sets/{added}",
        f"/compare?a={plain}&b={added}",
        f"/segments/{segment}?beside={plain}",
    ):
        tab.goto(with_lag.base + path)
        accessible(tab)
    tab.goto(with_lag.base + vessel_page)
    tab.click("main a[href^='/diagnoses/'] >> nth=0")
    tab.wait_for_url("**/diagnoses/dx-**")
    accessible(tab)
    for place, fields in (
        ("predict", "manoeuvre=zigzag&angles=20/20"),
        ("predict", "manoeuvre=turning-circle"),
        ("what-if", "parameter=rudder_lag.tau"),
        ("next-trial", "parameter=b2"),
    ):
        tab.goto(f"{with_lag.base}{vessel_page}/{place}?{fields}")
        accessible(tab)  # before anything is asked for
        tab.locator("main form.ask button").first.click()
        tab.wait_for_url("**/jobs/**")
        accessible(tab)
        tab.wait_for_url(re.compile(f"{vessel_page}/{place}[?]"))
        accessible(tab)
    assert with_lag.complaints == []
