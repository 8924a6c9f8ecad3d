"""How the parameters of a vessel went over time, as known now or at an earlier time, and which sets may be compared."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from functools import cache, partial
from math import isfinite
from shlex import quote
from typing import TYPE_CHECKING, Any

from kempf.schemas.confidence import NORMAL_95
from kempf.schemas.enumeration import counted
from kempf.schemas.errors import KempfError, UsageError
from kempf.schemas.instants import iso_utc
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.canonical import canonical_json, plain
from kempf.warehouse.storage.keys import earlier_key, vessel_key
from kempf.warehouse.storage.query_cache import cached
from kempf.warehouse.storage.scan import Where
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import examinations, notes, vessels
from kempf.warehouse.tables.equivalents import code_of
from kempf.warehouse.tables.notes import Note
from kempf.warehouse.tables.parameter_set import UPDATES, Bounds, Update, update_in

if TYPE_CHECKING:
    import polars as pl
    from deltalake import DeltaTable

    from kempf.warehouse.tables.segments import Segment


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


@dataclass(frozen=True)
class Comparable:
    """Sets of one vessel, one model and one estimator with its settings, each from one segment of its own."""

    model: str
    model_sha256: str
    estimator: str
    #: parameter_set_ids, starts_utc_ns: Tuple of int. In the order of time.
    parameter_set_ids: tuple[str, ...]
    starts_utc_ns: tuple[int, ...]
    #: names, units: Parameters that have a standard error.
    names: tuple[str, ...]
    units: tuple[str, ...]
    #: Shape (n_set, n_parameter).
    values: tuple[tuple[float, ...], ...]
    #: Shape (n_set, n_parameter, n_parameter).
    covariances: tuple[tuple[tuple[float, ...], ...], ...]
    #: How many more sets there are of the kind, by the reason why they are not among these.
    left_out: dict[str, int]


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
    with _sets_as_of(warehouse, as_of) as table:
        if table is None and as_of is not None:
            vessels.require(warehouse, vessel)
            nothing = _exploded(None, vessel, _Logs([], None, dict, [], code_of(warehouse, "estimate"), then=True))
            return History(
                nothing,
                None,
                f"No parameter set of any vessel was stored by {as_of:%Y-%m-%d %H:%M:%S} UTC: what counts is when a "
                "set was stored, not when she sailed.",
            )
        frame = _exploded(table, vessel, _logs_of(warehouse, vessel, as_of))
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


def standing(warehouse: Warehouse, vessel: str) -> list[str]:
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
        marked = _marked(table, vessel, _logs_of(warehouse, vessel, None), ("parameter_set_id", "start_utc_ns"))
    names: list[str] = marked.remove(marked["superseded"])["parameter_set_id"].to_list()
    return names


def comparable(warehouse: Warehouse, vessel: str, as_of: datetime | None = None) -> list[Comparable]:
    """Return the sets of a vessel that may be compared over time, by model and estimator; superseded ones are left out.

    Parameters
    ----------
    warehouse : Warehouse
        Where they are.
    vessel : str
        Her name.
    as_of : datetime, optional
        With a time zone: only what had been committed by then.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    UsageError
        ``as_of_without_zone``.
    """
    from kempf.warehouse.tables import segments

    warehouse.require()
    with _sets_as_of(warehouse, as_of) as table:
        sets = _marked(table, vessel, _logs_of(warehouse, vessel, as_of), _COMPARED)
    kinds: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    for row in sets.rows(named=True):
        if not row["superseded"]:
            kinds.setdefault((row["estimator"], row["model_sha256"], row["settings_json"]), []).append(row)
    single = {row["segment_ids"][0] for rows in kinds.values() for row in rows if len(row["segment_ids"]) == 1}
    manoeuvres = segments.by_ids(warehouse, vessel, single) if single else {}
    return [_compared(kinds[kind], manoeuvres) for kind in sorted(kinds)]


_COMPARED = (
    *("parameter_set_id", "start_utc_ns", "model_name", "model_sha256", "estimator", "settings_json", "segment_ids"),
    *("parameters", "covariance_names", "covariance", "convergence_json"),
)


def _compared(rows: list[dict[str, Any]], manoeuvres: Mapping[str, Segment]) -> Comparable:
    """Keep of sets of one kind those that stand for themselves and can be weighed, each manoeuvre once."""
    from kempf.warehouse.queries.deduplicate import once

    names = {name: unit for row in rows for name, unit in _known(row).items()}
    left_out: Counter[str] = Counter()
    kept: list[dict[str, Any]] = []
    seen: set[str] = set()
    for row in rows:
        reason = _not_comparable(row, names, seen)
        if reason:
            left_out[reason] += 1
        else:
            kept.append(row)
            seen.add(row["segment_ids"][0])
    _, twins = once([manoeuvres[name] for name in sorted(seen) if name in manoeuvres])
    if twins:
        left_out["of a manoeuvre that another log holds"] = len(twins)
        kept = [row for row in kept if row["segment_ids"][0] not in twins]
    places = [[row["covariance_names"].index(name) for name in names] for row in kept]
    values = [{e["name"]: e["value"] for e in row["parameters"]} for row in kept]
    return Comparable(
        rows[0]["model_name"],
        rows[0]["model_sha256"],
        rows[0]["estimator"],
        tuple(row["parameter_set_id"] for row in kept),
        tuple(row["start_utc_ns"] for row in kept),
        tuple(names),
        tuple(names.values()),
        tuple(tuple(value[name] for name in names) for value in values),
        tuple(
            tuple(tuple(row["covariance"][i][j] for j in at) for i in at) for row, at in zip(kept, places, strict=True)
        ),
        dict(sorted(left_out.items())),
    )


def _known(row: dict[str, Any]) -> dict[str, str]:
    """Return the parameters of a set that have a standard error, with their units."""
    among = set(row["covariance_names"] or ())
    return {e["name"]: e["unit"] for e in row["parameters"] if e["name"] in among and e["std"] and isfinite(e["std"])}


def _not_comparable(row: dict[str, Any], names: dict[str, str], seen: set[str]) -> str:
    if len(row["segment_ids"]) != 1 or update_in(json.loads(row["settings_json"])):
        return "made of several segments"
    if row["segment_ids"][0] in seen:
        return "of a segment that is there already"
    if not json.loads(row["convergence_json"]).get("converged"):
        return "not converged"
    # what one set knows and another does not cannot be compared
    return "" if names and _known(row).keys() >= names.keys() else "without standard errors"


@contextmanager
def _sets_as_of(warehouse: Warehouse, as_of: datetime | None) -> Iterator[DeltaTable | None]:
    if as_of is None:
        with delta.reading(warehouse, "parameter_sets") as table:
            yield table
        return
    if as_of.tzinfo is None:
        raise UsageError(
            "as_of_without_zone",
            f"{as_of.isoformat()} names no time zone.",
            "Write it with one, such as 2025-05-03T12:00:00Z.",
        )
    version = delta.version_as_of(warehouse, "parameter_sets", as_of)
    if version is None:
        yield None
        return
    with delta.reading(warehouse, "parameter_sets", version) as table:
        yield table


@dataclass(frozen=True)
class _Logs:
    """What was known of a vessel's logs at some time."""

    #: Ingests after which their logs had been read anew, or removed.
    past: list[str]
    #: Segments found in the others; None where nobody had looked for any, or nobody knows any more.
    segments: list[str] | None
    #: Reads `_twins` of these; nothing of the past, of which that is not known.
    twins: Callable[[], Mapping[str, str]]
    #: Notes on her and what is hers.
    notes: list[Note]
    #: Fingerprint under which the present code estimates.
    code: str
    #: Whether it was so at a time that is past, of which earlier versions of tables tell.
    then: bool


