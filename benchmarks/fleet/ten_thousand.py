"""A fleet of ten thousand vessels with fifty logs each: a night in which nothing came, one log, and a history.

The metadata are those of one real log, its zigzag and its set, copied under other ids for every vessel and log; raw
bytes and readings there are none of. Beside these vessels is one with logs of her own, of whom one more comes in the
night. Everything is asked in one process, the warehouse compacted before, and again for fleets with fewer logs.
"""

from __future__ import annotations

import argparse
import json
import resource
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

import polars as pl

from benchmarks import result_page
from benchmarks.fleet.one_log_more import VESSEL, take_in
from kempf.flows.fleet.plan import do_batch, plan
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.vessel_report import VesselReport
from kempf.flows.jobs.state.vessel_state import fleet_state
from kempf.warehouse.queries import history
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import one_of, vessel_key
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import runs, vessels
from kempf.warehouse.upkeep.compaction import compact

_DAY_NS = 86_400_000_000_000
#: tables of which every log has a row, and the columns in which its ids and instants stand
_OF_A_LOG = ("logs", "examinations", "segments", "parameter_sets")
#: vessels that are written in one commit, and logs of the vessel that has logs of her own
_TOGETHER, _REAL = 250, 20


@dataclass(frozen=True)
class Figures:
    """One fleet."""

    fleet: int
    logs: int
    #: Seconds on the clock and of the processor of each question.
    asked: dict[str, tuple[float, float]]
    files: int
    size_gb: float


def template(warehouse: Warehouse) -> dict[str, pl.DataFrame]:
    """Return the rows of one real log in every table."""
    take_in(warehouse, 0)
    reprocess_vessel(warehouse, VESSEL)
    return {name: delta.read(warehouse, name).head(1) for name in (*_OF_A_LOG, "vessels")}


def fill(warehouse: Warehouse, one: dict[str, pl.DataFrame], fleet: int, each: int) -> None:
    """Put the copies in; what there is already of them is not put in again."""
    there = set(vessels.names(warehouse))
    profile = vessels.current(warehouse, VESSEL)
    for first in range(0, fleet, _TOGETHER):
        names = [f"vessel{number:05d}" for number in range(first, min(first + _TOGETHER, fleet))]
        if names[-1] in there:
            continue
        ids = pl.DataFrame(
            {
                "vessel": [name for name in names for _ in range(each)],
                "number": list(range(each)) * len(names),
            }
        )
        ids = ids.with_columns(
            vessel_key=pl.col("vessel").replace_strict({name: vessel_key(name) for name in names}),
            log_id=pl.Series([sha256(f"{v} {n}".encode()).hexdigest() for v, n in ids.rows()]),
        ).with_columns(
            ingest_id=pl.col("log_id").str.slice(16, 16),
            segment_id="seg-" + pl.col("log_id").str.slice(32, 16),
            parameter_set_id="ps-" + pl.col("log_id").str.slice(0, 16),
            later=pl.col("number") * _DAY_NS,
        )
        vessels.register_all(warehouse, [(name, profile.model_copy(update={"vessel": name})) for name in names])
        hashes = vessels.current_hashes(warehouse)
        keys = [vessel_key(name) for name in names]
        for table in ("parameter_sets", "segments", "examinations", "logs"):
            frame = _copies(table, one[table], ids, hashes)
            with delta.ensured(warehouse, table) as opened:
                delta.replace(opened, table, iter([frame]), one_of("vessel_key", keys))
    settled = [
        VesselReport(name, logs=each).as_run(state.digest, changed_only=True, estimator=None)
        for name, state in fleet_state(warehouse).items()
        if name != VESSEL
    ]
    for first in range(0, len(settled), 2000):
        runs.record_all(warehouse, settled[first : first + 2000])


