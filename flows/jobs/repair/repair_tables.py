"""Damaged files are taken out of their tables, and tables that are lost whole are made anew, without rows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from kempf.flows.jobs.repair.lost_rows import OF_LOGS, say_lost
from kempf.flows.jobs.repair.repaired import Repaired
from kempf.warehouse.storage import delta, seals
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.upkeep.verify import ASIDE


def repair_table(warehouse: Warehouse, folder: Path, name: str, outcome: Repaired) -> None:
    """Put the log of a table back, and take its damaged files out."""
    if not folder.is_dir():
        return
    outcome.done += seals.repair_log(folder, name)
    if not (folder / "_delta_log").is_dir() or delta.is_gone(warehouse, name):
        return
    table = delta.open_table(warehouse, name)
    if table is None:
        return
    live = {Path(path) for path in table.file_uris()}
    every = live | {path for path in folder.rglob("*.parquet") if folder / "_delta_log" not in path.parents}
    outcome.done += seals.repair_seals(folder, name, sorted(every))
    bad = [path for path in sorted(every) if _is_bad(folder, name, path, live)]
    rows = _rows_by_file(table)
    for path in bad:
        if path in live:
            # first: where it ends here, the next repair goes on
            _remember(warehouse, folder, path, name, outcome)
        _put_aside(warehouse, folder, path)
        if path in live:
            count = rows.get(path.name)
            amount = f"{count} rows" if count is not None else "rows"
            outcome.done.append(f"{name}/{path.relative_to(folder).as_posix()} was taken out of its table.")
            say_lost(f"{amount} of the table {name}", name, outcome)
        else:
            outcome.gone.append(
                f"what the table {name} held earlier in {path.name}; the newest version does not need it"
            )
    if any(path in live for path in bad):
        table.repair()
    seals.seal(table)


def make_table_anew(warehouse: Warehouse, name: str, outcome: Repaired) -> None:
    """Make a table that is lost whole, without rows; what logs gave of it is read again after."""
    outcome.registers |= name == "logs"
    if name in OF_LOGS:
        outcome.vessel_keys.add(None)
    if name in (*OF_LOGS, "logs"):
        outcome.keep_unfinished(warehouse)  # first, as with single files
    delta.make_anew(warehouse, name)
    outcome.done.append(f"The table {name} was gone, and was made anew.")
    say_lost(f"the table {name}", name, outcome)


def _remember(warehouse: Warehouse, folder: Path, path: Path, name: str, outcome: Repaired) -> None:
    """Note of whom a data file was, where the raw logs give it again, and keep that until it is done."""
    parts = dict(part.partition("=")[::2] for part in path.relative_to(folder).parts[:-1])
    if name == "logs":
        outcome.registers = True
    elif name not in OF_LOGS:
        return
    elif "month" in parts:
        outcome.months.add(f"{parts['vessel_key']} {parts['month']}")
    else:
        outcome.vessel_keys.add(parts.get("vessel_key"))
    outcome.keep_unfinished(warehouse)


def _is_bad(folder: Path, name: str, path: Path, live: set[Path]) -> bool:
    damage = seals.damage_of_file(folder, name, path)
    if damage is None and path in live:
        # not sealed, or the seal is that of a file that was cut off before it was sealed
        return not path.exists() or not _can_be_read(path)
    return damage is not None and damage.what != "seal" and (path in live or path.exists())


def _can_be_read(path: Path) -> bool:
    import polars as pl

    try:
        pl.read_parquet(path, glob=False, hive_partitioning=False)
    except Exception:  # noqa: BLE001 - whatever the reader says, it cannot
        return False
    return True


def _rows_by_file(table: Any) -> dict[str, int]:
    import polars as pl

    actions = pl.DataFrame(table.get_add_actions(flatten=True))
    return {str(path).rpartition("/")[2]: int(count) for path, count in actions.select("path", "num_records").rows()}


def _put_aside(warehouse: Warehouse, folder: Path, path: Path) -> None:
    seals.forget(folder, path)
    if path.exists():
        assert warehouse.folder is not None
        aside = warehouse.folder / ASIDE / folder.name
        aside.mkdir(parents=True, exist_ok=True)
        path.replace(aside / path.name)
