"""How the parameters of a vessel went over time, as known now or at an earlier time."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any

from schemas.errors import UsageError
from warehouse import delta, vessels
from warehouse.canonical import plain
from warehouse.instant import iso_utc
from warehouse.keys import vessel_key
from warehouse.store import Warehouse

if TYPE_CHECKING:
    import polars as pl
    from deltalake import DeltaTable


@dataclass(frozen=True, eq=False)
class History:
    """The history of one vessel.

    Attributes
    ----------
    frame : polars.DataFrame
        One row a parameter of a set: parameter_set_id, start_utc_ns, model, estimator, parameter, value, std, unit,
        superseded; sorted by start, superseded ones first, then id, then as the set lists them.
    version : int or None
        Version of the table that was read; None where there was none.
    note : str or None
        Why it is empty, where it is.
    """

    frame: pl.DataFrame
    version: int | None
    note: str | None

    def rows(self) -> list[dict[str, Any]]:
        """Return the rows as JSON content, with the start of the first segment as ISO 8601 text."""
        listed = self.frame.rows(named=True)
        result: list[dict[str, Any]] = plain([{**row, "start": iso_utc(row["start_utc_ns"])} for row in listed])
        return result


def of_vessel(
    warehouse: Warehouse,
    vessel: str,
    parameter: str | None = None,
    as_of: datetime | None = None,
    *,
    superseded: bool = False,
) -> History:
    """Return the history of a vessel's parameters.

    Parameters
    ----------
    warehouse : Warehouse
        Where they are.
    vessel : str
        Her name.
    parameter : str, optional
        Only this one.
    as_of : datetime, optional
        With a time zone: only what had been committed by then.
    superseded : bool, optional
        Also sets whose log has been read anew since, with another profile or code.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    UsageError
        ``as_of_without_zone``, ``no_parameter``: none of the vessel's sets has such a parameter.
    """
    warehouse.require()
    version = None
    if as_of is not None:
        if as_of.tzinfo is None:
            raise UsageError(
                "as_of_without_zone",
                f"{as_of.isoformat()} names no time zone.",
                "Write it with one, such as 2025-05-03T12:00:00Z.",
            )
        version = delta.version_as_of(warehouse, "parameter_sets", as_of)
        if version is None:
            vessels.require(warehouse, vessel)
            nothing = _exploded(None, vessel, [])
            return History(nothing, None, f"No parameter set of any vessel was stored by {as_of.isoformat()}.")
    table = delta.open_table(warehouse, "parameter_sets", version)
    frame = _exploded(table, vessel, _past_ingests(warehouse, vessel, as_of))
    if not superseded:
        frame = frame.remove(frame["superseded"])
    note: str | None = None
    if frame.height == 0:
        vessels.require(warehouse, vessel)
        note = f"No parameter set of {vessel!r} " + ("is stored." if as_of is None else f"by {as_of.isoformat()}.")
    elif parameter is not None:
        frame = _only(frame, parameter)
    return History(frame, table.version() if table is not None else None, note)


def _past_ingests(warehouse: Warehouse, vessel: str, as_of: datetime | None) -> list[str]:
    """Return the ingests after which their logs had been read anew, by a time or by now."""
    version = None if as_of is None else delta.version_as_of(warehouse, "logs", as_of)
    if as_of is not None and version is None:
        return []
    table = delta.open_table(warehouse, "logs", version)
    columns = ("log_id", "ingest_id", "revision")
    rows = delta.rows(table, "logs", {"vessel_key": vessel_key(vessel)}, columns).sort("log_id", "revision")
    present = {row["log_id"]: row["ingest_id"] for row in rows.rows(named=True)}
    return [row["ingest_id"] for row in rows.rows(named=True) if present[row["log_id"]] != row["ingest_id"]]


def _exploded(table: DeltaTable | None, vessel: str, past: list[str]) -> pl.DataFrame:
    import polars as pl

    columns = ("parameter_set_id", "start_utc_ns", "model_name", "estimator", "parameters", "provenance_json")
    sets = delta.rows(table, "parameter_sets", {"vessel_key": vessel_key(vessel)}, columns)
    ingest = pl.col("provenance_json").str.json_path_match("$.ingest_ids[0]")
    marked = sets.with_columns(superseded=ingest.is_in(past).fill_null(value=False)).drop("provenance_json")
    ordered = marked.sort("start_utc_ns", "superseded", "parameter_set_id", descending=[False, True, False])
    each = ordered.explode("parameters", empty_as_null=False)
    return each.unnest("parameters").rename({"model_name": "model", "name": "parameter"})


def _only(frame: pl.DataFrame, parameter: str) -> pl.DataFrame:
    import polars as pl

    kept = frame.filter(pl.col("parameter") == parameter)
    if kept.height == 0:
        known = sorted(set(frame["parameter"].to_list()))
        raise UsageError(
            "no_parameter",
            f"No parameter set of the vessel has a parameter {parameter!r}; known: {', '.join(known)}.",
            "Give one of these with --parameter.",
            {"parameter": parameter, "known": known},
        )
    return kept
