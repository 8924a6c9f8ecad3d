"""The pictures of docs/workbench.md: the pages of a simulated ship whose rudder answers late, in a real browser.

``python -m benchmarks.documents.draw_workbench``; needs a Chromium on the search path, or named by ``KEMPF_CHROMIUM``.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import Page

from benchmarks.diagnose import late_rudder
from benchmarks.documents import new_rudder
from benchmarks.pages.browser import KEMPF, Opened, opened
from kempf.schemas.instants import iso_utc

FIGURES = Path(__file__).parents[2] / "docs" / "figures"


def shot(tab: Page, name: str, height: int) -> None:
    """Take a picture of the top of a page."""
    path = FIGURES / f"workbench_{name}.png"
    tab.screenshot(path=path, clip={"x": 0, "y": 0, "width": 1000, "height": height}, full_page=True)
    print(path)


def story(page: Opened, log_file: Path, profile: Path) -> None:
    """Go through the pages as an engineer would."""
    tab, base, vessel = page.tab, page.base, late_rudder.VESSEL
    vessel_page = f"{base}/v/{vessel}"
    tab.goto(f"{base}/ingest")
    tab.set_input_files("[name=log]", log_file)
    tab.set_input_files("[name=profile]", profile)
    tab.check("[name=new_vessel]")
    shot(tab, "ingest", 350)
    log = page.json(f"/v/{vessel}/logs.json")[0]["log_id"]
    tab.goto(f"{base}/logs/{log}")
    tab.wait_for_selector("body[data-ready=yes]")
    shot(tab, "log", 840)
    tab.goto(vessel_page)
    tab.click("button:has-text('Identify')")
    tab.wait_for_url(f"**/v/{vessel}")
    tab.click("text=Model beside measurement")
    tab.click("a:has-text('go with rudder rate') >> nth=0")
    tab.wait_for_selector("#drawn .shade")
    shot(tab, "model", 1560)
    tab.keyboard.press("n")
    tab.wait_for_selector("body[data-ready=yes]")
    shot(tab, "manoeuvre", 1240)
    tab.click("button:has-text('Explain this stretch')")
    tab.click("main button:has-text('Explain it')")
    tab.wait_for_url("**/explain?**")
    shot(tab, "explain", 620)
    tab.goto(vessel_page)
    tab.click("button:has-text('Diagnose') >> nth=0")
    tab.wait_for_selector("#climb:not([hidden])")
    tab.wait_for_timeout(4000)
    shot(tab, "job", 700)
    tab.wait_for_url("**/diagnoses/**")
    shot(tab, "diagnosis", 900)
    tab.click("button:has-text('Add rudder lag')")
    tab.wait_for_url("**/ladder")
    shot(tab, "ladder", 480)
    tab.click("text=Compare the two sets")
    tab.wait_for_url("**/compare?**")
    shot(tab, "compare", 900)
    tab.goto(f"{vessel_page}/ladder")
    tab.click("text=Model before and after")
    tab.wait_for_url("**beside=**")
    tab.locator("#drawn").scroll_into_view_if_needed()
    tab.locator("#drawn").screenshot(path=FIGURES / "workbench_flip.png")
    asked(page, f"{vessel_page}/what-if?parameter=rudder_lag.tau", "what_if", 860)
    asked(page, f"{vessel_page}/predict?manoeuvre=zigzag&angles=20/20", "predict", 900)
    asked(page, f"{vessel_page}/next-trial?parameter=b2", "next_trial", 760)
    tab.goto(f"{base}/sets/{page.json(f'/v/{vessel}/ladder.json')[-1]['parameter_set_id']}")
    shot(tab, "set", 980)
    tab.goto(vessel_page)
    shot(tab, "vessel", 900)
    tab.goto(base)
    shot(tab, "fleet", 420)
    tab.goto(f"{base}/effects/rudder_lag")
    shot(tab, "effect", 560)


def asked(page: Opened, address: str, name: str, height: int) -> None:
    """Open a page whose answer has to be made, let it be made, and take its picture."""
    tab = page.tab
    tab.goto(address)
    made = tab.locator("main form[action='/jobs'] button")
    if made.count():
        made.first.click()
        tab.wait_for_url("**/jobs/**")
        tab.wait_for_url(re.compile(f"/{address.partition('?')[0].rpartition('/')[2]}([?]|$)"))
    shot(tab, name, height)


def main() -> None:
    """Draw them."""
    with TemporaryDirectory() as place:
        folder = Path(place)
        late_rudder.write(folder)
        log_file, profile = folder / "day.mcap", folder / "late.yaml"
        subprocess.run([*KEMPF, "ingest", log_file, "--profile", profile, "--warehouse", folder / "w"], check=True)
        with opened(folder / "w", folder / "state", width=1000) as page:
            story(page, log_file, profile)
        docked_ns = new_rudder.write(folder / "refitted")
        at = ("--warehouse", folder / "r")
        vessel = ("--vessel", new_rudder.VESSEL)
        files = (*sorted((folder / "refitted").glob("*.mcap")), "--profile", folder / "refitted" / "refitted.yaml")
        subprocess.run([*KEMPF, "ingest", *files, *at], check=True)
        subprocess.run([*KEMPF, "identify", *vessel, *at], check=True)
        subprocess.run([*KEMPF, "note", "docked, larger rudder", *vessel, "--at", iso_utc(docked_ns), *at], check=True)
        with opened(folder / "r", folder / "state-r", width=1000) as page:
            asked(page, f"{page.base}/v/{new_rudder.VESSEL}/changes", "changes", 1240)


if __name__ == "__main__":
    main()
