"""Reading NMEA 0183 beside the package that a user would take, and whether exactly the damaged lines are refused.

Both sides start from the same bytes in memory, in turn within one process. The rival parses each line, checks its
checksum and reads every field; ours gives channels in SI with their times, screened, with both ledgers.
"""

from __future__ import annotations

import argparse
import gzip
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import perf_counter, process_time

import zstandard

from benchmarks.ingest.mixed_nmea import DRESSES, mixed_log
from benchmarks.result_page import DATA, RESULTS, table, write
from kempf.pipeline.ingest.nmea.decode import decode
from kempf.schemas.profile import VesselProfile
from tests.reading import read_log

#: Seconds on the wall and of the processor.
Spent = tuple[float, float]

#: Times as fast as the rival with the fields read, that is wanted.
TARGET = 8.0


@dataclass(frozen=True)
class Measured:
    """One log: what each round took, and what was found in it."""

    name: str
    lines: int
    megabytes: float
    decoding: list[Spent]
    reading: list[Spent]
    rival: list[Spent]
    refused: str
    peak_bytes_per_byte: float

    def ratio(self, mine: list[Spent], clock: int) -> float:
        """Median over the rounds of the rival's time over ours; clock 0 hangs on the wall, 1 is the processor's."""
        return median(theirs[clock] / ours[clock] for theirs, ours in zip(self.rival, mine, strict=True))

    def rate(self, spent: list[Spent]) -> str:
        """Thousand sentences per second of the processor."""
        return f"{self.lines / median(cpu for _, cpu in spent) / 1e3:.0f}"


def unpacked(name: str, data: bytes) -> bytes:
    if name.endswith(".gz"):
        return gzip.decompress(data)
    return zstandard.ZstdDecompressor().decompressobj().decompress(data) if name.endswith(".zst") else data


def rival(data: bytes) -> int:
    """Decode with pynmea2, every field of every sentence; return how many it could read."""
    import pynmea2  # type: ignore[import-not-found, unused-ignore]

    read = 0
    for line in data.decode("latin-1").splitlines():
        try:
            message = pynmea2.parse(line[max(line.rfind("$"), line.rfind("!")) :], check=True)
            _ = [getattr(message, name[1]) for name in message.fields]
            read += 1
        except (pynmea2.ParseError, ValueError, AttributeError):
            continue
    return read


def spent(work: Callable[[], object]) -> Spent:
    begin, worked = perf_counter(), process_time()
    work()
    return perf_counter() - begin, process_time() - worked


def measure(name: str, data: bytes, wrong: set[int] | None, rounds: int) -> Measured:
    """Time one log; ``wrong`` are the lines that were damaged, None where that is not known."""
    profile = VesselProfile()
    content = unpacked(name, data)
    readings = read_log(name, data, profile)
    stated = set(readings.rejected.filter(readings.rejected["reason"] == "checksum")["record"].to_list())
    found = (
        f"{len(stated)}" if wrong is None else f"{len(stated & wrong)} of {len(wrong)}, {len(stated - wrong)} others"
    )
    tracemalloc.start()
    decode(content)
    peak = tracemalloc.get_traced_memory()[1] / len(content)
    tracemalloc.stop()
    decoding, reading, theirs = [], [], []
    for _ in range(rounds):
        decoding.append(spent(lambda: decode(content)))
        reading.append(spent(lambda: read_log(name, data, profile)))
        theirs.append(spent(lambda: rival(unpacked(name, data))))
    lines = readings.tally.records_read
    return Measured(name, lines, len(data) / 1e6, decoding, reading, theirs, found, peak)


def page(found: list[Measured], lines: int) -> list[str]:
    """Lines of the page."""
    rows = [
        [
            m.name,
            f"{m.lines}",
            f"{m.megabytes:.1f}",
            m.rate(m.rival),
            m.rate(m.decoding),
            m.rate(m.reading),
            f"{m.ratio(m.decoding, 1):.1f}",
            f"**{m.ratio(m.reading, 1):.1f}**",
            f"{m.ratio(m.reading, 0):.1f}",
            m.refused,
            f"{m.peak_bytes_per_byte:.1f}",
        ]
        for m in found
    ]
    head = [
        "log",
        "lines",
        "MB",
        "pynmea2",
        "decoded",
        "read",
        "decoded / pynmea2",
        "read / pynmea2",
        "the same on the wall",
    ]
    head += ["wrong checksums refused", "peak memory, bytes a byte"]
    large = [m for m in found if m.lines >= lines]
    least = min(m.ratio(m.reading, 1) for m in large)
    return [
        "Thousand sentences per second of the processor (on all cores together), medians of the rounds; ratios are "
        f"medians of the rounds' own ratios. Over the logs of {lines} lines and more, reading is at least "
        f"{least:.1f} times as fast as pynmea2 with its fields read (wanted: {TARGET:g}).",
        "",
        *table(head, rows),
        "",
        "*decoded*: bytes to channels in SI with their times. *read*: unpacked, decoded, screened for clock, "
        "repetition and range, and every refusal listed with its reason and its line. pynmea2 parses every line, "
        "checks its checksum and reads every field; it gives no units, no times and no ledger.",
        "",
        "The generated logs mix every sentence that is read with AIS, proprietary and satellite ones, ten a second "
        "over midnight: with a stamp, without, and with a TAG block in front of each. The real logs are short: the "
        "milliseconds that a log costs whatever its size weigh more.",
        "",
        "![speed beside pynmea2](nmea_speed.png)",
    ]


def draw(found: list[Measured], path: Path) -> None:
    """Draw sentences per second, log by log."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 0.5 * len(found) + 1.4), layout="constrained")
    for k, one in enumerate(found):
        pairs = ((one.rival, "0.6", "pynmea2"), (one.reading, "C0", "read"), (one.decoding, "C2", "decoded"))
        for shift, (times, colour, label) in enumerate(pairs):
            rate = float(one.rate(times))
            axes.barh(k + 0.27 * (shift - 1), rate, 0.25, color=colour, label=label if k == 0 else None)
    axes.set_yticks(range(len(found)), [m.name for m in found])
    axes.invert_yaxis()
    axes.set_xlabel("thousand sentences per second of the processor")
    axes.legend(frameon=False)
    figure.savefig(path, dpi=120, metadata={"Software": None})
    plt.close(figure)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lines", type=int, default=120_000)
    parser.add_argument("--damaged", type=int, default=1_000)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--data", type=Path, default=DATA)
    options = parser.parse_args()
    found = []
    for dress in DRESSES:
        data, wrong = mixed_log(options.lines, dress, options.damaged)
        found.append(measure(f"{dress}.nmea", data, wrong, options.rounds))
        if dress == "stamped":
            found.append(measure("stamped.nmea.gz", gzip.compress(data, 6, mtime=0), wrong, options.rounds))
            packed = zstandard.ZstdCompressor().compress(data)
            found.append(measure("stamped.nmea.zst", packed, wrong, options.rounds))
    for path in sorted((options.data / "data" / "nmea").glob("*")):
        found.append(measure(path.name, path.read_bytes(), None, options.rounds))
    RESULTS.mkdir(exist_ok=True)
    draw(found, RESULTS / "nmea_speed.png")
    settings = f"--lines {options.lines} --damaged {options.damaged} --rounds {options.rounds}"
    title = "NMEA 0183 beside pynmea2"
    print(write("ingest.nmea_speed", title, page(found, options.lines), options=settings).read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
