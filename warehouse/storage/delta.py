"""The one place that speaks to Delta Lake: opening, reading and replacing rows of a table.

Every change is one commit of `replace`: rows that a predicate names are exchanged for others, on the version that was
read. A commit that meanwhile touched what the predicate names makes it fail, so that read, decide, write is one step
under `retry.with_retry`. (Merges lose the units in the field metadata; blind appends see no conflict.)
"""

from __future__ import annotations

import logging
import os
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from itertools import accumulate
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from kempf.schemas.errors import KempfError, NotFound
from kempf.schemas.tables import TABLES, arrow_schema
from kempf.warehouse.storage import seals, table_cache, written
from kempf.warehouse.storage.scan import Where, scanned
from kempf.warehouse.storage.store import Warehouse, not_writable

if TYPE_CHECKING:
    import polars as pl
    import pyarrow as pa
    from deltalake import DeltaTable

# One thread moves the rows of a write on: with more, those that read ahead outrun the one that packs, and a log of
# gigabytes piles up between them. Packing is done by that one alone in any case. Asked for when the library starts.
os.environ.setdefault("TOKIO_WORKER_THREADS", "1")

_log = logging.getLogger("kempf.warehouse")

#: Rows that are handed to the writer at once; it holds some ten such batches.
_BATCH_ROWS = 16_384

#: Rows that are skipped or read together, of tables in which one vessel is looked for among all.
ROW_GROUP = 8192
#: attribute of a handle: that its table was written is kept beside the tables
_NOTED = "kempf_noted"
#: What commits that bring a table to a later layout say of themselves: the version before the first of them.
BROUGHT = "kempf_brought_from"

#: The past is kept: history as of a time and reruns read old versions.
_CONFIGURATION = {
    "delta.logRetentionDuration": "interval 36500 days",
    "delta.deletedFileRetentionDuration": "interval 36500 days",
    "delta.enableExpiredLogCleanup": "false",
}


def open_table(warehouse: Warehouse, name: str, version: int | None = None) -> DeltaTable | None:
    """Open a table for reading, None where it was never written.

    Parameters
    ----------
    warehouse : Warehouse
        Where it is.
    name : str
        Key of `kempf.schemas.tables.TABLES`.
    version : int, optional
        Version to pin; the newest by default.

    Raises
    ------
    NotFound
        ``no_table_version``: the table has no such version.
    KempfError
        ``table_unreadable``: its log or its storage is damaged; ``table_damaged``: so are its files, or it was written
        and is lost whole.
    """
    table = _opened(warehouse, name, version)
    if table is None and written.is_noted(warehouse, name):
        table = _opened(warehouse, name, version)  # where another writer made it between the two looks
        if table is None:
            raise _gone(name)
    return table


def is_gone(warehouse: Warehouse, name: str) -> bool:
    """Return whether a table was written and is lost whole; not where it cannot be opened for another reason."""
    try:
        open_table(warehouse, name)
    except KempfError as error:
        return error.code == "table_damaged" and error.details.get("what") == "table"
    return False


def _gone(name: str) -> KempfError:
    return KempfError(
        "table_damaged",
        f"The table {name} is gone: it was written, and its folder or its log is not there any more.",
        "See with `kempf verify` what else is damaged and lost; `kempf repair` makes again what can be made.",
        {"table": name, "path": name, "what": "table"},
    )


