"""Fuzzes the readers of foreign files: no crash, no hang, no memory without bound, no failed checksum accepted.

Each reader is fuzzed in processes of its own, one after the other; a process that dies or hangs is a finding too, and
the next one goes on with the next seed. The page shows the latest campaign of every reader.
"""

from __future__ import annotations

import argparse
import base64
import json
import signal
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.ingest.fuzzing.campaign import HANG_S, MEMORY, Campaign, run
from benchmarks.ingest.fuzzing.corpus import READERS, Reader
from benchmarks.ingest.fuzzing.mutate import LARGEST
from benchmarks.result_page import RESULTS, table, write

#: A process works for so long at most, s of the processor: what it has learnt it starts anew with the next seed.
STINT_S = 120.0
#: ... and is ended by the system when one input takes so long, s of the processor.
HUNG_S = 30.0
#: Bytes of an input that are printed with a finding.
_SHOWN = 3_000


def stated(campaign: Campaign) -> dict[str, Any]:
    """Return a campaign as plain data."""
    return {
        "iterations": campaign.iterations,
        "seconds": campaign.seconds,
        "slowest_s": campaign.slowest[0],
        "slowest_bytes": campaign.slowest[1],
        "grown_bytes": campaign.grown,
        "refused": campaign.refused,
        "outcomes": sorted("/".join(outcome) for outcome in campaign.outcomes),
        "findings": [
            {"what": one.what, "name": one.name, "bytes": len(one.data), "data": base64.b64encode(one.data).decode()}
            for one in campaign.findings
        ],
    }


def stint(reader: Reader, seed: int, seconds: float, folder: Path) -> dict[str, Any]:
    """Fuzz in a process of its own; return what it reports, or what it died of."""
    current = folder / "current"
    command = [sys.executable, "-m", "benchmarks.ingest.fuzz", "--reader", reader, "--seed", str(seed)]
    command += ["--stint", str(seconds), "--current", str(current)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=Path(__file__).parents[2])
    if done.returncode == 0:
        result: dict[str, Any] = json.loads(done.stdout)
        return result
    why = f"the process ended with {done.returncode}: {done.stderr[-500:]}"
    if done.returncode == -signal.SIGPROF:
        why = f"hung for more than {HUNG_S:g} s"
    name, _, data = (current.read_bytes() if current.is_file() else b"?\n").partition(b"\n")
    found = {"what": why, "name": name.decode(), "bytes": len(data), "data": base64.b64encode(data).decode()}
    return {
        "iterations": 0,
        # what it had worked is not known: the reader's time is not stretched for it
        "seconds": seconds,
        "slowest_s": 0.0,
        "slowest_bytes": 0,
        "grown_bytes": 0,
        "refused": 0,
        "outcomes": [],
        "findings": [found],
    }


def fuzz(reader: Reader, minutes: float, seed: int) -> dict[str, Any]:
    """Fuzz one reader for so many minutes, stint by stint; return what all of them tell together."""
    stints: list[dict[str, Any]] = []
    with TemporaryDirectory() as name:
        while (left := 60.0 * minutes - sum(s["seconds"] for s in stints)) > 0.5:
            stints.append(stint(reader, seed + len(stints), min(left, STINT_S), Path(name)))
            last = stints[-1]
            print(f"{reader}: {last['iterations']} inputs, {len(last['findings'])} findings", file=sys.stderr)
    slowest = max(stints, key=lambda s: s["slowest_s"])
    return {
        "reader": reader,
        "seed": seed,
        "iterations": sum(s["iterations"] for s in stints),
        "seconds": sum(s["seconds"] for s in stints),
        "slowest_s": slowest["slowest_s"],
        "slowest_bytes": slowest["slowest_bytes"],
        "grown_bytes": max(s["grown_bytes"] for s in stints),
        "refused": sum(s["refused"] for s in stints),
        "outcomes": len({outcome for s in stints for outcome in s["outcomes"]}),
        "findings": [finding for s in stints for finding in s["findings"]],
    }


def page(campaigns: list[dict[str, Any]]) -> list[str]:
    """Lines of the page."""
    rows = [
        [
            c["reader"],
            f"{c['seconds'] / 60:.1f}",
            f"{c['iterations']}",
            f"{100 * c['refused'] / max(c['iterations'], 1):.0f} %",
            f"{c['outcomes']}",
            f"{c['slowest_s']:.2f} s ({c['slowest_bytes']} bytes)",
            f"{c['grown_bytes'] / (1 << 20):.0f} MB",
            f"{len(c['findings'])}",
        ]
        for c in campaigns
    ]
    found = [
        f"- {c['reader']}: {f['what']} ({f['name']}, {f['bytes']} bytes)" for c in campaigns for f in c["findings"]
    ]
    head = [
        "reader",
        "minutes of the processor",
        "inputs",
        "refused whole",
        "kinds of outcome",
        "longest in the reader",
        "memory grew by",
    ]
    return [
        "Small valid inputs, damaged by bits, bytes, words, lines and splices, up to "
        f"{LARGEST >> 10} kB each; those that make a reader do something new are damaged further. For NMEA most get "
        "checksums that fit again, so that the damage reaches the fields. Some are compressed, and damaged after that.",
        "",
        "A finding is: an exception that is no error for a person to read; a ledger that does not close; a line, "
        f"record or value that is not counted; more than {HANG_S:g} s in the reader for one input; more than "
        f"{MEMORY >> 20} MB of memory added; an NMEA sentence, an MCAP message or a gzip file kept although its "
        "checksum fails, which is computed anew without the readers' code; a process that dies.",
        "",
        *table([*head, "findings"], rows),
        "",
        *(found or ["No findings."]),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0, help="of the processor, for each reader")
    parser.add_argument("--reader", choices=READERS, action="append", help="may be repeated; all without it")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--stint", type=float, help=argparse.SUPPRESS)
    parser.add_argument("--current", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    readers: list[Reader] = options.reader or list(READERS)
    if options.stint:

        def before(name: str, data: bytes) -> None:
            options.current.write_bytes(name.encode() + b"\n" + data)
            signal.setitimer(signal.ITIMER_PROF, HUNG_S)

        print(json.dumps(stated(run(readers[0], options.seed, seconds=options.stint, before=before))))
        return
    kept = RESULTS / "fuzz.json"
    latest: dict[str, dict[str, Any]] = json.loads(kept.read_text(encoding="utf-8")) if kept.is_file() else {}
    RESULTS.mkdir(exist_ok=True)
    for reader in readers:
        latest[reader] = fuzz(reader, options.minutes, options.seed)
        for finding in latest[reader]["findings"]:
            print(f"{reader}: {finding['what']}\n  {finding['name']} {finding['data'][:_SHOWN]}", file=sys.stderr)
            finding["data"] = finding["data"][:_SHOWN]
        # after every reader: a campaign that is interrupted keeps what it has found
        latest = {reader: latest[reader] for reader in READERS if reader in latest}
        kept.write_text(json.dumps(latest, indent=1) + "\n", encoding="utf-8")
        path = write(
            "ingest.fuzz",
            "Fuzzing of the readers",
            page(list(latest.values())),
            options=f"--minutes {options.minutes:g}",
        )
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
