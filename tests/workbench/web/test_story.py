"""An engineer's way through the pages in a real browser; skipped where there is none."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest

from kempf.flows.jobs.identify.standing_model import Own
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.workbench.report.build import make_report
from tests.late import VESSEL, some_effects
from tests.workbench.web.browsing import NEEDS_BROWSER, Server, accessible, opened, reach, served

pytestmark = NEEDS_BROWSER


@pytest.fixture
def empty(tmp_path: Path) -> Iterator[Server]:
    """The pages of a warehouse that is new."""
    yield from served(tmp_path / "new", tmp_path / "state", "--new")


def test_from_the_log_to_the_missing_effect_and_back_by_keyboard_alone(
    browser: Any, empty: Server, late_ingested: Path
):
    server = empty
    tab = opened(browser, server)
    tab.goto(server.start)
    assert "token" not in tab.url
    reach(tab, "main a:has-text('take logs in')")
    tab.set_input_files("[name=log]", late_ingested / "day.mcap")
    tab.set_input_files("[name=profile]", late_ingested / "late.yaml")
    reach(tab, "[name=new_vessel]", "Space")
    reach(tab, "button:has-text('Take them in')")
    reach(tab, f"main a:has-text('Go to {VESSEL}')")
    reach(tab, "button:has-text('Identify')")
    tab.wait_for_url(f"**/v/{VESSEL}")
    reach(tab, "text=Model beside measurement")
    tab.wait_for_url("**/model")
    # what the errors go with is shaded where it shows, in the run drawn and in the strips
    assert tab.query_selector(".shade") is None
    reach(tab, "a:has-text('go with rudder rate') >> nth=0")
    tab.wait_for_selector("#drawn .shade")
    assert "mark=" in tab.url and tab.query_selector("td .shade") is not None
    accessible(tab)
    # the worst stretch is one key away, and its window is in the address
    tab.keyboard.press("n")
    tab.wait_for_selector("body[data-ready=yes]")
    assert re.search(r"/segments/seg-\w+\?from=20.*&to=20.*&worst=1", tab.url)
    assert "1 of the" in tab.inner_text("main")
    assert tab.query_selector(".panel[aria-label^='yaw rate, deg/s (starboard +) (measured, predicted)']") is not None
    accessible(tab)
    tab.keyboard.press("n")
    tab.wait_for_url("**&worst=2")
    tab.keyboard.press("p")
    tab.wait_for_url("**&worst=1")
    reach(tab, "text=All of them")
    reach(tab, "button:has-text('Diagnose')")
    tab.wait_for_url("**/jobs/job-**")
    tab.reload()  # in the middle of it
    tab.wait_for_url("**/diagnoses/dx-**")
    assert "+ rudder lag" in tab.inner_text("main")
    found = tab.url
    reach(tab, "button:has-text('Add rudder lag')")
    tab.wait_for_url("**/ladder")
    rungs = server.json(f"/v/{VESSEL}/ladder.json")
    assert [rung["added"] for rung in rungs] == [None, "rudder_lag"]
    assert rungs[1]["in_sample_error"] < 0.5 * rungs[0]["in_sample_error"]
    assert len(tab.query_selector_all("tbody tr")) == 2
    accessible(tab)
    # before and after over one manoeuvre, flipped
    reach(tab, "text=Model before and after")
    tab.wait_for_url("**beside=**")
    accessible(tab)
    for words in ("after", "before", "both"):
        tab.keyboard.press("f")
        assert words in tab.inner_text("#flipped")
    # what the errors went with is gone
    assert tab.query_selector("a:has-text('errors of yaw rate go with rudder rate')") is None
    # her model lacks nothing any more: there is nothing to add
    reach(tab, "button:has-text('Diagnose')")
    tab.wait_for_url("**/diagnoses/dx-**")
    assert tab.url != found and tab.query_selector("button:has-text('Add')") is None
    accessible(tab)
    tab.goto(server.base + f"/v/{VESSEL}/ladder")
    reach(tab, "button:has-text('Undo')")
    tab.wait_for_url("**/ladder")
    tab.wait_for_selector("text=Only the plain model so far")
    assert [rung["added"] for rung in server.json(f"/v/{VESSEL}/ladder.json")] == [None]
    # added and undone once more: nothing is taken for done that was changed back since
    tab.goto(found)
    reach(tab, "button:has-text('Add rudder lag')")
    tab.wait_for_url("**/ladder")
    reach(tab, "button:has-text('Undo')")
    tab.wait_for_selector("text=Only the plain model so far")
    # the address of the diagnosis, opened by somebody who may only read: no button
    other = opened(browser, server)
    other.goto(found)
    assert "+ rudder lag" in other.inner_text("main") and other.query_selector("main button") is None
    assert server.complaints == []


def test_a_chart_is_zoomed_and_the_window_is_in_the_address(browser: Any, server: Server):
    tab = opened(browser, server)
    log = server.json(f"/v/{VESSEL}/logs.json")[0]["log_id"]
    asked: list[str] = []
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(server.base + f"/logs/{log}")
    tab.wait_for_selector("body[data-ready=yes]")
    assert len(asked) <= 12 and all(url.startswith(server.base) for url in asked)
    from benchmarks.pages.browser import FIRST_PAINT_AND_SERIES

    painted, series = tab.evaluate(FIRST_PAINT_AND_SERIES)
    assert painted <= series  # words first, whatever the log holds
    tab.wait_for_timeout(500)
    seen = len(asked)
    tab.wait_for_timeout(1500)
    assert len(asked) == seen  # at rest nothing is asked for
    panel = tab.locator(".u-over").first.bounding_box()
    tab.mouse.move(panel["x"] + 0.25 * panel["width"], panel["y"] + 40)
    tab.mouse.down()
    tab.mouse.move(panel["x"] + 0.5 * panel["width"], panel["y"] + 40, steps=4)
    tab.mouse.up()
    tab.wait_for_url("**from=**")
    tab.wait_for_selector("body[data-ready=yes]")
    zoomed = tab.inner_text(".state")
    address = tab.url
    tab.keyboard.press("0")
    tab.wait_for_selector("body[data-ready=yes]")
    tab.go_back()
    assert tab.url == address
    tab.wait_for_selector("body[data-ready=yes]")
    assert tab.inner_text(".state") == zoomed
    again = opened(browser, server)
    again.goto(address)
    again.wait_for_selector("body[data-ready=yes]")
    assert again.inner_text(".state") == zoomed
    assert server.complaints == []


def test_two_instants_of_a_chart_are_compared_and_are_in_the_address(browser: Any, server: Server):
    tab = opened(browser, server)
    log = server.json(f"/v/{VESSEL}/logs.json")[0]["log_id"]
    tab.goto(server.base + f"/logs/{log}?ch=heading,yaw_rate")
    tab.wait_for_selector("body[data-ready=yes]")
    tab.keyboard.press("ArrowRight")
    tab.keyboard.press("a")
    tab.wait_for_url("**at=20**")
    tab.wait_for_selector("body[data-ready=yes]")
    for _ in range(3):
        tab.keyboard.press("Shift+ArrowRight")
    tab.keyboard.press("b")
    tab.wait_for_url("**at2=20**")
    tab.wait_for_selector("body[data-ready=yes]")
    head = tab.locator(".readout th[scope=col]").all_inner_texts()
    row = dict(zip(head, tab.locator(".readout tbody tr").first.locator("th, td").all_inner_texts(), strict=True))
    first, second, apart = (
        float(next(v for k, v in row.items() if k.startswith(name))) for name in ("A,", "B,", "B - A")
    )
    assert row["channel"] == "heading" and 0.0 <= first < 360.0
    assert apart == pytest.approx(second - first, abs=2e-2)
    accessible(tab)
    shown, address = tab.inner_text(".readout"), tab.url
    again = opened(browser, server)
    again.goto(address)
    again.wait_for_selector("body[data-ready=yes]")
    again.keyboard.press("t")
    assert again.inner_text(".readout") == shown
    assert server.complaints == []


def test_keys_are_listed_and_can_be_switched_off(browser: Any, server: Server):
    tab = opened(browser, server)
    segment = server.json(f"/v/{VESSEL}/segments.json")[0]["segment_id"]
    tab.goto(server.base + f"/segments/{segment}")
    tab.wait_for_selector("body[data-ready=yes]")
    tab.keyboard.press("?")
    listed = tab.locator("#keys dt").all_inner_texts()
    assert {"/", "0", "+", "-", "u", "a", "b", "]"} <= set(listed) and len(listed) == len(set(listed))
    accessible(tab)
    tab.keyboard.press("Escape")
    tab.keyboard.press("]")
    tab.wait_for_url(lambda url: segment not in url)
    tab.wait_for_selector("body[data-ready=yes]")
    # for those whom single letters get in the way, such as one who dictates
    tab.click("#show-keys")
    tab.check("#keys input")
    tab.click("#keys button")
    address = tab.url
    for key in ("[", "?"):
        tab.keyboard.press(key)
    tab.reload()
    tab.wait_for_selector("body[data-ready=yes]")
    tab.keyboard.press("[")
    tab.wait_for_timeout(300)
    assert tab.url == address and not tab.is_visible("#keys")
    assert server.complaints == []


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 390)])
def test_a_report_zooms_without_a_network_and_is_printed_with_its_pictures(
    browser: Any, late_diagnosed: Path, tmp_path: Path, scheme: str, width: int
):
    file = tmp_path / "late.html"
    with some_effects():
        report = make_report(Warehouse(str(copytree(late_diagnosed / "w", tmp_path / "w"))), VESSEL, ModelSpec(), Own())
    file.write_text(report.html, encoding="utf-8")
    size = {"width": width, "height": 900}
    tab = browser.new_context(viewport=size, color_scheme=scheme, offline=True).new_page()
    asked: list[str] = []
    complaints: list[str] = []
    tab.on("request", lambda request: asked.append(request.url))
    tab.on("console", lambda message: complaints.append(message.text))
    tab.on("pageerror", lambda error: complaints.append(str(error)))
    tab.goto(file.as_uri())
    first = tab.locator(".zoomable").first
    first.scroll_into_view_if_needed()
    first.locator(".uplot").first.wait_for()
    labels = first.locator(".panel").evaluate_all("all => all.map(one => one.getAttribute('aria-label'))")
    assert ["(measured, before, predicted)" in label for label in labels] == [False, True, True, True]
    whole = first.locator(".state").inner_text()
    panel = first.locator(".u-over").first.bounding_box()
    tab.mouse.move(panel["x"] + 0.25 * panel["width"], panel["y"] + 40)
    tab.mouse.down()
    tab.mouse.move(panel["x"] + 0.5 * panel["width"], panel["y"] + 40, steps=4)
    tab.mouse.up()
    assert first.locator(".state").inner_text() != whole
    first.locator("button:has-text('Show all')").click()
    assert first.locator(".state").inner_text() == whole and tab.url == file.as_uri()
    accessible(tab)
    picture = first.locator("img")
    assert not picture.is_visible()
    tab.emulate_media(media="print")
    assert picture.is_visible() and not first.locator(".chart").is_visible()
    assert complaints == [] and [url for url in asked if not url.startswith(("file:", "data:"))] == []