def _opened(warehouse: Warehouse, name: str, version: int | None) -> DeltaTable | None:
    from deltalake import DeltaTable
    from deltalake.exceptions import DeltaError, TableNotFoundError

    class _Table(DeltaTable):
        """A table whose files polars finds also where the folder's path holds blanks or letters beyond ASCII."""

        def file_uris(self, *args: Any, **kwargs: Any) -> list[str]:
            uris = super().file_uris(*args, **kwargs)
            return [unquote(uri) for uri in uris] if warehouse.folder is not None else uris

    address = warehouse.address(name)
    if warehouse.folder is not None and not (warehouse.folder / name / "_delta_log").is_dir():
        return None
    try:
        table = _Table(address, version=version, storage_options=warehouse.options)
    except TableNotFoundError:
        # no version asked for: where another writer makes it at this moment, the caller comes again
        newest = None if version is None else _newest(warehouse, name)
        if newest is None:
            return None
        raise _no_version(name, version, newest) from None
    except (DeltaError, OSError, ValueError) as error:
        warehouse.reach()
        newest = None if version is None else _newest(warehouse, name)
        if version is not None and newest is not None and not 0 <= version <= newest:
            raise _no_version(name, version, newest) from error
        _name_damage(warehouse, name)
        raise KempfError(
            "table_unreadable",
            f"The table {name} of {warehouse.uri} cannot be opened: {_first_line(error)}",
            "See with `kempf verify` what is damaged; `kempf repair` makes again what can be made.",
            {"table": name, "version": version},
        ) from error
    seals.compare_log(table, name)
    return table


