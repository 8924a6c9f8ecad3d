"""`kempf workbench` in a process of its own, and a Chromium at its pages."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from playwright.sync_api import Page, sync_playwright

KEMPF = (sys.executable, "-c", "from kempf.workbench.cli import main; main()")
#: a diagnosis of the tank's runs takes minutes
WAIT_MS = 1_200_000


#: When the page was painted and when it asked for series, ms since its address was asked for.
FIRST_PAINT_AND_SERIES = """() => {
  const asked = performance.getEntriesByType("resource").filter(e => e.name.includes("/series"));
  const painted = performance.getEntriesByName("first-contentful-paint")[0];
  return [painted.startTime, Math.min(...asked.map(e => e.startTime))];
}"""


@dataclass
class Opened:
    """A tab that may write, and the address of the pages."""

    tab: Page
    base: str
    #: What the browser complained of, a violation of the pages' policy among it.
    complaints: list[str] = field(default_factory=list)

    def json(self, path: str) -> Any:
        """Return the document at an address of the pages."""
        return self.tab.request.get(f"{self.base}{path}").json()


@contextmanager
def opened(warehouse: Path, state: Path, *options: str, width: int = 1280) -> Iterator[Opened]:
    """Serve a warehouse and open its first page."""
    chromium = os.environ.get("KEMPF_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    command = [*KEMPF, "workbench", "--warehouse", str(warehouse), "--state", str(state), "--port", "0", *options]
    with sync_playwright() as playwright, subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
        assert server.stderr is not None
        found = re.search(r"http://\S+", server.stderr.readline())
        assert found is not None, "the workbench did not start"
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        tab = browser.new_context(viewport={"width": width, "height": 900}, color_scheme="light").new_page()
        tab.set_default_timeout(WAIT_MS)
        made = Opened(tab, found.group().partition("/?")[0])
        tab.on("console", lambda message: made.complaints.append(message.text))
        tab.on("pageerror", lambda error: made.complaints.append(str(error)))
        tab.goto(found.group())
        try:
            yield made
        finally:
            browser.close()
            server.send_signal(signal.SIGINT)
