"""How long the history of one vessel takes among a million parameter rows, before and after a thousand commits.

The warehouse is made of copies of one real parameter set under other ids, with other values; then it grows set by set
as it does in use. What a user would pick instead holds the same rows and answers the same question in the same run.
"""

from __future__ import annotations

import argparse
import json
import os
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from typing import Any

import numpy as np
import polars as pl

from benchmarks.result_page import table, write
from kempf.warehouse.queries import history
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import one_of, vessel_key
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, parameter_sets
from kempf.warehouse.upkeep import compaction

TARGET_MS = 50.0
_DAY_NS, _START_NS = 86_400_000_000_000, 1_000_000_000_000_000_000
_ASKED = ("parameter_set_id", "start_utc_ns", "model", "estimator", "parameter", "value", "std", "unit")


@dataclass(frozen=True)
class Template:
    """One real set and the log that it is of, as the tables keep them."""

    sets: pl.DataFrame
    logs: pl.DataFrame

    @property
    def parameters(self) -> list[dict[str, Any]]:
        return list(self.sets["parameters"][0])


def real_set(folder: Path) -> Template:
    """Sail one zigzag, take its log in, identify it."""
    from kempf.flows.jobs.identify.identify_vessel import identify_vessel
    from kempf.flows.jobs.ingest.ingest_logs import ingest
    from kempf.pipeline.simulate.logger_profile import logger_profile
    from kempf.pipeline.simulate.mcap_log import to_mcap
    from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings

    settings = zigzag_settings("mariner", duration_s=400.0, seed=1)
    log = folder / "one.mcap"
    log.write_bytes(to_mcap(simulate_trial(settings)))
    warehouse = Warehouse(str(folder / "one"))
    ingest(warehouse, [log], given=logger_profile(settings))
    identify_vessel(warehouse, "mariner")
    return Template(delta.read(warehouse, "parameter_sets"), delta.read(warehouse, "logs"))


def copies(
    template: Template, vessel: str, count: int, random: np.random.Generator
) -> tuple[pl.DataFrame, pl.DataFrame]:
    """Return that many sets of a vessel and their logs: ids, instants and values of their own."""
    import pyarrow as pa

    ids = [sha256(f"{vessel} {i}".encode()).hexdigest() for i in range(count)]
    one, key = template.parameters, vessel_key(vessel)
    ingest = json.loads(template.sets["provenance_json"][0])["ingest_ids"][0]
    values = random.standard_normal((count, len(one))) * [p["std"] for p in one] + [p["value"] for p in one]
    stated = pa.StructArray.from_arrays(
        [
            pa.array([p["name"] for p in one] * count),
            pa.array(values.ravel()),
            pa.array([p["std"] for p in one] * count),
            pa.array([p["unit"] for p in one] * count),
        ],
        ["name", "value", "std", "unit"],
    )
    offsets = pa.array(np.arange(count + 1, dtype=np.int32) * len(one))
    own = pl.DataFrame(
        {
            "vessel_key": [key] * count,
            "vessel": [vessel] * count,
            "parameter_set_id": [f"ps-{name[:16]}" for name in ids],
            "start_utc_ns": [_START_NS + i * _DAY_NS for i in range(count)],
            "provenance_json": [template.sets["provenance_json"][0].replace(ingest, name[16:32]) for name in ids],
            "parameters": pl.from_arrow(pa.ListArray.from_arrays(offsets, stated)),
        }
    )
    of_vessels = own.select("vessel_key", "vessel").with_columns(
        log_id=pl.Series(ids), ingest_id=pl.Series([name[16:32] for name in ids])
    )
    return _filled(own, template.sets), _filled(of_vessels, template.logs)


def _filled(own: pl.DataFrame, template: pl.DataFrame) -> pl.DataFrame:
    rest = template.select([name for name in template.columns if name not in own.columns])
    return own.join(rest, how="cross").select(template.columns)


def fill(warehouse: Warehouse, template: Template, vessels: int, each: int) -> pl.DataFrame:
    """Put the sets of all vessels in, fifty vessels a commit; return the rows that a history of them all would have."""
    random, rows = np.random.default_rng(1946), []
    for first in range(0, vessels, 50):
        batch = [copies(template, f"vessel {v}", each, random) for v in range(first, min(vessels, first + 50))]
        for name, frames in (("logs", [b for _, b in batch]), ("parameter_sets", [a for a, _ in batch])):
            frame = pl.concat(frames)
            with delta.ensured(warehouse, name) as opened:
                delta.replace(opened, name, iter([frame]), one_of("vessel_key", frame["vessel_key"].unique().to_list()))
        rows.append(_long(pl.concat([a for a, _ in batch])))
    return pl.concat(rows)


