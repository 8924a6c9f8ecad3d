"""An hour-long log from bytes to parameter sets: how long, where the time goes, and what else a user would take.

Every measurement runs in a process of its own, after one that compiled and cached the kernel. Seconds depend on the
machine and on what else it does: medians are given, and ratios to the usual decoders measured in the same run.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from typing import Any

_BEGIN = perf_counter()

FORMATS = ("nmea.gz", "csv.gz", "mcap")
STAGES = ("read", "segment", "store", "identify")
#: What a user would decode the same bytes with.
RIVALS = {"nmea.gz": "pynmea2", "csv.gz": "csv", "mcap": "mcap and orjson"}
TARGET_S = 5.0


@dataclass(frozen=True)
class Timing:
    """Medians of one format, s: by stage, ``import``, ``cpu`` of all stages on all cores, ``read again`` in the same
    process; the rival's decoding, None where it is not installed.
    """

    log: str
    megabytes: float
    records: int
    zigzags: int
    seconds: dict[str, float]
    rival: float | None

    @property
    def total(self) -> float:
        """From bytes to stored sets, without interpreter and imports."""
        return sum(self.seconds[stage] for stage in STAGES)


def simulate(folder: Path) -> None:
    """Write the hour in every format, with the profile that reads it."""
    import yaml

    from kempf.pipeline.simulate.csv_log import to_csv
    from kempf.pipeline.simulate.hulls import HULLS
    from kempf.pipeline.simulate.logger_profile import logger_profile
    from kempf.pipeline.simulate.manoeuvre import SteadyCourse, ZigzagTest
    from kempf.pipeline.simulate.mcap_log import to_mcap
    from kempf.pipeline.simulate.nmea_log import to_nmea
    from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT, TrialSettings, simulate_trial

    programme = (
        SteadyCourse(180.0),
        ZigzagTest(20.0, 20.0, "starboard", duration_s=1200.0),
        SteadyCourse(360.0, heading_deg=60.0),
        ZigzagTest(10.0, 10.0, "port", duration_s=900.0),
        SteadyCourse(360.0, heading_deg=100.0),
        ZigzagTest(20.0, 20.0, "port", duration_s=600.0),
    )
    settings = TrialSettings(HULLS["mariner"], programme, PAPER_ENVIRONMENT, seed=11)
    trial = simulate_trial(settings)
    for name, written in zip(FORMATS, (to_nmea(trial), to_csv(trial), to_mcap(trial)), strict=True):
        (folder / f"hour.{name}").write_bytes(written)
    content = logger_profile(settings).model_dump(mode="json", exclude_defaults=True)
    (folder / "profile.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")


class Stopwatch:
    """Adds up the time spent in one function, s; stands in its place and passes everything on."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function, self.seconds = function, 0.0

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        begin = perf_counter()
        try:
            return self.function(*arguments, **named)
        finally:
            self.seconds += perf_counter() - begin


class TimedReading(Stopwatch):
    """Does as `Stopwatch` for a function that lends what was read until the end of a ``with``."""

    @contextmanager
    def __call__(self, *arguments: Any, **named: Any) -> Any:
        begin = perf_counter()
        with self.function(*arguments, **named) as readings:
            self.seconds += perf_counter() - begin
            yield readings


def job(log: Path, profile_path: Path, folder: Path) -> dict[str, float]:
    """Time the main job on one log, in this process, s; storing is what reading and segmenting leave of the ingest."""
    from kempf.flows.jobs.identify.identify_vessel import identify_vessel
    from kempf.flows.jobs.ingest import ingest_logs
    from kempf.flows.jobs.ingest.files import read_profiles
    from kempf.pipeline.ingest.read import read_parts
    from kempf.warehouse.storage.store import Warehouse

    profile = read_profiles([profile_path])
    stages = vars(ingest_logs)
    read, segment = TimedReading(stages["spooled"]), Stopwatch(stages["search"])
    stages.update(spooled=read, search=segment)
    warehouse = Warehouse(str(folder))
    begin, worked = perf_counter(), process_time()
    taken = ingest_logs.ingest(warehouse, [log], None, profile)[0]
    ingested = perf_counter()
    identify_vessel(warehouse, str(profile.vessel))
    end, worked = perf_counter(), process_time() - worked
    data = log.read_bytes()
    again = perf_counter()
    for _ in read_parts(log.name, data, profile):
        pass
    again = perf_counter() - again
    if taken.tally is None:
        raise RuntimeError(f"{log.name} was not taken in: {taken.error}")
    return {
        "import": begin - _BEGIN,
        "read": read.seconds,
        "segment": segment.seconds,
        "store": ingested - begin - read.seconds - segment.seconds,
        "identify": end - ingested,
        "cpu": worked,
        "read again": again,
        "records": taken.tally.records_read,
        "zigzags": len(taken.segments),
    }


