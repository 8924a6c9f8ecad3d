"""The job that makes again what is damaged in a warehouse, from sealed copies and from the raw logs.

Commits are put back from their copies. Data files that are not what was written are taken out of their table and kept
aside; what they held of logs is read again from the raw bytes, registers of logs and vessels are made again from what
is kept beside these. A table that is lost whole is made anew, and filled so. What people said (corrections, notes,
aliases) and parameter sets of earlier code cannot be made again, and are counted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from kempf.flows.jobs.repair.lost_rows import say_models, sets_lost
from kempf.flows.jobs.repair.repair_logs import missing_logs, read_again, take_in, unread_ingests
from kempf.flows.jobs.repair.repair_registers import put_receipts_back, register_profiles, remove_again
from kempf.flows.jobs.repair.repair_tables import make_table_anew, repair_table
from kempf.flows.jobs.repair.repaired import Repaired
from kempf.flows.process.progress import Progress, silent
from kempf.flows.process.wrap_error import wrapped
from kempf.schemas.errors import KempfError
from kempf.schemas.tables import TABLES
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels
from kempf.warehouse.tables.deposit import describe_all
from kempf.warehouse.upkeep.migrations.chain import MARKER_MENDED, repair_marker
from kempf.warehouse.upkeep.verify import UNFINISHED, verify


def repair(warehouse: Warehouse, progress: Progress = silent) -> Repaired:
    """Make again what is damaged, as far as it can be; a warehouse in which all is well is not touched.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    outcome = Repaired()
    if repair_marker(warehouse):
        outcome.done.append(MARKER_MENDED)
    warehouse.require()
    outcome.recall(warehouse)
    for name in TABLES:
        progress(0, 1, f"table {name}")
        try:
            if warehouse.folder is not None:
                repair_table(warehouse, warehouse.folder / name, name, outcome)
            if delta.is_gone(warehouse, name):
                make_table_anew(warehouse, name, outcome)
        except KempfError as error:  # the other tables are repaired all the same
            outcome.gone.append(f"the table {name}: {error.message}")
    put_receipts_back(warehouse, outcome)
    register_profiles(warehouse, outcome)
    remove_again(warehouse, outcome)
    missing, present = missing_logs(warehouse, outcome), vessels.profiles(warehouse)
    all_read = _each(warehouse, outcome, progress, missing, take_in, "log")
    if missing:
        # what was current stays so, also where a log was last read with an earlier profile
        vessels.register_all(warehouse, list(present.items()))
        register_profiles(warehouse, outcome)  # of those that were taken in again as removed ones
    unread = unread_ingests(warehouse, outcome, frozenset(missing))
    all_read &= _each(warehouse, outcome, progress, unread, read_again, "log of the ingest")
    describe_all(warehouse)
    if all_read:
        warehouse.delete(*UNFINISHED)
    outcome.left = verify(warehouse, lambda what: progress(0, 1, what))
    sets_lost(outcome)
    if outcome.names:
        say_models(warehouse, outcome)
    return outcome


def _each(
    warehouse: Warehouse,
    outcome: Repaired,
    progress: Progress,
    names: Sequence[str],
    repair_one: Callable[[Warehouse, str], str],
    noun: str,
) -> bool:
    """Repair logs one by one, one that cannot be stops no other; return whether all could be."""
    failed = 0
    for done, name in enumerate(names):
        progress(done, len(names), f"{noun} {name[:12]}")
        try:
            outcome.done.append(repair_one(warehouse, name))
        except Exception as error:  # noqa: BLE001 - whatever it is, the next log must not pay for it
            outcome.gone.append(f"the {noun} {name}: {wrapped(error).message}")
            failed += 1
    return not failed