def _long(sets: pl.DataFrame) -> pl.DataFrame:
    columns = ("vessel", "parameter_set_id", "start_utc_ns", "model_name", "estimator", "parameters")
    long = sets.select(columns).explode("parameters").unnest("parameters")
    return long.rename({"model_name": "model", "name": "parameter"})


def grow(warehouse: Warehouse, commits: int, vessels: int, seed: int = 7) -> list[float]:
    """Add sets and their logs one a commit, as single runs do; return how long each set took, s."""
    random, taken = np.random.default_rng(seed), []
    one = parameter_sets.get_all(warehouse, "vessel 0")[0]
    row = logs.all_ingests(warehouse, "vessel 0")[0]
    for i in range(commits):
        vessel = f"vessel {random.integers(vessels)}"
        name = sha256(f"later {seed} {i}".encode()).hexdigest()
        logs.record(warehouse, [replace(row, log_id=name, ingest_id=name[16:32], vessel=vessel)])
        provenance = {**one.provenance, "ingest_ids": [name[16:32]]}
        made = replace(one, parameter_set_id=f"ps-{name[:16]}", vessel=vessel, provenance=provenance)
        begin = perf_counter()
        parameter_sets.insert(warehouse, [made])
        taken.append(perf_counter() - begin)
    return taken