def decode_as_usual(log: Path) -> dict[str, float]:
    """Time a plain decoding to numbers with the usual package, s; empty where it is not installed."""
    import gzip

    data = log.read_bytes()
    try:
        if log.name.endswith("nmea.gz"):
            import pynmea2  # type: ignore[import-not-found, unused-ignore]

            begin, read = perf_counter(), 0
            for line in gzip.decompress(data).decode("latin-1").splitlines():
                try:
                    message = pynmea2.parse(line[line.index("$") :], check=True)
                    _ = [getattr(message, name[1]) for name in message.fields]
                    read += 1
                except (pynmea2.ParseError, ValueError, AttributeError):
                    continue
        elif log.name.endswith("csv.gz"):
            import csv

            begin, read = perf_counter(), 0
            rows = csv.DictReader(gzip.decompress(data).decode().splitlines())
            read = sum(len([float(value) for name, value in row.items() if name != "utc"]) > 0 for row in rows)
        else:
            import io

            import orjson
            from mcap.reader import make_reader

            begin, read = perf_counter(), 0
            messages = make_reader(io.BytesIO(data)).iter_messages()
            read = sum(bool(orjson.loads(message.data)) for _, _, message in messages)
    except ModuleNotFoundError:
        return {}
    return {"decode": perf_counter() - begin, "records": read}


def _child(folder: Path, *arguments: str) -> dict[str, float]:
    """Run this module in a new process; the bytecode that a user's second start finds lies in the folder."""
    command = [sys.executable, "-m", "benchmarks.ingest.speed", *arguments]
    setting = {**os.environ, "PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(folder / "bytecode")}
    where = Path(__file__).parents[2]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=where, env=setting)
    if done.returncode:
        raise RuntimeError(done.stderr)
    output: dict[str, float] = json.loads(done.stdout)
    return output


def measure(folder: Path, runs: int) -> list[Timing]:
    """Run every format so many times after a warm-up, in turn, so that a busy machine is busy for all."""
    ours: dict[str, list[dict[str, float]]] = {log: [] for log in FORMATS}
    theirs: dict[str, list[dict[str, float]]] = {log: [] for log in FORMATS}
    for number in range(runs + 1):
        for log in FORMATS:
            path = folder / f"hour.{log}"
            warehouse = folder / f"warehouse-{log}-{number}"
            ours[log].append(_child(folder, "--job", str(path), str(folder / "profile.yaml"), str(warehouse)))
            theirs[log].append(_child(folder, "--rival", str(path)))
    timings = []
    for log in FORMATS:
        names = ("import", *STAGES, "cpu", "read again")
        seconds = {name: median(o[name] for o in ours[log][1:]) for name in names}
        rival = median(t["decode"] for t in theirs[log][1:]) if all(theirs[log]) else None
        first, size = ours[log][0], (folder / f"hour.{log}").stat().st_size / 1e6
        timings.append(Timing(log, size, int(first["records"]), int(first["zigzags"]), seconds, rival))
    return timings


def page(timings: list[Timing], runs: int) -> list[str]:
    """Lines of the page."""
    from benchmarks.result_page import table

    worst = max(timing.total for timing in timings)
    rows = [
        [
            t.log,
            f"{t.megabytes:.1f}",
            str(t.records),
            str(t.zigzags),
            *(f"{t.seconds[stage]:.2f}" for stage in STAGES),
            f"**{t.total:.2f}**",
            f"{t.seconds['cpu']:.2f}",
            f"{t.seconds['import']:.2f}",
        ]
        for t in timings
    ]
    ratios = [
        [
            t.log,
            RIVALS[t.log],
            "not installed" if t.rival is None else f"{t.rival / t.seconds['read again']:.1f}",
            "" if t.rival is None else f"{t.total / t.rival:.1f}",
        ]
        for t in timings
    ]
    head = ["hour of", "MB", "records", "zigzags", "read", "segment", "store", "identify", "all four", "CPU of these"]
    head.append("imports")
    return [
        f"One hour of a simulated ship with three zigzags; medians of {runs} processes after one that compiles, s. "
        f"Slowest of the formats: {worst:.2f} s beyond interpreter and imports (wanted: below {TARGET_S:g}).",
        "",
        *table(head, rows),
        "",
        "The usual decoder turns the same bytes into numbers and no more: no units, no checks of range, no ledger.",
        "Warm: imports and compiled code are there already, as in the second log of a batch.",
        "",
        *table(["hour of", "usual decoder", "its time / our reading, both warm", "our whole job / its time"], ratios),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--job", nargs=3, type=Path, metavar=("LOG", "PROFILE", "WAREHOUSE"), help=argparse.SUPPRESS)
    parser.add_argument("--rival", type=Path, metavar="LOG", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.job:
        print(json.dumps(job(*options.job)))
        return
    if options.rival:
        print(json.dumps(decode_as_usual(options.rival)))
        return
    from benchmarks.result_page import write

    with TemporaryDirectory() as name:
        folder = Path(name)
        simulate(folder)
        timings = measure(folder, options.runs)
    title = "An hour-long log from bytes to parameter sets"
    path = write("ingest.speed", title, page(timings, options.runs), options=f"--runs {options.runs}")
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
