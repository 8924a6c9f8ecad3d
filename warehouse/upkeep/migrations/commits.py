"""What the commits of every migration share: how much one holds, that nobody comes in between, where it began.

Also what is compared of a table before and after.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from kempf.schemas.errors import KempfError
from kempf.schemas.tables import TABLES, arrow_schema
from kempf.warehouse.storage import delta, seals
from kempf.warehouse.storage.scan import scanned
from kempf.warehouse.storage.store import Warehouse

if TYPE_CHECKING:
    import polars as pl
    import pyarrow as pa
    from deltalake import DeltaTable

#: Takes how much of how much is done, and what is done next.
Look = Callable[[int, int, str], None]
#: By ingest or vessel: rows, and two sums of hashes of their content.
Contents = Mapping[str, tuple[int, int, int]]
#: Rows of one commit: what a writer holds at a time.
MOST_ROWS = 4_000_000


class Counted(Protocol):
    """A piece of a table whose rows are counted."""

    @property
    def rows(self) -> int:
        """How many it has."""


Piece = TypeVar("Piece", bound=Counted)


def batches(todo: Sequence[Piece], most: int, most_rows: int) -> Iterator[list[Piece]]:
    """Yield pieces that are written together, in order.

    Parameters
    ----------
    most, most_rows : int
        Pieces, and rows of several of them, of one commit.
    """
    batch: list[Piece] = []
    for piece in todo:
        if batch and (len(batch) == most or sum(b.rows for b in batch) + piece.rows > most_rows):
            yield batch
            batch = []
        batch.append(piece)
    if batch:
        yield batch


class OfTable(Protocol):
    """What brings one table forward, such as `kempf.warehouse.upkeep.migrations.by_month`."""

    @property
    def missing(self) -> Callable[[Warehouse, str], Sequence[Counted]]:
        """Returns what is still to be done."""

    @property
    def carry_out(self) -> Callable[[Warehouse, str], Iterator[int]]:
        """Does it; yields how many pieces are done after every commit."""

    @property
    def require_same(self) -> Callable[[Warehouse, str], int]:
        """Compares the rows with those of before, and returns how many parts were compared."""


def carry_out(warehouse: Warehouse, names: Sequence[str], how: OfTable, look: Look) -> dict[str, int]:
    """Bring some tables forward, each compared with what it was.

    Returns
    -------
    dict of str to int
        By table, how many parts were compared; those of which none were are left out.
    """
    compared = {}
    for name in names:
        total = len(how.missing(warehouse, name))
        look(0, max(total, 1), name)
        for done in how.carry_out(warehouse, name):
            look(done, total, name)
        look(0, 1, f"{name}, compared")
        compared[name] = how.require_same(warehouse, name)
    return {name: count for name, count in compared.items() if count}


@contextmanager
def alone(name: str) -> Iterator[None]:
    """Say which table another process committed to, where it did so in between."""
    from deltalake.exceptions import CommitFailedError

    try:
        yield
    except CommitFailedError as error:
        raise overtaken(name) from error


def overtaken(name: str) -> KempfError:
    """Return the error of a table that another process committed to."""
    return KempfError(
        "warehouse_busy",
        f"Another process committed to the table {name} meanwhile.",
        "End whatever else works on the warehouse, then run `kempf migrate` again: it goes on, and nothing is lost.",
        {"table": name},
    )


def version_said(table: DeltaTable, key: str) -> int | None:
    """Return the version that the newest commit which says one says under a key; None where none does."""
    versions = (entry.get(key) for entry in table.history())
    return next((int(version) for version in versions if version is not None), None)


def contents(warehouse: Warehouse, name: str, version: int | None, *, by: str, without: str) -> Contents:
    """Return of every ingest or vessel in a version of a table how many rows it has, and sums of their hashes.

    The sums depend neither on the order of the rows nor on the column that is left out.

    Parameters
    ----------
    name : str
        Of the table.
    version : int or None
        None for the newest one.
    by, without : str
        The column of ingests or vessels, and the one that the migration changes.
    """
    import polars as pl

    row = pl.struct([column.name for column in TABLES[name].columns if column.name != without])
    hashed = scanned(delta.open_table(warehouse, name, version), name).select(by, one=row.hash(1), other=row.hash(2))
    sums = hashed.group_by(by).agg(pl.len(), pl.col("one", "other").sum()).collect(engine="streaming")
    return {key: (count, one, other) for key, count, one, other in sums.iter_rows()}


def differs(
    name: str, version: int, kind: tuple[str, str], differ: Sequence[str], then: Contents, now: Contents
) -> KempfError:
    """Return the error of a table that says something else than before.

    Parameters
    ----------
    name, version : str, int
        The table, and its version of before.
    kind : (str, str)
        What was compared, in words and as a key of the error's details.
    differ : sequence of str
        Which of them differ, at least one.
    then, now : mapping
        See `contents`.
    """
    had, has = (sums.get(differ[0], (0, 0, 0))[0] for sums in (then, now))
    return KempfError(
        "migration_differs",
        f"Of {len(then)} {kind[0]} in the table {name} {len(differ)} have other rows than before, the first "
        f"{differ[0]!r}: {had} rows before, {has} now.",
        f"Nothing of before was deleted: it is version {version} of the table. Report it, and leave the warehouse "
        "as it is.",
        {"table": name, "version": version, kind[1]: list(differ)},
    )


def append_alone(
    table: DeltaTable, name: str, new: Iterator[pl.DataFrame], lay_out: Mapping[str, Any] | None = None
) -> None:
    """Add rows in one commit on the very version that is open, or fail: no commit of another process is passed over.

    Parameters
    ----------
    table : DeltaTable
        From `open_table`.
    name : str
        Its name.
    new : iterator of polars.DataFrame
        New rows, with every column of the table.
    lay_out : mapping, optional
        Take all rows of before out and give the table the columns and folders that it has in
        `kempf.schemas.tables.TABLES`; this is what the commit says of itself.

    Raises
    ------
    deltalake.exceptions.CommitFailedError
        Another process committed since the table was opened.
    KempfError
        ``disk_full``, ``warehouse_not_writable``.
    """
    schema = arrow_schema(TABLES[name])
    schema = schema if lay_out is not None else delta.as_described(table, schema)
    anew: dict[str, Any] = {"mode": "append"}
    if lay_out is not None:
        folders = list(TABLES[name].partition_by)
        anew = {"mode": "overwrite", "schema_mode": "overwrite", "partition_by": folders}
    _write_alone(table, new, schema, lay_out, **anew)


def exchange_alone(
    table: DeltaTable, name: str, new: Iterator[pl.DataFrame], predicate: str | None, brought_from: int
) -> None:
    """Exchange rows in one commit on the very version that is open, or fail, as `append_alone` does.

    Parameters
    ----------
    table : DeltaTable
        From `open_table`.
    name : str
        Its name.
    new : iterator of polars.DataFrame
        New rows, with every column of the table. All satisfy the predicate.
    predicate : str or None
        Of the rows that go, as `kempf.warehouse.storage.delta.replace` takes it; None stands for all of them.
    brought_from : int
        What the commit says under `delta.BROUGHT`.

    Raises
    ------
    deltalake.exceptions.CommitFailedError
        Another process committed since the table was opened.
    KempfError
        ``disk_full``, ``warehouse_not_writable``.
    """
    schema = delta.as_described(table, arrow_schema(TABLES[name]))
    metadata = {delta.BROUGHT: str(brought_from)}
    _write_alone(table, new, schema, metadata, mode="overwrite", predicate=predicate)


def _write_alone(
    table: DeltaTable, new: Iterator[pl.DataFrame], schema: pa.Schema, metadata: Mapping[str, Any] | None, **how: Any
) -> None:
    import pyarrow as pa
    from deltalake import CommitProperties, WriterProperties, write_deltalake

    # a table with a folder a vessel has groups as large as they come
    groups = None if table.metadata().partition_columns else delta.ROW_GROUP
    with delta.refusals_as_errors(table.table_uri):
        write_deltalake(
            table,
            pa.RecordBatchReader.from_batches(schema, delta.batches(new, schema)),
            writer_properties=WriterProperties(compression="ZSTD", max_row_group_size=groups),
            commit_properties=CommitProperties(custom_metadata=dict(metadata or {}) or None, max_commit_retries=0),
            **how,
        )
        seals.seal(table)


def describe_alone(table: DeltaTable, name: str, column: str, brought_from: int) -> None:
    """Give a column the words that it has in `kempf.schemas.tables.TABLES`, as `exchange_alone` commits.

    Who opened the table before cannot commit to it any more.

    Raises
    ------
    deltalake.exceptions.CommitFailedError
        Another process committed since the table was opened.
    KempfError
        ``disk_full``, ``warehouse_not_writable``.
    """
    from deltalake import CommitProperties

    held = arrow_schema(TABLES[name]).field(column).metadata
    properties = CommitProperties(custom_metadata={delta.BROUGHT: str(brought_from)}, max_commit_retries=0)
    with delta.refusals_as_errors(table.table_uri):
        words = {key.decode(): value.decode() for key, value in held.items()}
        table.alter.set_column_metadata(column, words, commit_properties=properties)
        seals.seal(table)
