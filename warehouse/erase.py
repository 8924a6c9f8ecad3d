"""Deleting rows of a table for good: also the files of its earlier versions that hold them."""

from __future__ import annotations

from collections.abc import Collection

from kempf.schemas.tables import TABLES
from kempf.warehouse import delta, seals
from kempf.warehouse.keys import one_of, quoted, vessel_key
from kempf.warehouse.retry import with_retry
from kempf.warehouse.scan import Where
from kempf.warehouse.store import Warehouse


def erase(warehouse: Warehouse, name: str, vessel: str, column: str, values: Collection[str]) -> None:
    """Delete the rows of a vessel whose column has one of some values, from the newest version and from every other.

    Files are whole: where one of an earlier version holds rows of others, too, that version can no longer be read. What
    is reproduced is made from the raw logs, and the history does not read these tables as they were.

    Parameters
    ----------
    name : str
        Of the table, one of those that hold measurements.
    """
    if not values:
        return
    key = vessel_key(vessel)

    def attempt() -> set[str]:
        with delta.ensured(warehouse, name) as table:
            where: Where = {"vessel_key": key, column: sorted(values)}
            if delta.rows(table, name, where, (column,)).height:
                predicate = f"vessel_key = {quoted(key)} AND {one_of(column, values)}"
                delta.replace(table, name, [], predicate)
            return {uri.rpartition("/")[2] for uri in table.file_uris()}

    live = with_retry(attempt)
    hers = f"vessel_key={key}/" if "vessel_key" in TABLES[name].partition_by else ""
    for path in warehouse.paths_below(name):
        parts = path.split("/")
        data = path.endswith(".parquet") and parts[0] != "_delta_log" and hers in path
        if data and parts[-1] not in live and _holds(warehouse, name, parts, column, values):
            warehouse.delete(name, *parts)
            if warehouse.folder is not None:
                seals.forget(warehouse.folder / name, warehouse.folder.joinpath(name, *parts))


def _holds(warehouse: Warehouse, name: str, parts: list[str], column: str, values: Collection[str]) -> bool:
    import polars as pl

    if column in TABLES[name].partition_by or any(part.startswith(f"{column}=") for part in parts):
        return any(f"{column}={value}" in parts for value in values)
    with warehouse.opened(name, *parts) as stream:
        return stream is not None and pl.read_parquet(stream, columns=[column])[column].is_in(list(values)).any()