def _first_line(error: BaseException) -> str:
    """Return what a library says of an error, without where in the library it was."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0].rstrip(".") + "."


def _name_damage(warehouse: Warehouse, name: str) -> None:
    """Raise the error of the first commit of a table that is not what was written, where its seals know of one."""
    if warehouse.folder is None:
        return
    folder = warehouse.folder / name
    newest = max(seals.sealed_versions(folder), default=-1)
    for damage in seals.damages_of_log(folder, name, newest):
        if damage.what != "seal":
            raise damage.error()


def _newest(warehouse: Warehouse, name: str) -> int | None:
    from deltalake import DeltaTable
    from deltalake.exceptions import DeltaError

    try:
        return DeltaTable(warehouse.address(name), storage_options=warehouse.options).version()
    except (DeltaError, OSError, ValueError):
        return None


def _no_version(name: str, version: int | None, newest: int) -> NotFound:
    return NotFound(
        "no_table_version",
        f"The table {name} has versions 0 to {newest}; version {version} is not among them.",
        f"Ask for one of 0 to {newest}.",
        {"table": name, "version": version, "newest": newest},
    )


def ensure_table(warehouse: Warehouse, name: str) -> DeltaTable:
    """Open a table for writing; make it, and the warehouse, where they are not there."""
    table = open_table(warehouse, name)
    return table if table is not None else _made(warehouse, name)


def make_anew(warehouse: Warehouse, name: str) -> None:
    """Make a table that is lost whole, without rows."""
    written.note_anew(warehouse, name)
    _made(warehouse, name)


def _made(warehouse: Warehouse, name: str) -> DeltaTable:
    from deltalake import DeltaTable
    from deltalake.exceptions import DeltaError

    warehouse.create()
    with refusals_as_errors(warehouse.address(name)):
        try:
            DeltaTable.create(
                warehouse.address(name),
                schema=arrow_schema(TABLES[name]),
                mode="ignore",
                partition_by=list(TABLES[name].partition_by) or None,
                configuration=_CONFIGURATION,
                storage_options=warehouse.options,
            )
        except DeltaError:  # another writer made it at the same moment
            if open_table(warehouse, name) is None:
                warehouse.reach()
                raise
    made = open_table(warehouse, name)
    assert made is not None
    seals.seal(made)
    return made


@contextmanager
def ensured(warehouse: Warehouse, name: str) -> Iterator[DeltaTable]:
    """Lend a table for reading, deciding and writing; it is made, and the warehouse too, where it is not there.

    What was lent is not to be used after, nor by another thread. One over which something else than a lost race went
    wrong is opened anew the next time.
    """
    with table_cache.borrowed(warehouse, name, ensure_table) as table:
        assert table is not None
        seals.compare_log(table, name)
        if _NOTED not in vars(table):
            written.note(warehouse, name)
            vars(table)[_NOTED] = True
        # here, and not where it is opened: a handle that was lent for reading before may lack columns too
        yield _with_every_column(warehouse, table, name)


def _with_every_column(warehouse: Warehouse, table: DeltaTable, name: str) -> DeltaTable:
    """Add the columns that a table from before they were known lacks; its rows have nothing there."""
    from deltalake import Schema

    held = {field.name for field in table.schema().fields}
    fields = Schema.from_arrow(arrow_schema(TABLES[name])).fields
    missing = [field for field in fields if field.name not in held]
    if not missing:
        return table
    with refusals_as_errors(warehouse.address(name)):
        table.alter.add_columns(missing)
    altered = open_table(warehouse, name)
    assert altered is not None
    seals.seal(altered)
    return altered


def read(
    warehouse: Warehouse, name: str, where: Where | None = None, columns: Sequence[str] = (), version: int | None = None
) -> pl.DataFrame:
    """Return rows of a table, none where it was never written.

    Parameters
    ----------
    warehouse : Warehouse
        Where it is.
    name : str
        Key of `kempf.schemas.tables.TABLES`.
    where : mapping of str to str or list of str, optional
        Only rows whose column has that value, or one of those.
    columns : sequence of str, optional
        Only these columns; all by default.
    version : int, optional
        Version to pin; the newest by default.

    Returns
    -------
    polars.DataFrame
        The order of the rows is not defined: sort them.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_table_version``.
    KempfError
        ``table_unreadable``.
    """
    with lent(warehouse, name, where, version) as lazy:
        return (lazy.select(columns) if columns else lazy).collect()


def distinct(warehouse: Warehouse, name: str, column: str) -> set[str]:
    """Return the values that a column of a table has; of a large one they alone are held.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    KempfError
        ``table_unreadable``.
    """
    with lent(warehouse, name) as lazy:
        return set(lazy.select(column).unique().collect()[column].to_list())


@contextmanager
def reading(warehouse: Warehouse, name: str, version: int | None = None) -> Iterator[DeltaTable | None]:
    """Lend a table for reading, as `open_table` opens it; what was lent is not to be used after, and not to be written.

    Raises
    ------
    NotFound
        ``no_table_version``.
    KempfError
        ``table_unreadable``.
    """
    with table_cache.borrowed(warehouse, name, open_table) as table:
        if version is None or (table is not None and table.version() == version):
            if table is not None:
                seals.compare_log(table, name)
            yield table
            return
    yield open_table(warehouse, name, version)


@contextmanager
def lent(
    warehouse: Warehouse, name: str, where: Where | None = None, version: int | None = None
) -> Iterator[pl.LazyFrame]:
    """Lend rows of a table that are not read yet, for those who want some columns; not to be used after the ``with``.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_table_version``.
    KempfError
        ``table_unreadable``.
    """
    warehouse.require()
    try:
        with _unreadable_as_error(name), reading(warehouse, name, version) as table:
            yield scanned(table, name, where)
    except KempfError:
        warehouse.reach()  # a bucket that does not answer leaves the tables as they are: no copy need be restored
        raise


def rows(table: DeltaTable | None, name: str, where: Where | None = None, columns: Sequence[str] = ()) -> pl.DataFrame:
    """Return rows of an open table, see `read`."""
    lazy = scanned(table, name, where)
    with _unreadable_as_error(name):
        return (lazy.select(columns) if columns else lazy).collect()


@contextmanager
def _unreadable_as_error(name: str) -> Iterator[None]:
    import polars as pl

    try:
        yield
    except (OSError, pl.exceptions.ComputeError, pl.exceptions.PanicException) as error:
        raise KempfError(
            "table_unreadable",
            f"A file of the table {name} cannot be read: {_first_line(error)}",
            "See with `kempf verify` what is damaged; `kempf repair` makes again what can be made.",
            {"table": name},
        ) from error


def replace(
    table: DeltaTable, name: str, new: Sequence[dict[str, Any]] | Iterator[pl.DataFrame], predicate: str
) -> None:
    """Exchange the rows that ``predicate`` names for ``new``, in one commit on the version that is open.

    Parameters
    ----------
    table : DeltaTable
        Lent by `ensured`; what was read from it is what the commit rests on.
    name : str
        Its name.
    new : sequence of dict, or iterator of polars.DataFrame
        New rows, with every column of the table; frames are written one after the other. All satisfy the predicate.
    predicate : str
        SQL; texts in it through `kempf.warehouse.storage.keys.quoted`.

    Raises
    ------
    deltalake.exceptions.CommitFailedError
        Another writer changed what the predicate names: read again, see `kempf.warehouse.storage.retry.with_retry`.
    KempfError
        ``disk_full``, ``warehouse_not_writable``.
    """
    import pyarrow as pa
    from deltalake import WriterProperties, write_deltalake

    schema = as_described(table, arrow_schema(TABLES[name]))
    if isinstance(new, Sequence):
        data = pa.Table.from_pylist(list(new), schema=schema)
    else:
        data = pa.RecordBatchReader.from_batches(schema, batches(new, schema))
    with refusals_as_errors(table.table_uri):
        write_deltalake(
            table,
            data,
            mode="overwrite",
            predicate=predicate,
            writer_properties=WriterProperties(compression="ZSTD"),
        )
        seals.seal(table)
    _log.debug("table %s: version %d is committed", name, table.version())


def as_described(table: DeltaTable, schema: pa.Schema) -> pa.Schema:
    """Return a schema with the units and words that a table has: other words than its own no table takes."""
    import pyarrow as pa

    held = {field.name: field.metadata for field in table.schema().fields}
    return pa.schema([field.with_metadata(held.get(field.name, field.metadata)) for field in schema])


def batches(frames: Iterator[pl.DataFrame], schema: pa.Schema) -> Iterator[pa.RecordBatch]:
    """Yield rows as the writer takes them, some at a time."""
    import polars as pl

    for frame in frames:
        for some in frame.select(schema.names).iter_slices(_BATCH_ROWS):
            yield from some.to_arrow(compat_level=pl.CompatLevel.oldest()).cast(schema).to_batches()


#: what a system says of a disk that takes nothing
_REFUSED = ("read-only file system", "permission denied", "input/output error")


@contextmanager
def refusals_as_errors(address: str) -> Iterator[None]:
    """Raise what the storage refuses while something is written to an address as one clear error.

    Raises
    ------
    deltalake.exceptions.CommitFailedError
        A lost race, as it is.
    KempfError
        ``disk_full``, ``warehouse_not_writable``.
    """
    from deltalake.exceptions import CommitFailedError, DeltaError

    try:
        yield
    except OSError as error:
        raise not_writable(address, error) from error
    except DeltaError as error:
        refusal = not_writable(address, error)
        # a commit that the disk has no room for, or that it refuses, is no lost race: trying it again would not help
        if refusal.code == "disk_full" or any(words in str(error).lower() for words in _REFUSED):
            raise refusal from error
        # on a disk the rest is no matter of the connection
        if isinstance(error, CommitFailedError) or "://" not in address.removeprefix("file://"):
            raise
        raise refusal from error


def versions(warehouse: Warehouse) -> dict[str, int]:
    """Return the newest version of every table that was written, for the provenance of what is made from them."""
    newest = {}
    for name in TABLES:
        with reading(warehouse, name) as table:
            if table is not None:
                newest[name] = table.version()
    return newest


def commit_times(table: DeltaTable) -> list[int]:
    """Return the time of every commit of an open table, ms since 1970, by version.

    Times are those written into the commits, which copying a warehouse keeps; where clocks of two writers disagree a
    version counts as no older than the one before it.

    Parameters
    ----------
    table : DeltaTable
        Open; commits that it knows from an earlier call are not read again.
    """
    known: list[int] = vars(table).setdefault("kempf_commit_times", [])
    missing = table.version() + 1 - len(known)
    if missing > 0:
        # the newest first, and before them those of other writers since the table was opened; these are numbered as if
        # they were this table's, which makes the numbers wrong: counted from the oldest they are right
        times = [int(entry["timestamp"]) for entry in table.history(missing)][::-1]
        known += times[:missing]
    return list(accumulate(known, max))


def version_as_of(warehouse: Warehouse, name: str, instant: datetime) -> int | None:
    """Return the newest version of a table that was committed by ``instant``; None before the first.

    Times are those of `commit_times`.
    """
    with reading(warehouse, name) as table:
        if table is None:
            return None
        commits = commit_times(table)
    limit_ms = instant.astimezone(UTC).timestamp() * 1000.0
    # they never decrease
    return bisect_right(commits, limit_ms) - 1 if commits and commits[0] <= limit_ms else None
