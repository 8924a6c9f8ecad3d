"""What is read of an open table: the files that a question cannot do without, and every column that there should be.

A table has a file for nearly every commit. polars' own reader of such tables looks into the statistics of them all,
which takes longer than reading the few that count; the table format picks those out first.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from kempf.schemas.tables import TABLES, arrow_schema
from kempf.warehouse.storage import seals

if TYPE_CHECKING:
    import polars as pl
    from deltalake import DeltaTable

#: Attribute of an open table: a version, and which files answer the questions that were asked of it.
_ASKED = "kempf_asked"

#: Values that a column may have, by column.
Where = Mapping[str, str | list[str]]


def scanned(table: DeltaTable | None, name: str, where: Where | None = None) -> pl.LazyFrame:
    """Return the rows of a table that have some values; a table that was never written has none.

    Parameters
    ----------
    table : DeltaTable or None
        Open.
    name : str
        Key of `kempf.schemas.tables.TABLES`; a column of it that the table lacks is null.
    where : mapping, optional
        As `kempf.warehouse.storage.delta.read` takes it.

    Returns
    -------
    polars.LazyFrame
        Not collected: the files are read, and may be missing, when it is.
    """
    import polars as pl

    filters = {c: v[0] if not isinstance(v, str) and len(v) == 1 else v for c, v in (where or {}).items()}
    single = {column: value for column, value in filters.items() if isinstance(value, str)}
    empty = _empty(name)
    if table is None:
        lazy = empty.lazy()
    # the table format takes a blank value for a null one
    elif _local(table) and single and all(single.values()) and single.keys() >= set(table.metadata().partition_columns):
        lazy = _of_few_files(table, name, empty, single)
    else:
        folder = seals.folder_of(table)
        if folder is not None:
            seals.compare_files(folder, name, _candidates(table, filters))
        held = {field.name for field in table.schema().fields}
        absent = {column: kind for column, kind in empty.schema.items() if column not in held}
        lazy = pl.scan_delta(table).with_columns(pl.lit(None, dtype=kind).alias(c) for c, kind in absent.items())
    for column, value in filters.items():
        lazy = lazy.filter(pl.col(column) == value if isinstance(value, str) else pl.col(column).is_in(value))
    return lazy


def by_file(table: DeltaTable, name: str, where: Mapping[str, str]) -> list[pl.LazyFrame]:
    """Return the rows of one folder of a table, a frame a file: read one after the other, little is held at a time.

    Parameters
    ----------
    table : DeltaTable
        Open; one in a bucket gives one frame of all files.
    name : str
        Key of `kempf.schemas.tables.TABLES`.
    where : mapping of str to str
        The value of every column that the table has folders by.
    """
    if not _local(table):
        return [scanned(table, name, where)]
    return [_of_files(table, name, _empty(name), where, [file]) for file in _files(table, where)]


def _local(table: DeltaTable) -> bool:
    # a bucket needs the credentials that polars takes from the table itself
    return table.table_uri.startswith(("file://", "/"))


def _of_few_files(table: DeltaTable, name: str, empty: pl.DataFrame, single: Mapping[str, str]) -> pl.LazyFrame:
    """Return the rows of the files that may hold these values, by their folder or their statistics."""
    files = _files(table, single)
    return _of_files(table, name, empty, single, files) if files else empty.lazy()


def _of_files(
    table: DeltaTable, name: str, empty: pl.DataFrame, single: Mapping[str, str], files: list[str]
) -> pl.LazyFrame:
    """Return the rows of some files."""
    import polars as pl

    folder = seals.folder_of(table)
    if folder is not None:
        seals.compare_files(folder, name, files)
    folders = table.metadata().partition_columns  # what a folder is named by does not stand in its files
    inside = {column: kind for column, kind in empty.schema.items() if column not in folders}
    lazy = pl.scan_parquet(
        files, schema=inside, missing_columns="insert", extra_columns="ignore", glob=False, hive_partitioning=False
    )
    return lazy.with_columns(pl.lit(single[column]).alias(column) for column in folders).select(empty.columns)


def _candidates(table: DeltaTable, question: Mapping[str, str | list[str]]) -> list[str]:
    """Return the files of the folders that a question concerns."""
    folders = set(table.metadata().partition_columns)
    filters = [(c, "in", [v] if isinstance(v, str) else list(v)) for c, v in question.items() if c in folders and v]
    return table.file_uris(file_pruning_predicate=filters) if filters else table.file_uris()


def _files(table: DeltaTable, single: Mapping[str, str]) -> list[str]:
    """Return the files that may hold these values; what was asked before of this version is not looked for again."""
    version, answers = vars(table).get(_ASKED, (None, {}))
    if version != table.version():
        version, answers = vars(table)[_ASKED] = table.version(), {}
    key = tuple(sorted(single.items()))
    if key not in answers:
        answers[key] = table.file_uris(file_pruning_predicate=[(column, "=", value) for column, value in key])
    files: list[str] = answers[key]
    return files


def _empty(name: str) -> pl.DataFrame:
    import polars as pl

    # by way of an empty table, pyarrow would import pandas wherever that is installed
    return pl.DataFrame(schema=pl.Schema(arrow_schema(TABLES[name])))