def _copies(table: str, one: pl.DataFrame, ids: pl.DataFrame, hashes: dict[str, str]) -> pl.DataFrame:
    """Return a row for every log, with the ids, instants and hashes of its own."""
    rest = one.drop([name for name in ids.columns if name in one.columns])
    rows = ids.join(rest, how="cross")
    moved = [pl.col(name) + pl.col("later") for name in ("start_utc_ns", "end_utc_ns") if name in one.columns]
    rows = rows.with_columns(moved)
    if "profile_sha256" in one.columns:
        rows = rows.with_columns(profile_sha256=pl.col("vessel").replace_strict(hashes))
    if table == "parameter_sets":
        text = one["provenance_json"][0]
        before, after = text.split(json.dumps(json.loads(text)["ingest_ids"][0]), 1)
        rows = rows.with_columns(
            provenance_json=pl.lit(before + '"') + pl.col("ingest_id") + pl.lit('"' + after),
            segment_ids=pl.concat_list("segment_id"),
            log_ids=pl.concat_list("log_id"),
        )
    return rows.select(one.columns)


def measure(warehouse: Warehouse, fleet: int, each: int) -> Figures:
    """Ask the questions of one fleet."""
    asked: dict[str, tuple[float, float]] = {}

    def timed(what: str, job: Callable[[], object]) -> object:
        began, worked = perf_counter(), process_time()
        made = job()
        asked[what] = perf_counter() - began, process_time() - worked
        print(fleet, each, what, *(round(x, 2) for x in asked[what]), flush=True)
        return made

    quiet = timed("a night in which nothing came", lambda: plan(warehouse))
    assert not quiet.due, quiet.due[:3]  # type: ignore[attr-defined]
    day = len(delta.read(warehouse, "logs", {"vessel_key": vessel_key(VESSEL)}, ("log_id",)))
    timed("one log is taken in", lambda: take_in(warehouse, day))
    busy = timed("the plan of the night after", lambda: plan(warehouse))
    assert [name for name, _ in busy.due] == [VESSEL]  # type: ignore[attr-defined]
    done = timed("her vessel is brought up to date", lambda: do_batch(warehouse, [VESSEL], changed_only=True))
    assert done[0]["new_sets"] == 2, done  # type: ignore[index]
    timed("the history of a vessel", lambda: history.of_vessel(warehouse, "vessel00017"))
    timed(
        "that as of now, by the commits", lambda: history.of_vessel(warehouse, "vessel00023", as_of=datetime.now(UTC))
    )
    assert warehouse.folder is not None
    files = [path for path in warehouse.folder.rglob("*") if path.is_file()]
    return Figures(fleet, each, asked, len(files), sum(path.stat().st_size for path in files) / 1e9)


def page(found: Sequence[Figures]) -> list[str]:
    """Return the lines of the page."""
    head = ("", *(f"{one.fleet} vessels, {one.logs} logs each" for one in found))
    rows = [
        (what, *(f"{one.asked[what][0]:.2f} s ({one.asked[what][1]:.2f} s of the processor)" for one in found))
        for what in found[0].asked
    ]
    rows.append(("files in the warehouse", *(f"{one.files}" for one in found)))
    rows.append(("size without raw logs and readings", *(f"{one.size_gb:.1f} GB" for one in found)))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return [
        f"Metadata of one real log copied for every other one; beside these vessels one with {_REAL} logs of her own "
        f"and a zigzag in each, of whom one more comes. The process took {peak:.1f} GB of memory at most.",
        "",
        *result_page.table(head, rows),
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark and write its page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vessels", type=int, default=10_000)
    parser.add_argument("--logs", type=int, nargs="*", default=[5, 50])
    parser.add_argument("--work", type=Path, help="folder in which the warehouses are kept")
    asked = parser.parse_args(arguments)
    found = []
    with nullcontext(asked.work) if asked.work else TemporaryDirectory() as folder:
        for each in asked.logs:
            warehouse = Warehouse(str(Path(folder) / f"{asked.vessels}x{each}"))
            one = template(warehouse)
            for day in range(1, _REAL):
                take_in(warehouse, day)
            reprocess_vessel(warehouse, VESSEL)
            fill(warehouse, one, asked.vessels, each)
            compact(warehouse)
            found.append(measure(warehouse, asked.vessels, each))
    result_page.write("fleet.ten_thousand", "Ten thousand vessels", page(found))


if __name__ == "__main__":
    main()
