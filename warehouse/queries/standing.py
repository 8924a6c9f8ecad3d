"""Which parameter sets of a vessel stand, and which are superseded."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING, Any

from kempf.warehouse.queries.logs_as_of import LogsAsOf, as_then, logs_as_of
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.canonical import canonical_json
from kempf.warehouse.storage.keys import vessel_key
from kempf.warehouse.storage.query_cache import cached
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import notes
from kempf.warehouse.tables.equivalents import code_of
from kempf.warehouse.tables.notes import Note
from kempf.warehouse.tables.parameter_set import UPDATES, Bounds, Update, update_in

if TYPE_CHECKING:
    import polars as pl
    from deltalake import DeltaTable


def standing_ids(warehouse: Warehouse, vessel: str) -> list[str]:
    """Return the ids of a vessel's parameter sets that are not superseded, by start, then id.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    warehouse.require()
    code = code_of(warehouse, "estimate")
    return list(cached(warehouse, _READ, ("standing", vessel, code), partial(_standing, warehouse, vessel)))


#: tables of which it depends what of a vessel is superseded
_READ = ("parameter_sets", "logs", "segments", "examinations", "notes")


def _standing(warehouse: Warehouse, vessel: str) -> list[str]:
    with delta.reading(warehouse, "parameter_sets") as table:
        sets = marked(table, vessel, logs_as_of(warehouse, vessel, None), ("parameter_set_id", "start_utc_ns"))
    names: list[str] = sets.remove(sets["superseded"])["parameter_set_id"].to_list()
    return names


def marked(table: DeltaTable | None, vessel: str, logs: LogsAsOf, columns: Sequence[str]) -> pl.DataFrame:
    """Return sets in the order of their start with a column ``superseded``.

    A set is superseded where one of its logs has been read anew since or removed, where one of its segments is found no
    longer, and where there are sets of newer code: of the present code, else of the one that was at work last; where
    this is so of a set that it brings forward; and where a pooled set of the same model and settings rests on all of
    its manoeuvres and more, or on the same ones as a log holds them that has more of them. A set that goes by noted
    draughts is superseded where others are noted now.

    Parameters
    ----------
    table : DeltaTable or None
        Of parameter sets, newest or of a time that is past; None has no rows.
    logs : LogsAsOf
        What is known of her logs, or was then.
    columns : sequence of str
        Of the table, to be returned beside the mark.
    """
    import polars as pl

    needed = ("segment_ids", "provenance_json", "settings_json", "model_sha256", "estimator", "convergence_json")
    extra = [name for name in needed if name not in columns]
    wanted = (*columns, *extra)
    if logs.then:
        sets = as_then(table, "parameter_sets", vessel, {}, wanted)
    else:
        sets = delta.rows(table, "parameter_sets", {"vessel_key": vessel_key(vessel)}, wanted)
    # read once for all that is asked of it: a vessel has thousands
    made = sets["provenance_json"].str.json_decode(
        pl.Struct(
            {
                "code_version": pl.String,
                "ingest_ids": pl.List(pl.String),
                "table_versions": pl.Struct({"parameter_sets": pl.Int64}),
            }
        )
    )
    at = made.struct.field("table_versions").struct.field("parameter_sets").fill_null(-1)
    sets = sets.with_columns(_code=made.struct.field("code_version"), _at=at)
    codes = sets["_code"].to_list()
    newest = logs.code if logs.code in codes else next(iter(sets.sort("_at", descending=True)["_code"]), None)
    old = pl.col("_code").ne_missing(newest)
    if logs.past:
        # a set of several logs is superseded with any of them
        past = made.struct.field("ingest_ids").list.eval(pl.element().is_in(logs.past)).list.any()
        old |= past.fill_null(value=False)
    if logs.segments is not None:
        old |= ~pl.col("segment_ids").list.eval(pl.element().is_in(logs.segments)).list.all()
    noted = [
        text is not None and _noted_otherwise(json.loads(text), logs.notes) for text in _inputs_with_draughts(sets)
    ]
    old |= pl.Series(noted, dtype=pl.Boolean)
    sets = sets.with_columns(superseded=old).drop("_code", "_at")
    sets = sets.with_columns(superseded=_with_chains(sets, logs.twins)).drop(extra)
    return sets.sort("start_utc_ns", "superseded", "parameter_set_id", descending=[False, True, False])


