"""Deleting rows of a table for good: also the files that hold them in its earlier versions, or in none."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from kempf.schemas.tables import TABLES
from kempf.warehouse.storage import delta, seals
from kempf.warehouse.storage.keys import earlier_key, one_of, quoted, vessel_key
from kempf.warehouse.storage.retry import with_retry
from kempf.warehouse.storage.scan import Where
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.upkeep.verify import ASIDE

#: In the name of a data file for as long as it is being written.
_HALF = ".parquet#"


def erase(warehouse: Warehouse, name: str, vessel: str, column: str, values: Collection[str]) -> None:
    """Delete the rows of a vessel whose column has one of some values, from the newest version and from every other.

    Files are whole: where one of an earlier version holds rows of others, too, that version can no longer be read. What
    is reproduced is made from the raw logs, and the history does not read these tables as they were. Files that cannot
    be read go, too, for they may hold them: those of hers that a writer was killed over, and those that a repair kept
    aside.

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
    # files of versions from before layout 4 are in a folder of another name
    among = (key, earlier_key(vessel)) if "vessel_key" in TABLES[name].partition_by else ()
    partitions = tuple(f"vessel_key={spelling}/" for spelling in among) or ("",)
    for path in warehouse.paths_below(name):
        parts = path.split("/")
        if parts[0] == "_delta_log" or not any(folder in path for folder in partitions):
            continue
        data = path.endswith(".parquet") and parts[-1] not in live
        if (data and _holds(warehouse, (name, *parts), column, values)) or _HALF in parts[-1]:
            warehouse.delete(name, *parts)
            if warehouse.folder is not None:
                seals.forget(warehouse.folder / name, warehouse.folder.joinpath(name, *parts))
    for file in warehouse.files_below(ASIDE, name):
        if _holds(warehouse, (ASIDE, name, file), column, values):
            warehouse.delete(ASIDE, name, file)


def _holds(warehouse: Warehouse, parts: Sequence[str], column: str, values: Collection[str]) -> bool:
    """Return whether a file has a row with one of the values, or may have one, as it cannot be read."""
    import polars as pl

    if any(part.startswith(f"{column}=") for part in parts):
        return any(f"{column}={value}" in parts for value in values)
    with warehouse.opened(*parts) as stream:
        try:
            return stream is not None and pl.read_parquet(stream, columns=[column])[column].is_in(list(values)).any()
        except pl.exceptions.PolarsError:
            return True
