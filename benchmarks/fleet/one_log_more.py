"""What one log more of a vessel costs, beside how many are held already.

A ferry sails a short zigzag a day. So many logs are taken in and brought up to date; then one after the other comes, as
in the night, and the processor time of taking it in and of bringing her up to date is measured: the median of some, and
of those nights the ones in which all her manoeuvres are fitted at once apart. ``--work`` keeps the warehouses.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time

from benchmarks import result_page
from kempf.flows.jobs.ingest.ingest_logs import ingest_log
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, logs, parameter_sets
from kempf.warehouse.upkeep.compaction import compact

_DAY_NS = 86_400_000_000_000
VESSEL = "ferry"
HELD = (2, 20, 200)
NIGHTS = 5


@dataclass(frozen=True)
class Night:
    """One log more."""

    ingest_s: float
    reprocess_s: float
    #: Whether the night fitted all of her manoeuvres at once.
    at_once: bool


@dataclass(frozen=True)
class Measured:
    """A vessel with so many logs."""

    held: int
    #: Of bringing all of them up to date at once; None where that had been done before.
    first_s: float | None
    nights: tuple[Night, ...]

    def typical(self, of: str) -> float:
        """Return the median of the nights in which not all was fitted at once, of all where there is none such."""
        usual = [night for night in self.nights if not night.at_once] or list(self.nights)
        return median(getattr(night, of) for night in usual)


def take_in(warehouse: Warehouse, day: int) -> None:
    """Take one day in."""
    settings = zigzag_settings(VESSEL, duration_s=300.0, steady_s=40.0, seed=day)
    settings = replace(settings, start_utc_ns=settings.start_utc_ns + day * _DAY_NS)
    log = LogFile(to_csv(simulate_trial(settings), rate_hz=2.0))
    ingest_log(warehouse, VESSEL, f"day{day}.csv.gz", log, logger_profile(settings), VESSEL)


def measure(place: Path, held: int) -> Measured:
    """Measure a vessel with so many logs; what a folder holds already is not made again."""
    warehouse = Warehouse(str(place))
    there = len(logs.current(warehouse, VESSEL)) if warehouse.exists() else 0
    for day in range(there, held):
        take_in(warehouse, day)
        if (day + 1) % 50 == 0:
            compact(warehouse)
            print(f"{day + 1} of {held} logs", flush=True)
    first = None
    if there <= held:
        began = process_time()
        reprocess_vessel(warehouse, VESSEL)
        first = process_time() - began
    compact(warehouse)
    nights = []
    for day in range(max(there, held), max(there, held) + NIGHTS):
        began = process_time()
        take_in(warehouse, day)
        taken = process_time()
        report = reprocess_vessel(warehouse, VESSEL)
        done = process_time()
        assert report.new_sets == 2 and not report.failures, report
        now = parameter_sets.as_stored(warehouse, aliases.of_vessel(warehouse, VESSEL)["current"])
        nights.append(Night(taken - began, done - taken, now.updates is None))
        print(held, nights[-1], flush=True)
    return Measured(held, first, tuple(nights))


def page(found: Sequence[Measured]) -> list[str]:
    """Return the lines of the page."""
    reference = found[min(1, len(found) - 1)]
    whole = reference.typical("ingest_s") + reference.typical("reprocess_s")
    head = ("logs held", "ingest", "bring up to date", "both", f"beside {reference.held} held", "all fitted at once")
    rows = []
    for one in found:
        ingest, reprocess = one.typical("ingest_s"), one.typical("reprocess_s")
        at_once = [night for night in one.nights if night.at_once]
        many = f"{len(at_once)} of {len(one.nights)} nights"
        if at_once:
            many += f", {median(night.reprocess_s for night in at_once):.2f} s"
        if one.first_s is not None:
            many += f"; the first time {one.first_s:.1f} s"
        rows.append(
            (
                *(str(one.held), f"{ingest:.2f} s", f"{reprocess:.2f} s"),
                *(f"{ingest + reprocess:.2f} s", f"{(ingest + reprocess) / whole:.2f}", many),
            )
        )
    return [
        f"Processor time of one short log more (a zigzag of 300 s): medians of {NIGHTS} nights. Fewer than sixteen "
        "manoeuvres are all fitted at once every night, more where they have grown by half since all were; the nights "
        "between bring the last set forward (decision 0061).",
        "",
        *result_page.table(head, rows),
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark and write its page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--held", type=int, nargs="*", default=list(HELD))
    parser.add_argument("--work", type=Path, help="folder in which the warehouses are kept")
    asked = parser.parse_args(arguments)
    with nullcontext(asked.work) if asked.work else TemporaryDirectory() as folder:
        found = [measure(Path(folder) / f"held{held}", held) for held in asked.held]
    options = "" if tuple(asked.held) == HELD else "--held " + " ".join(map(str, asked.held))
    result_page.write("fleet.one_log_more", "One log more", page(found), options=options)


if __name__ == "__main__":
    main()
