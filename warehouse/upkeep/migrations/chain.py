"""The steps from each layout to the next, in order, and the marker that says how far a warehouse is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from kempf.schemas.errors import KempfError
from kempf.schemas.tables import TABLES
from kempf.warehouse.storage import delta, written
from kempf.warehouse.storage.marker import LAYOUT, Marker
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.upkeep.migrations import by_name, commits, to_3, to_4
from kempf.warehouse.upkeep.verify import damages, unfinished


@dataclass(frozen=True)
class LayoutStep:
    """What brings a warehouse of one layout to the next."""

    #: to_do: What is to be done, a phrase each; carry_out: Does it, however far an earlier attempt came.
    to_do: Callable[[Warehouse], list[str]]
    carry_out: Callable[[Warehouse, commits.Look], list[str]]


#: By the layout that each begins with.
STEPS = {2: LayoutStep(to_3.to_do, to_3.carry_out), 3: LayoutStep(to_4.to_do, to_4.carry_out)}


def standing(warehouse: Warehouse) -> int:
    """Return the layout that a warehouse has to be brought forward from; `LAYOUT` where there is nothing to do.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    KempfError
        ``warehouse_layout``: it is newer; ``warehouse_marker_damaged``.
    """
    forward(warehouse).require()
    marker = warehouse.marker()
    assert marker is not None
    begun = marker.layout if marker.migrating is None else marker.migrating
    if begun != LAYOUT and begun not in STEPS:
        raise KempfError(
            "warehouse_layout_old",
            f"The warehouse {warehouse.uri} has layout {begun}, from which no step leads to layout {LAYOUT}.",
            "Bring it forward with an earlier version of kempf first.",
            {"found": begun, "expected": LAYOUT},
        )
    return begun


def forward(warehouse: Warehouse) -> Warehouse:
    """Return a warehouse opened to be brought forward."""
    return replace(warehouse, migrating=True)


def to_do(warehouse: Warehouse) -> list[str]:
    """Return what the steps have to do, a phrase each."""
    passing = forward(warehouse)
    return [words for begun in range(standing(warehouse), LAYOUT) for words in STEPS[begun].to_do(passing)]


def migrate(warehouse: Warehouse, look: commits.Look) -> list[str]:
    """Bring a warehouse to the layout of this version, a step after the other; one that was killed goes on.

    Returns
    -------
    list of str
        What was compared, a sentence each.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    KempfError
        ``warehouse_damaged``, ``vessel_key_unknown``: something has to be repaired first, nothing was changed;
        ``warehouse_busy``, ``migration_differs``.
    UsageError
        ``vessel_key_taken``: two names would have one key; nothing was changed.
    """
    sentences: list[str] = []
    passing = forward(warehouse)
    while (begun := standing(warehouse)) != LAYOUT:
        marker = passing.marker()
        if marker == Marker(begun):
            _require_whole(passing, look)
            by_name.require_known(passing)
        if marker != Marker(LAYOUT, migrating=begun):
            # first, so that versions that would write as before, or had begun this, find a newer layout from here on
            passing.mark(Marker(LAYOUT, migrating=begun))
        sentences += STEPS[begun].carry_out(passing, look)
        _note_tables(passing)
        passing.mark(Marker(LAYOUT) if begun + 1 == LAYOUT else Marker(LAYOUT, migrating=begun + 1))
    return sentences


def _note_tables(warehouse: Warehouse) -> None:
    """Keep of every table that is there that it was written, as earlier layouts did not."""
    for name in TABLES:
        if delta.open_table(warehouse, name) is not None:
            written.note(warehouse, name)


def _require_whole(warehouse: Warehouse, look: commits.Look) -> None:
    problems = list(unfinished(warehouse))
    for name in TABLES:
        look(0, 1, f"table {name}")
        problems += [problem for problem in damages(warehouse, name) if not problem.past]
    if problems:
        raise KempfError(
            "warehouse_damaged",
            f"The warehouse {warehouse.uri} cannot be brought forward: {len(problems)} problems, the first: "
            f"{problems[0].words}",
            "Repair it with the version of kempf that wrote it: `kempf repair`; nothing was changed.",
            {"problems": [problem.as_json() for problem in problems]},
        )


#: what is said where the marker was mended
MARKER_MENDED = "The file that marks the warehouse was written anew."


def repair_marker(warehouse: Warehouse) -> bool:
    """Write the marker anew where it is damaged, or where there are tables and no marker; return whether it was.

    A warehouse of another layout stays as it is. The tables tell which layout they have; where they have an earlier
    one, `kempf migrate` goes on from there.
    """
    try:
        marker = warehouse.marker()
    except KempfError as error:
        if error.code != "warehouse_marker_damaged":
            raise
    else:
        if marker is not None or not _has_tables(warehouse):
            return False
    passing = forward(warehouse)
    # the earliest first: to look into the tables it has to be there
    passing.mark(Marker(LAYOUT, migrating=min(STEPS)))
    if to_3.holds(passing):
        passing.mark(Marker(LAYOUT) if to_4.holds(passing) else Marker(LAYOUT, migrating=3))
    return True


def _has_tables(warehouse: Warehouse) -> bool:
    return warehouse.folder is not None and (warehouse.folder / "logs" / "_delta_log").is_dir()