def _logs_of(warehouse: Warehouse, vessel: str, as_of: datetime | None) -> _Logs:
    """Return what is known of a vessel's logs, or was by a time."""
    version = None if as_of is None else delta.version_as_of(warehouse, "logs", as_of)
    if as_of is not None and version is None:
        return _Logs([], None, dict, [], code_of(warehouse, "estimate"), then=True)
    columns = ("log_id", "ingest_id", "revision", "removed")
    rows = _read(warehouse, "logs", vessel, {}, columns, version).sort("log_id", "revision")
    last = {row["log_id"]: row for row in rows.rows(named=True)}
    present = {log: row["ingest_id"] for log, row in last.items() if row["removed"] is None}
    past = [row["ingest_id"] for row in rows.rows(named=True) if present.get(row["log_id"]) != row["ingest_id"]]
    segments = _segments_in(warehouse, vessel, sorted(present.values()), as_of)
    noted = notes.of_vessel(warehouse, vessel, as_of)
    twins = partial(_twins, warehouse, vessel) if as_of is None and segments else dict
    return _Logs(past, segments, twins, noted, code_of(warehouse, "estimate"), as_of is not None)


def _twins(warehouse: Warehouse, vessel: str) -> dict[str, str]:
    """Return which manoeuvres another log holds better, by id, and the id of that one."""
    from kempf.warehouse.queries.deduplicate import twins
    from kempf.warehouse.tables import segments

    return twins(segments.current(warehouse, vessel))


