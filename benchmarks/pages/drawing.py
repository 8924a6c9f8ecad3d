"""What the pages cost in a browser, as ratios: ``python -m benchmarks.pages.drawing``.

Against what the same browser on the same machine takes to stroke one bare line of 36,000 points, what numpy takes for
one pass over the values, and what the command line takes for the same document. Medians, measured in one run.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import numpy as np
import polars as pl
import yaml
from playwright.sync_api import Page

from benchmarks import result_page
from benchmarks.pages.browser import FIRST_PAINT_AND_SERIES, KEMPF, Opened, opened
from kempf.pipeline.channels.series import Series
from kempf.schemas.units import SECOND_NS
from kempf.workbench.charts.bins import reduced

_ROWS, _RATE_HZ, _REPEATS = 36_000, 10, 15
_CHANNELS = ("rudder_angle", "heading", "yaw_rate", "speed_through_water", "speed_over_ground")
_MORE = ("course_over_ground", "shaft_speed", "roll")
#: strokes a line of as many readings with noise, as the panels', and waits until it is there
_BARE = """points => {
  const canvas = document.createElement("canvas");
  canvas.width = 1168; canvas.height = 124;
  const context = canvas.getContext("2d"), noise = () => Math.random() + Math.random() + Math.random() - 1.5;
  const y = Array.from({length: points}, () => 62 + 40 * noise());
  const begun = performance.now();
  context.lineWidth = 1.25;
  context.beginPath();
  for (let k = 0; k < points; k++) context.lineTo(1168 * k / points, y[k]);
  context.stroke();
  context.getImageData(0, 0, 1, 1);
  return performance.now() - begun;
}"""
#: turns the wheel over the first panel and waits until every panel is drawn
_ZOOM = """async by => {
  const over = document.querySelector(".u-over"), box = over.getBoundingClientRect();
  const place = {clientX: box.left + box.width / 2, clientY: box.top + 20, bubbles: true, cancelable: true};
  const begun = performance.now();
  over.dispatchEvent(new WheelEvent("wheel", {deltaY: by, ...place}));
  await Promise.resolve();
  for (const one of document.querySelectorAll(".chart canvas")) one.getContext("2d").getImageData(0, 0, 1, 1);
  return performance.now() - begun;
}"""


def log_of(folder: Path) -> None:
    """Write a log of an hour at ten readings a second, eight channels, and its profile."""
    t = np.arange(_ROWS) / _RATE_HZ
    swing = np.sin(2.0 * np.pi * t / 300.0)
    noise = np.random.default_rng(1).standard_normal((8, _ROWS))
    columns = {
        "rudder_angle": 10.0 * np.sign(swing) + 0.1 * noise[0],
        "heading": 90.0 + 20.0 * np.cos(2.0 * np.pi * t / 300.0) + 0.05 * noise[1],
        "yaw_rate": 0.4 * swing + 0.01 * noise[2],
        "speed_through_water": 7.0 + 0.05 * noise[3],
        "speed_over_ground": 7.2 + 0.05 * noise[4],
        "course_over_ground": 90.0 + 20.0 * np.cos(2.0 * np.pi * t / 300.0) + 0.5 * noise[5],
        "shaft_speed": 1.5 + 0.01 * noise[6],
        "roll": 2.0 * swing + 0.1 * noise[7],
    }
    start = np.datetime64("2025-05-03T06:00:00", "ms")
    stamps = start + (1000.0 * t).astype("timedelta64[ms]")
    pl.DataFrame({"time": stamps, **columns}).write_csv(folder / "hour.csv", datetime_format="%Y-%m-%dT%H:%M:%S%.3fZ")
    units = {"shaft_speed": "1/s", "yaw_rate": "deg/s", "speed_through_water": "m/s", "speed_over_ground": "m/s"}
    source = {
        "match": "*.csv",
        "format": "delimited",
        "time": {"column": "time"},
        "channels": {name: {"channel": name, "unit": units.get(name, "deg")} for name in columns},
    }
    source["channels"]["rudder_angle"]["positive"] = "starboard"  # type: ignore[index]
    profile = {"vessel": "hour", "length_m": 160.0, "sources": [source]}
    (folder / "hour.yaml").write_text(yaml.safe_dump(profile, sort_keys=False), encoding="utf-8")


def zoomed(tab: Page) -> float:
    """Return how long a zoom of all panels takes, in strokes of a bare line; both by turns."""
    bare, zoom = [], []
    for k in range(_REPEATS):
        bare.append(float(tab.evaluate(_BARE, _ROWS)))
        zoom.append(float(tab.evaluate(_ZOOM, 100 if k % 2 else -100)))
        tab.wait_for_selector("body[data-ready=yes]")
        tab.wait_for_timeout(250)
    print(f"bare line {median(bare):.1f} ms, zoom {median(zoom):.1f} ms")
    return median(zoom) / median(bare)


def reduction() -> float:
    """Return how long a million values take to be reduced, in passes of `numpy.fmin.reduceat` over them."""
    count = 1_000_000
    time_ns = (np.arange(count) * (SECOND_NS // _RATE_HZ)).astype(np.int64)
    series = Series(time_ns, np.random.default_rng(1).standard_normal(count))
    begins = np.arange(0, count, count // 1500)
    passes, whole = [], []
    for _ in range(_REPEATS):
        begun = time.perf_counter()
        np.fmin.reduceat(series.value, begins)
        passes.append(time.perf_counter() - begun)
        begun = time.perf_counter()
        reduced(series, 0, int(time_ns[-1]), 1500)
        whole.append(time.perf_counter() - begun)
    return median(whole) / median(passes)


def cpu_of_pages(page: Opened, process: int, paths: list[str]) -> float:
    """Return the processor time of the server for a page, s."""
    for path in paths:
        page.tab.request.get(f"{page.base}{path}")
    begun = _cpu_s(process)
    rounds = 10
    for _ in range(rounds):
        for path in paths:
            page.tab.request.get(f"{page.base}{path}")
    return (_cpu_s(process) - begun) / (rounds * len(paths))


def _cpu_s(process: int) -> float:
    fields = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def cpu_of_command(*words: str) -> float:
    """Return the processor time of a command, s."""
    begun = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([*KEMPF, *words], check=True, stdout=subprocess.DEVNULL)
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    return ended.ru_utime + ended.ru_stime - begun.ru_utime - begun.ru_stime


def _server_of(state: Path) -> int:
    """Return the process that serves the pages with a folder of state."""
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            words = (entry / "cmdline").read_bytes().split(b"\0") if (entry / "cmdline").exists() else []
            if b"workbench" in words and str(state).encode() in words:
                return int(entry.name)
    raise RuntimeError("the server is not among the processes of this machine")


def measured() -> list[list[str]]:
    """Measure everything, a row each: what, against what, the ratio, the budget."""
    with TemporaryDirectory() as place:
        folder = Path(place)
        log_of(folder)
        at = ["--warehouse", str(folder / "w")]
        files = [str(folder / "hour.csv"), "--profile", str(folder / "hour.yaml")]
        subprocess.run([*KEMPF, "ingest", *files, *at], check=True)
        channels = ",".join((*_CHANNELS, *_MORE))
        with opened(folder / "w", folder / "state") as page:
            log = page.json("/v/hour/logs.json")[0]["log_id"]
            page.tab.goto(f"{page.base}/logs/{log}?ch={channels}")
            page.tab.wait_for_selector("body[data-ready=yes]")
            assert page.tab.locator(".panel").count() == len(_CHANNELS) + len(_MORE)
            painted, asked = page.tab.evaluate(FIRST_PAINT_AND_SERIES)
            zoom = zoomed(page.tab)
            paths = ["/", "/v/hour", f"/logs/{log}", "/effects"]
            one = cpu_of_pages(page, _server_of(folder / "state"), paths)
            size = len(page.tab.request.get(f"{page.base}/logs/{log}/series?ch={channels}&bins=1500").body())
        command = median(cpu_of_command("segments", "--vessel", "hour", *at) for _ in range(3))
    line = f"one bare line of {_ROWS:,} points"
    return [
        [f"zoom of 8 panels of a log of {_ROWS:,} readings a channel", f"stroking {line}", f"{zoom:.2f}", "2"],
        ["reducing a million values", "one pass of `numpy.fmin.reduceat` over them", f"{reduction():.1f}", "3"],
        ["processor time of a page", "of `kempf segments`", f"{one / command:.3f}", "0.1"],
        ["first paint of the page of a log", "its first request for series", f"{painted / asked:.2f}", "1"],
        ["answer with 8 channels", "200 kB", f"{size / 200_000:.2f}", "1"],
    ]


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    rows = measured()
    lines = [
        "Each as a part of what it is beside; at most is the budget.",
        "",
        *result_page.table(["what", "beside", "ratio", "at most"], rows),
        "",
        f"Medians of {_REPEATS} by turns, in Chromium without a graphics card; a page: the mean of fleet, vessel, log "
        "and effects.",
    ]
    print(result_page.write("pages.drawing", "What the pages cost", lines))


if __name__ == "__main__":
    main()
