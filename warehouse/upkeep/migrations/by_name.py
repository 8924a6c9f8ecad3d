"""Keeping the rows of a table under keys that a person can read: what `keys.vessel_key` returns now.

The first commit gives the column its new words and says which version is that of before; whoever opened the table
earlier cannot commit to it any more. Rows under keys of before are then exchanged for the same rows under the new ones,
some folders a commit, until none is left: a migration that was killed goes on with those that are. Each commit takes
out and puts in at once, and rests on the very version that was read, so that every version has every row once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from kempf.schemas.errors import KempfError
from kempf.schemas.tables import TABLES, arrow_schema
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import earlier_key, one_of, require_apart, vessel_key
from kempf.warehouse.storage.scan import by_file, scanned
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.upkeep.migrations import commits
from kempf.warehouse.upkeep.migrations.commits import MOST_ROWS, alone, batches, overtaken, version_said

if TYPE_CHECKING:
    import polars as pl
    from deltalake import DeltaTable

#: Folders of one commit.
MOST_FOLDERS = 256
_KEY = "vessel_key"


@dataclass(frozen=True)
class RowsOfBefore:
    """Rows that are under a key of before: those of one folder, or of a vessel in a table without folders."""

    key: str
    #: Of the folder; None in a table that has no folders by month.
    month: str | None
    rows: int


def tables() -> list[str]:
    """Return the names of the tables that have the column."""
    return [name for name, table in TABLES.items() if any(column.name == _KEY for column in table.columns)]


def missing(warehouse: Warehouse, name: str) -> list[RowsOfBefore]:
    """Return what is still under keys of before, by key and month.

    Parameters
    ----------
    warehouse : Warehouse
        Opened to be brought forward.
    name : str
        One of `tables`.
    """
    folders = [folder for folder in _held(delta.open_table(warehouse, name), name) if _is_earlier(folder.key)]
    return sorted(folders, key=lambda folder: (folder.key, folder.month or ""))


def require_known(warehouse: Warehouse) -> None:
    """Do nothing where every row is under the key of its own vessel, the one of before or of now.

    Raises
    ------
    KempfError
        ``vessel_key_unknown``: some are not.
    UsageError
        ``vessel_key_taken``: two names would have one key.
    """
    every: set[str] = set()
    for name in tables():
        every |= {vessel for _, vessel in _whose(warehouse, name)}
    require_apart([(vessel_key(vessel), vessel) for vessel in sorted(every)])


def carry_out(warehouse: Warehouse, name: str) -> Iterator[int]:
    """Put rows under the new keys; yields how many folders are done after every commit.

    Raises
    ------
    KempfError
        ``warehouse_busy``: another process committed to the table meanwhile; ``vessel_key_unknown``,
        ``table_damaged``, ``disk_full``, ...
    """
    table = delta.open_table(warehouse, name)
    if table is None:
        return
    before = version_said(table, delta.BROUGHT)
    if before is None:
        if _has_words(table, name) and not missing(warehouse, name):
            return  # made by this version
        before = table.version()
        with alone(name):
            commits.describe_alone(table, name, _KEY, before)
    todo = missing(warehouse, name)
    # after: of what is to be done the name is known
    names = {key: vessel for key, vessel in _whose(warehouse, name) if _is_earlier(key)}
    done = 0
    whole = not TABLES[name].partition_by
    # a table without folders is written as a whole
    for batch in [todo] if whole and todo else batches(todo, MOST_FOLDERS, MOST_ROWS):
        with delta.ensured(warehouse, name) as table:  # which has every column
            # read by another handle: a table cannot be asked while the library writes to it
            source = delta.open_table(warehouse, name, table.version())
            assert source is not None
            each = [where for folder in batch for where in _wheres(folder, names)]
            parts = [scanned(source, name)] if whole else [p for where in each for p in by_file(source, name, where)]
            predicate = None if whole else _predicate(batch, names)
            with alone(name):
                commits.exchange_alone(table, name, _frames(parts, names, ordered=whole), predicate, before)
        done += len(batch)
        yield done
    if missing(warehouse, name):  # of one that opened the table after its words were changed
        raise overtaken(name)


def require_same(warehouse: Warehouse, name: str) -> int:
    """Return how many vessels were compared: each has the same rows, but for the key, as before.

    Where another process committed in between, what was there then counts as before for what came after.

    Raises
    ------
    KempfError
        ``migration_differs``.
    """
    table = delta.open_table(warehouse, name)
    before = None if table is None else version_said(table, delta.BROUGHT)
    if table is None or before is None:
        return 0
    others = [entry["version"] for entry in table.history() if entry["version"] > before and delta.BROUGHT not in entry]
    compared = 0
    since = before
    for until in (*(version - 1 for version in sorted(others)), table.version()):
        compared = max(compared, _compare(warehouse, name, since, until))
        since = until + 1
    return compared


def _compare(warehouse: Warehouse, name: str, since: int, until: int) -> int:
    if since == until:
        return 0
    then, now = (commits.contents(warehouse, name, v, by="vessel", without=_KEY) for v in (since, until))
    differ = sorted(vessel for vessel in then.keys() | now.keys() if then.get(vessel) != now.get(vessel))
    if differ:
        raise commits.differs(name, since, ("vessels", "vessels"), differ, then, now)
    return len(then)


def _has_words(table: DeltaTable, name: str) -> bool:
    held = next(field.metadata for field in table.schema().fields if field.name == _KEY)
    return held == {k.decode(): v.decode() for k, v in arrow_schema(TABLES[name]).field(_KEY).metadata.items()}


def _is_earlier(key: str) -> bool:
    """Return whether a key is one of before: those of now have a hyphen before their hash."""
    return "-" not in key


def _held(table: DeltaTable | None, name: str) -> list[RowsOfBefore]:
    """Return what an open table holds, by folder, or by key where it has no folders."""
    import polars as pl

    if table is None or not table.file_uris():
        return []
    folders = table.metadata().partition_columns
    if _KEY not in folders:
        rows = scanned(table, name).group_by(_KEY).agg(pl.len()).collect(engine="streaming").rows()
        return [RowsOfBefore(str(key), None, count) for key, count in rows]
    files = pl.DataFrame(table.get_add_actions(flatten=True))
    month = pl.col("partition.month") if "month" in folders else pl.lit(None, dtype=pl.String)
    by = [pl.col(f"partition.{_KEY}").alias(_KEY), month.alias("month")]
    counts = files.group_by(by).agg(pl.col("num_records").sum()).rows()
    return [RowsOfBefore(str(key), month, int(count or 0)) for key, month, count in counts]


def _whose(warehouse: Warehouse, name: str) -> set[tuple[str, str]]:
    """Return the keys of a table and the names of their vessels, as its rows have them.

    Raises
    ------
    KempfError
        ``vessel_key_unknown``.
    """
    rows = scanned(delta.open_table(warehouse, name), name).select(_KEY, "vessel").unique()
    pairs = set(rows.collect(engine="streaming").rows())
    for key, vessel in sorted(pairs, key=repr):
        if not vessel or key not in (earlier_key(vessel), vessel_key(vessel)):
            raise KempfError(
                "vessel_key_unknown",
                f"The table {name} has rows of {vessel!r} under the key {key}, which is not hers: no version of kempf "
                "writes such rows.",
                "Nothing was changed. Delete them by the version that wrote them, or report it.",
                {"table": name, "vessel": vessel, "vessel_key": key},
            )
    return pairs


def _wheres(folder: RowsOfBefore, names: dict[str, str]) -> list[dict[str, str]]:
    """Return what is read of a folder: also what is under the new key already, as it is put in place of both."""
    month = {} if folder.month is None else {"month": folder.month}
    return [{_KEY: key, **month} for key in (folder.key, vessel_key(names[folder.key]))]


def _predicate(batch: Sequence[RowsOfBefore], names: dict[str, str]) -> str:
    """Return what names the rows of some folders, under either key."""
    months: dict[str, list[str]] = {}
    for folder in batch:
        months.setdefault(folder.key, []).extend([] if folder.month is None else [folder.month])
    each = []
    for key, held in months.items():
        either = one_of(_KEY, (key, vessel_key(names[key])))
        each.append(f"({either} AND {one_of('month', held)})" if held else either)
    return " OR ".join(each)


def _frames(parts: Sequence[pl.LazyFrame], names: dict[str, str], *, ordered: bool) -> Iterator[pl.DataFrame]:
    import polars as pl

    anew = pl.col(_KEY).replace({key: vessel_key(vessel) for key, vessel in names.items()})
    for rows in parts:
        keyed = rows.with_columns(anew)
        # so that a reader of one vessel skips the others
        keyed = keyed.sort(_KEY, maintain_order=True) if ordered else keyed
        yield from keyed.collect_batches(maintain_order=True)
