"""How the parameters of a vessel went over time, as known now or at an earlier time."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from shlex import quote
from typing import TYPE_CHECKING, Any

from kempf.schemas.confidence import NORMAL_95
from kempf.schemas.enumeration import counted
from kempf.schemas.errors import UsageError
from kempf.schemas.instants import iso_utc
from kempf.warehouse.queries.logs_as_of import LogsAsOf, logs_as_of, sets_as_of
from kempf.warehouse.queries.standing import marked
from kempf.warehouse.storage.canonical import plain
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels
from kempf.warehouse.tables.equivalents import code_of

if TYPE_CHECKING:
    import polars as pl
    from deltalake import DeltaTable


@dataclass(frozen=True, eq=False)
class History:
    """The history of one vessel."""

    #: One row a parameter of a set: parameter_set_id, start_utc_ns, model, estimator, parameter, value, std, unit,
    #: superseded, converged; sorted by start, superseded ones first, then id, then as the set lists them.
    frame: pl.DataFrame
    #: Version of the table that was read; None where there was none.
    version: int | None
    #: Why it is empty, where it is.
    note: str | None

    def rows(self) -> list[dict[str, Any]]:
        """Return the rows as JSON content.

        Besides the columns: ``start`` of the first segment as ISO 8601 text, and ``low`` and ``high``, the ends of the
        95 % interval (1.96 standard errors), None where there is no standard error.
        """
        listed = [
            {**row, **_interval(row["value"], row["std"]), "start": iso_utc(row["start_utc_ns"])}
            for row in self.frame.rows(named=True)
        ]
        result: list[dict[str, Any]] = plain(listed)
        return result


def _interval(value: float, std: float | None) -> dict[str, float | None]:
    half = None if std is None else NORMAL_95 * std
    return {"low": None if half is None else value - half, "high": None if half is None else value + half}


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
        Also sets whose log has been read anew since, whose segment is no longer found, or that older code made.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    UsageError
        ``as_of_without_zone``, ``no_parameter``: none of the vessel's sets has such a parameter.
    """
    warehouse.require()
    with sets_as_of(warehouse, as_of) as table:
        if table is None and as_of is not None:
            vessels.require(warehouse, vessel)
            nothing = _exploded(None, vessel, LogsAsOf([], None, dict, [], code_of(warehouse, "estimate"), then=True))
            return History(
                nothing,
                None,
                f"No parameter set of any vessel was stored by {as_of:%Y-%m-%d %H:%M:%S} UTC: what counts is when a "
                "set was stored, not when she sailed.",
            )
        frame = _exploded(table, vessel, logs_as_of(warehouse, vessel, as_of))
        version = table.version() if table is not None else None
    held = frame["parameter_set_id"].n_unique()
    if not superseded:
        frame = frame.remove(frame["superseded"])
    note: str | None = None
    if frame.height == 0:
        vessels.require(warehouse, vessel)
        note = f"No parameter set of {vessel!r} " + ("is stored." if as_of is None else f"by {as_of.isoformat()}.")
        if held:
            then = "" if as_of is None else f" as of {as_of.isoformat()}"
            command = f"kempf history --vessel {quote(vessel)} --all"
            past = f"{counted(held, 'parameter set')} superseded"
            note = f"No parameter set of {vessel!r} stands{then}: {past}; see `{command}`."
    elif parameter is not None:
        frame = _only(frame, parameter)
    return History(frame, version, note)


def _exploded(table: DeltaTable | None, vessel: str, logs: LogsAsOf) -> pl.DataFrame:
    import polars as pl

    columns = ("parameter_set_id", "start_utc_ns", "model_name", "estimator", "parameters", "convergence_json")
    converged = pl.col("convergence_json").str.json_path_match("$.converged").eq_missing("true")
    sets = marked(table, vessel, logs, columns).with_columns(converged=converged).drop("convergence_json")
    each = sets.explode("parameters", empty_as_null=False)
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