def _segments_in(warehouse: Warehouse, vessel: str, ingests: list[str], as_of: datetime | None) -> list[str] | None:
    version = None if as_of is None else delta.version_as_of(warehouse, "segments", as_of)
    if as_of is not None and version is None:
        return None
    try:
        rows = _read(warehouse, "segments", vessel, {"ingest_id": ingests}, ("segment_id", "excluded"), version)
    except KempfError:
        if version is None:
            raise
        return None  # what was found then has been deleted since: earlier versions of kempf did not keep it
    ids = rows.filter(rows["excluded"].is_null())["segment_id"].to_list()
    return ids or ([] if examinations.codes(warehouse, ingests, [vessel]) else None)


def _read(
    warehouse: Warehouse, name: str, vessel: str, where: Where, columns: Sequence[str], version: int | None
) -> pl.DataFrame:
    """Return rows of a vessel in the newest version of a table, or in another one."""
    if version is None:
        return delta.read(warehouse, name, {"vessel_key": vessel_key(vessel), **where}, columns)
    with delta.reading(warehouse, name, version) as table:
        return _as_then(table, name, vessel, where, columns)


def _as_then(table: DeltaTable | None, name: str, vessel: str, where: Where, columns: Sequence[str]) -> pl.DataFrame:
    """Return rows of a vessel in some version of a table, which may have them under the key of before layout 4.

    One that was written while the table was brought forward has some under either key, and each of them once.
    """
    import polars as pl

    keys = (vessel_key(vessel), earlier_key(vessel))
    return pl.concat([delta.rows(table, name, {"vessel_key": key, **where}, columns) for key in keys])


def _exploded(table: DeltaTable | None, vessel: str, logs: _Logs) -> pl.DataFrame:
    import polars as pl

    columns = ("parameter_set_id", "start_utc_ns", "model_name", "estimator", "parameters", "convergence_json")
    converged = pl.col("convergence_json").str.json_path_match("$.converged").eq_missing("true")
    marked = _marked(table, vessel, logs, columns).with_columns(converged=converged).drop("convergence_json")
    each = marked.explode("parameters", empty_as_null=False)
    return each.unnest("parameters").rename({"model_name": "model", "name": "parameter"})


def _marked(table: DeltaTable | None, vessel: str, logs: _Logs, columns: Sequence[str]) -> pl.DataFrame:
    """Return sets in the order of their start with a column ``superseded``.

    A set is superseded where one of its logs has been read anew since or removed, where one of its segments is found no
    longer, and where there are sets of newer code: of the present code, else of the one that was at work last; where
    this is so of a set that it brings forward; and where a pooled set of the same model and settings rests on all of
    its manoeuvres and more, or on the same ones as a log holds them that has more of them. A set that goes by noted
    draughts is superseded where others are noted now.
    """
    import polars as pl

    needed = ("segment_ids", "provenance_json", "settings_json", "model_sha256", "estimator", "convergence_json")
    extra = [name for name in needed if name not in columns]
    wanted = (*columns, *extra)
    if logs.then:
        sets = _as_then(table, "parameter_sets", vessel, {}, wanted)
    else:
        sets = delta.rows(table, "parameter_sets", {"vessel_key": vessel_key(vessel)}, wanted)
    provenance = pl.col("provenance_json").str
    at = provenance.json_path_match("$.table_versions.parameter_sets").cast(pl.Int64).fill_null(-1)
    sets = sets.with_columns(_code=provenance.json_path_match("$.code_version"), _at=at)
    codes = sets["_code"].to_list()
    newest = logs.code if logs.code in codes else next(iter(sets.sort("_at", descending=True)["_code"]), None)
    old = pl.col("_code").ne_missing(newest)
    if logs.past:
        # a set of several logs is superseded with any of them; ids are of one length, so that none stands in another
        old |= provenance.json_path_match("$.ingest_ids").str.contains_any(logs.past).fill_null(value=False)
    if logs.segments is not None:
        old |= ~pl.col("segment_ids").list.eval(pl.element().is_in(logs.segments)).list.all()
    noted = [
        text is not None and _noted_otherwise(json.loads(text), logs.notes) for text in _inputs_with_draughts(sets)
    ]
    old |= pl.Series(noted, dtype=pl.Boolean)
    sets = sets.with_columns(superseded=old).drop("_code", "_at")
    marked = sets.with_columns(superseded=_with_chains(sets, logs.twins)).drop(extra)
    return marked.sort("start_utc_ns", "superseded", "parameter_set_id", descending=[False, True, False])


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
        """Name every manoeuvre as the log holds it that has most of it, see `_twins`."""
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