def _inputs_with_draughts(sets: pl.DataFrame) -> list[str | None]:
    """Return the inputs of every set as JSON, None for those that go by no draught."""
    import polars as pl

    text = pl.col("provenance_json").str
    inputs = pl.when(text.contains('"draughts_m"', literal=True)).then(text.json_path_match("$.inputs"))
    texts: list[str | None] = sets.select(inputs.alias("inputs"))["inputs"].to_list()
    return texts


def _noted_otherwise(inputs: dict[str, Any], among: Sequence[Note]) -> bool:
    """Return whether other draughts are noted now than those that a set goes by."""
    held: dict[str, float] = inputs.get("draughts_m") or {}
    return bool(held) and notes.draughts_m(among, [Bounds(**segment) for segment in inputs["segments"]]) != held


def _with_chains(sets: pl.DataFrame, twins: Callable[[], Mapping[str, str]]) -> pl.Series:
    """Return which sets are superseded: those that rest on such ones, and pooled ones that another one contains."""
    import polars as pl

    columns = ("parameter_set_id", "superseded", "estimator", "model_sha256", "segment_ids", "settings_json")
    noted = pl.col("provenance_json").str.contains('"draughts_m"', literal=True)
    converged = pl.col("convergence_json").str.json_path_match("$.converged").eq_missing("true")
    rows = sets.select(*columns, converged=converged, noted=noted).rows(named=True)
    # nearly all of a vessel's sets have the settings of another one
    parts = cache(_parts)
    known = {row["parameter_set_id"]: _Rests(row, *parts(row["settings_json"])) for row in rows}
    for basis in sorted(known.values(), key=lambda basis: basis.update.manoeuvres if basis.update else 0):
        if basis.update is not None:
            # it rests on fewer manoeuvres, so that what that one rests on is known
            basis.on(known.get(basis.update.set))
    kinds: dict[tuple[str, ...], list[_Rests]] = {}
    for basis in known.values():
        if basis.pooled and basis.converged and not basis.superseded:
            kinds.setdefault(basis.kind, []).append(basis)
    pooled = [basis for basis in known.values() if basis.pooled and not basis.superseded]
    if any(other is not basis for basis in pooled for other in kinds.get(basis.kind, ())):
        # read only where sets are compared: it takes all of her manoeuvres
        doubles = twins()
        for basis in pooled:
            basis.take_whole(doubles)
    for alike in kinds.values():
        # the largest first: it contains most others, so that few are compared
        alike.sort(key=lambda basis: len(basis.segments), reverse=True)
    return pl.Series(
        [
            basis.superseded or (basis.pooled and any(other.replaces(basis) for other in kinds.get(basis.kind, ())))
            for basis in known.values()
        ],
        dtype=pl.Boolean,
    )


def _parts(settings_json: str) -> tuple[Update | None, str]:
    """Return which set is brought forward by one of these settings, and the text of those that are no manoeuvre's."""
    settings = json.loads(settings_json)
    others = {key: value for key, value in settings.items() if key not in ("segments", UPDATES)}
    return update_in(settings), canonical_json(others)


class _Rests:
    """What a set rests on, and whether anything of it is superseded."""

    def __init__(self, row: Mapping[str, Any], update: Update | None, settings_text: str) -> None:
        self.update = update
        self.segments = frozenset(row["segment_ids"])
        #: How many of them it takes from a log that has less of them than another one.
        self.in_part = 0
        self.superseded: bool = row["superseded"]
        self.converged: bool = row["converged"]
        #: Whether it goes by draughts that were noted.
        self.noted: bool = row["noted"]
        self._id: str = row["parameter_set_id"]
        self.kind = (row["estimator"], row["model_sha256"], settings_text)

    def on(self, before: _Rests | None) -> None:
        """Rest on another one, too; None where that is lost."""
        self.superseded = self.superseded or before is None or before.superseded
        if before is not None:
            self.segments |= before.segments

    def take_whole(self, doubles: Mapping[str, str]) -> None:
        """Name every manoeuvre as the log holds it that has most of it, see `LogsAsOf.twins`."""
        self.in_part = sum(name in doubles for name in self.segments)
        self.segments = frozenset(doubles.get(name, name) for name in self.segments)

    @property
    def pooled(self) -> bool:
        return len(self.segments) > 1

    def replaces(self, other: _Rests) -> bool:
        """Whether it is of more manoeuvres, or of the same ones and by draughts, as whole, or more fitted at once."""
        if self.segments != other.segments:
            return self.segments > other.segments
        return self._rank < other._rank

    @property
    def _rank(self) -> tuple[bool, int, int, str]:
        at_once = self.update.fitted_at_once if self.update else len(self.segments)
        return not self.noted, self.in_part, -at_once, self._id