def ask(warehouse: Warehouse, vessels: int, times: int) -> dict[str, float]:
    """Ask for histories in this process, ms: the first, the medians of those that follow, and as of now.

    A busy machine lengthens the time on the clock; that of the processor, all threads together, is what an idle one
    would need at most.
    """

    def timed(vessel: int, as_of: datetime | None = None) -> tuple[float, float]:
        begin, worked = perf_counter(), process_time()
        history.of_vessel(warehouse, f"vessel {vessel % vessels}", as_of=as_of)
        return 1e3 * (perf_counter() - begin), 1e3 * (process_time() - worked)

    warehouse.exists()  # the libraries are imported before the clock runs
    pl.LazyFrame({"a": [1]}).filter(pl.col("a") == 1).collect()
    first = timed(17)
    then = [timed(37 * k) for k in range(times)]
    now = datetime.now(UTC)
    earlier = [timed(37 * k, now) for k in range(max(3, times // 5))]
    return {
        "first": first[0],
        "then": median(wall for wall, _ in then),
        "processor": median(cpu for _, cpu in then),
        "as of": median(wall for wall, _ in earlier),
    }


def _asked_anew(folder: Path, vessels: int, times: int) -> dict[str, float]:
    """Ask in a new process, of which the first question is counted apart."""
    command = [sys.executable, "-m", "benchmarks.fleet.history_speed", "--ask", str(folder)]
    command += ["--vessels", str(vessels), "--times", str(times)]
    where = Path(__file__).parents[2]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=where, env=dict(os.environ))
    output: dict[str, float] = json.loads(done.stdout)
    return output


def rivals(rows: pl.DataFrame, folder: Path) -> dict[str, Callable[[str], list[tuple[Any, ...]]]]:
    """Keep the same rows as a user would without Kempf; return what answers for one vessel."""
    rows.write_parquet(folder / "all.parquet")
    rows.write_csv(folder / "all.csv")
    base = sqlite3.connect(folder / "all.sqlite")
    base.execute(f"CREATE TABLE parameters (vessel, {', '.join(_ASKED)})")
    places = ", ".join("?" * (1 + len(_ASKED)))
    base.executemany(f"INSERT INTO parameters VALUES ({places})", rows.select("vessel", *_ASKED).iter_rows())  # noqa: S608
    base.execute("CREATE INDEX of_vessel ON parameters (vessel, start_utc_ns)")
    base.commit()

    def of(lazy: pl.LazyFrame, vessel: str) -> list[tuple[Any, ...]]:
        return lazy.filter(pl.col("vessel") == vessel).select(_ASKED).sort("start_utc_ns").collect().rows()

    question = f"SELECT {', '.join(_ASKED)} FROM parameters WHERE vessel = ? ORDER BY start_utc_ns"  # noqa: S608
    return {
        "SQLite, indexed by vessel": lambda vessel: base.execute(question, (vessel,)).fetchall(),
        "one Parquet file, polars": lambda vessel: of(pl.scan_parquet(folder / "all.parquet"), vessel),
        "one CSV file, polars": lambda vessel: of(pl.scan_csv(folder / "all.csv"), vessel),
    }


def beside(warehouse: Warehouse, rows: pl.DataFrame, folder: Path, vessels: int, times: int) -> dict[str, float]:
    """Time the rivals after they have given the very rows that the warehouse gives, ms of the processor."""
    taken = {}
    for name, answer in rivals(rows, folder).items():
        ours = history.of_vessel(warehouse, "vessel 3").frame.select(_ASKED).rows()
        if sorted(answer("vessel 3")) != sorted(ours):
            raise RuntimeError(f"{name} gives other rows")
        found = []
        for k in range(times):
            begin = process_time()
            answer(f"vessel {37 * k % vessels}")
            found.append(1e3 * (process_time() - begin))
        taken[name] = median(found)
    return taken


def _size_mb(folder: Path) -> float:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6


def measure(folder: Path, vessels: int, each: int, commits: int, times: int) -> tuple[list[list[str]], list[str]]:
    """Return the lines of the table of states and those behind it."""
    template, place = real_set(folder), folder / "warehouse"
    warehouse = Warehouse(str(place))
    rows = fill(warehouse, template, vessels, each)
    stated: list[list[str]] = []

    def state(what: str) -> dict[str, float]:
        found = _asked_anew(place, vessels, times)
        opened = delta.open_table(warehouse, "parameter_sets")
        assert opened is not None
        counted = [str(opened.version()), str(len(opened.file_uris())), f"{_size_mb(place):.0f}"]
        stated.append([what, *counted, *(f"{found[k]:.0f}" for k in ("first", "then", "processor", "as of"))])
        return found

    before = state("as filled")
    compared = beside(warehouse, rows, folder, vessels, times)
    ours = _asked_anew(place, vessels, times)["processor"]
    taken = grow(warehouse, commits, vessels)
    after = state(f"after {commits} sets more, one a commit")
    compaction.compact(warehouse)
    state("compacted")
    compaction.vacuum(warehouse, 0.0)
    last = state("vacuumed")
    tenth = max(1, commits // 10)
    worst = [max(one[k] for one in (before, after, last)) for k in ("then", "processor")]
    lines = [
        "",
        f"Slowest median: {worst[0]:.0f} ms on the clock, {worst[1]:.0f} ms of the processor (wanted: below "
        f"{TARGET_MS:g}). The first question of a process opens the tables, the others find them open.",
        "",
        f"A set a commit, {commits} times one after the other: median {1e3 * median(taken[:tenth]):.0f} ms of the "
        f"first tenth, {1e3 * median(taken[-tenth:]):.0f} ms of the last.",
        "",
        "What a user would pick instead, holding the same rows, as filled; none of these knows what was known at an "
        "earlier time, which sets are superseded, or where a value came from:",
        "",
        *table(
            ["instead", "ms of the processor", "its time / ours"],
            [[n, f"{t:.1f}", f"{t / ours:.2g}"] for n, t in compared.items()],
        ),
    ]
    return stated, [f"{rows.height} parameter rows of {vessels} vessels, {each} sets each.", *lines]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vessels", type=int, default=200)
    parser.add_argument("--sets", type=int, default=834, help="of each vessel")
    parser.add_argument("--commits", type=int, default=1000)
    parser.add_argument("--times", type=int, default=25)
    parser.add_argument("--ask", type=Path, metavar="WAREHOUSE", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.ask:
        print(json.dumps(ask(Warehouse(str(options.ask)), options.vessels, options.times)))
        return
    with TemporaryDirectory() as name:
        stated, (first, *rest) = measure(Path(name), options.vessels, options.sets, options.commits, options.times)
    head = [
        "state",
        "version",
        "files",
        "MB",
        "first question ms",
        "next, median ms",
        "of the processor ms",
        "as of a time ms",
    ]
    lines = [
        f"{first} History of one vessel, medians of {options.times} vessels in one process.",
        "",
        *table(head, stated),
    ]
    asked = f"--vessels {options.vessels} --sets {options.sets} --commits {options.commits}"
    path = write("fleet.history_speed", "The history of one vessel among many", [*lines, *rest], options=asked)
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
