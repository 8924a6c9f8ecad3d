"""The pictures of docs/workbench.md: the pages of a simulated ship whose rudder answers late, in a real browser.

``python -m benchmarks.documents.draw_workbench``; needs a Chromium on the search path, or named by ``KEMPF_CHROMIUM``.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import Page, sync_playwright

from benchmarks.diagnose import late_rudder

FIGURES = Path(__file__).parents[2] / "docs" / "figures"
KEMPF = (sys.executable, "-c", "from kempf.workbench.cli import main; main()")
WAIT_MS = 180_000


def shot(tab: Page, name: str, height: int) -> None:
    """Take a picture of the top of a page."""
    path = FIGURES / f"workbench_{name}.png"
    tab.screenshot(path=path, clip={"x": 0, "y": 0, "width": 1000, "height": height}, full_page=True)
    print(path)


def story(tab: Page, start: str) -> None:
    """Go through the pages as an engineer would."""
    vessel = late_rudder.VESSEL
    tab.goto(start)
    base = tab.url.rstrip("/")
    tab.click(f"th a:has-text('{vessel}')")
    log = tab.get_attribute("th a[href^='/logs/']", "href")
    tab.goto(f"{base}{log}")
    tab.wait_for_selector("body[data-ready=yes]")
    shot(tab, "log", 840)
    tab.goto(f"{base}/v/{vessel}")
    tab.click("button:has-text('Identify')")
    tab.wait_for_url(f"**/v/{vessel}")
    tab.click("text=Model beside measurement")
    tab.click("button:has-text('Predict')")
    tab.wait_for_url("**/model?**")
    shot(tab, "model", 1240)
    tab.click("button:has-text('Diagnose')")
    tab.wait_for_url("**/diagnoses/**")
    shot(tab, "diagnosis", 900)
    tab.click("button:has-text('Add rudder lag')")
    tab.wait_for_url("**/ladder")
    shot(tab, "ladder", 480)


def main() -> None:
    """Draw them."""
    browser = os.environ.get("KEMPF_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    with TemporaryDirectory() as place, sync_playwright() as playwright:
        folder = Path(place)
        late_rudder.write(folder)
        files = (folder / "day.mcap", "--profile", folder / "late.yaml")
        subprocess.run([*KEMPF, "ingest", *files, "--warehouse", folder / "w"], check=True)
        command = [*KEMPF, "workbench", "--warehouse", folder / "w", "--state", folder / "state", "--port", "0"]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
            assert server.stderr is not None
            found = re.search(r"http://\S+", server.stderr.readline())
            assert found is not None
            one = playwright.chromium.launch(executable_path=browser, args=["--no-sandbox"])
            tab = one.new_context(viewport={"width": 1000, "height": 800}, color_scheme="light").new_page()
            tab.set_default_timeout(WAIT_MS)
            story(tab, found.group())
            one.close()
            server.send_signal(signal.SIGINT)


if __name__ == "__main__":
    main()
