"""What one commit costs against the number of vessels in the table, for `fleet`.

The table of parameter sets has a folder a vessel, so that it has no fewer files than there are vessels, also after
`compact`. It is filled with copies of one real set, one a vessel; then sets are added as the flows add them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from statistics import median
from time import perf_counter, process_time
from typing import Any, Protocol

import numpy as np
import polars as pl

from benchmarks.fleet.history_speed import Template, copies, real_set
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import one_of
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets
from kempf.warehouse.tables.parameter_set import ParameterSet

TABLE = "parameter_sets"
#: Vessels that share a commit where it is not of one: somewhat more than a batch has, of vessels with some logs each.
TOGETHER = 20
#: Commits whose median counts, and commits shared by all writers of one trial.
TIMES, SHARED = 7, 12
WRITERS = (1, 2, 4)
_A_FILL = 500


class _New(Protocol):
    def __call__(self, vessels: int, writer: int = 0, writers: int = 1) -> list[ParameterSet]: ...


def measure(folder: Path, sizes: Sequence[int]) -> dict[str, Any]:
    """Measure commits to a table of each number of vessels, in warehouses in a folder."""
    folder.mkdir()
    template = real_set(folder)
    found = []
    for n in sorted(set(sizes)):
        found.append(at(Warehouse(str(folder / f"of{n}")), template, n))
        print(f"{n} vessels: a commit {found[-1]['one']['cpu_s']:.3f} s of the processor", flush=True)
    return {"table": TABLE, "together": TOGETHER, "times": TIMES, "shared": SHARED, "sizes": found}


def at(warehouse: Warehouse, template: Template, n: int) -> dict[str, Any]:
    """Fill the table of a warehouse, in a folder or a bucket, with ``n`` vessels and measure commits to it.

    Returns
    -------
    dict
        ``vessels``, ``files``; ``one`` and ``together``: seconds on the clock and of the processor, all threads
        together, of a commit of one vessel and of `TOGETHER`; ``read``: of reading the sets of one vessel;
        ``writers``: commits of `TOGETHER` vessels a second by several writers at once, by their number, and what each
        takes of the processor.
    """
    if n < TOGETHER:
        raise ValueError(f"{n} vessels: {TOGETHER} of them share a commit.")
    fill(warehouse, template, n)
    filled = delta.open_table(warehouse, TABLE)
    assert filled is not None
    new = _sets(parameter_sets.get_all(warehouse, "vessel 0")[0], n)

    def timed(vessels: int) -> dict[str, float]:
        found = []
        for _ in range(1 + TIMES):
            found.append(_timed(partial(parameter_sets.insert, warehouse, new(vessels))))
            _take_back(warehouse, n, filled.version())
        return _medians(found)

    asked = [f"vessel {37 * k % n}" for k in range(1 + TIMES)]
    return {
        "vessels": n,
        "files": len(filled.file_uris()),
        "read": _medians([_timed(partial(parameter_sets.get_all, warehouse, names)) for names in asked]),
        "one": timed(1),
        "together": timed(TOGETHER),
        "writers": {str(k): _at_once(warehouse, new, n, filled.version(), k) for k in WRITERS if k * TOGETHER <= n},
    }


def fill(warehouse: Warehouse, template: Template, n: int) -> None:
    """Put one set of each of ``n`` vessels in, one file a vessel."""
    random = np.random.default_rng(1946)
    for first in range(0, n, _A_FILL):  # a writer of that many folders at once takes about a megabyte for each
        rows = pl.concat([copies(template, f"vessel {v}", 1, random)[0] for v in range(first, min(n, first + _A_FILL))])
        with delta.ensured(warehouse, TABLE) as table:
            delta.replace(table, TABLE, iter([rows]), one_of("vessel_key", rows["vessel_key"].to_list()))


def _sets(one: ParameterSet, n: int) -> _New:
    """Give a function that makes new sets of some vessels; each of several writers has vessels of its own."""
    numbers = count()

    def new(vessels: int, writer: int = 0, writers: int = 1) -> list[ParameterSet]:
        number, share = next(numbers), n // writers
        names = [writer * share + (number * TOGETHER + v) % share for v in range(vessels)]
        return [replace(one, parameter_set_id=f"ps-{number:08x}{v:08x}", vessel=f"vessel {v}") for v in names]

    return new


def _timed(action: Callable[[], object]) -> tuple[float, float]:
    """Return the seconds on the clock and of the processor."""
    begun, worked = perf_counter(), process_time()
    assert action()
    return perf_counter() - begun, process_time() - worked


def _medians(found: Sequence[tuple[float, float]]) -> dict[str, float]:
    wall, cpu = zip(*found[1:], strict=True)  # the first one opens the table
    return {"wall_s": median(wall), "cpu_s": median(cpu)}


def _take_back(warehouse: Warehouse, n: int, version: int) -> None:
    """Take commits back before a small table is a good deal larger than it was filled."""
    table = delta.open_table(warehouse, TABLE)
    assert table is not None
    if len(table.file_uris()) > 1.05 * n:
        table.restore(version)


def _at_once(warehouse: Warehouse, new: _New, n: int, version: int, n_writers: int) -> dict[str, float]:
    """Return commits a second of several writers together, and what each took of the processor, s."""
    work = [[new(TOGETHER, writer, n_writers) for _ in range(SHARED // n_writers)] for writer in range(n_writers)]

    def write(batches: list[list[ParameterSet]]) -> None:
        for batch in batches:
            parameter_sets.insert(warehouse, batch)

    begun, worked = perf_counter(), process_time()
    with ThreadPoolExecutor(n_writers) as pool:
        list(pool.map(write, work))
    took, cpu, n_commits = perf_counter() - begun, process_time() - worked, sum(map(len, work))
    _take_back(warehouse, n, version)
    return {"a_second": n_commits / took, "cpu_s": cpu / n_commits}
