"""A browser at the pages, for the tests that need one: without a Chromium they are skipped."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.workbench.driving import START, environment

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
BROWSER = os.environ.get("KEMPF_CHROMIUM") or next((found for name in BROWSERS if (found := shutil.which(name))), None)
NEEDS_BROWSER = pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine; KEMPF_CHROMIUM names one")
WAIT_MS = 300_000


@dataclass
class Server:
    """`kempf workbench` in a process of its own."""

    process: subprocess.Popen[str]
    start: str
    warehouse: Path
    #: What the browser complained of.
    complaints: list[str] = field(default_factory=list)

    @property
    def base(self) -> str:
        return self.start.partition("/?")[0]

    def json(self, path: str) -> Any:
        return httpx.get(self.base + path).json()


def served(place: Path, state: Path, *options: str) -> Iterator[Server]:
    process = subprocess.Popen(
        [sys.executable, "-c", START, "workbench", "--warehouse", place, "--state", state, "--port", "0", *options],
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
    )
    assert process.stderr is not None
    line = process.stderr.readline()
    found = re.search(r"http://\S+", line)
    assert found, line
    try:
        yield Server(process, found.group(), place)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(30)
        process.stderr.close()


def launched() -> Iterator[Any]:
    """A browser, for a fixture."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        one = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield one
        one.close()


def opened(browser: Any, server: Server, **options: Any) -> Any:
    """A tab in which a complaint of the browser is one of the test's."""
    tab = browser.new_context(**{"viewport": {"width": 1280, "height": 900}, **options}).new_page()
    tab.set_default_timeout(WAIT_MS)
    tab.on("console", lambda message: server.complaints.append(message.text))
    tab.on("pageerror", lambda error: server.complaints.append(str(error)))
    return tab


def reach(tab: Any, selector: str, key: str = "Enter") -> None:
    """Go to an element as one who has no mouse does, by the tab key, and press it."""
    wanted = tab.wait_for_selector(selector)
    for _ in range(400):
        if wanted.evaluate("node => node === document.activeElement"):
            tab.keyboard.press(key)
            return
        tab.keyboard.press("Tab")
    raise AssertionError(f"the tab key does not reach {selector} on {tab.url}")


def accessible(tab: Any) -> None:
    """Let axe look at a page, which is no wider than its window."""
    from axe_playwright_python.sync_playwright import Axe

    violations = Axe().run(tab).response["violations"]
    assert [(one["id"], one["nodes"][0]["html"]) for one in violations] == [], tab.url
    assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth"), tab.url
