"""The table of parameter sets: rows are added and never changed."""

from __future__ import annotations

import logging
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING, Any

from orjson import loads

from kempf.schemas.errors import KempfError, NotFound, UsageError
from kempf.warehouse.storage import delta, seals
from kempf.warehouse.storage.canonical import canonical_json
from kempf.warehouse.storage.keys import one_of, vessel_key
from kempf.warehouse.storage.retry import with_retry
from kempf.warehouse.storage.scan import Where
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.agreement import content_digest, differences
from kempf.warehouse.tables.parameter_set import UPDATES, ParameterSet, StoredValue, Update, brought_forward, update_in

if TYPE_CHECKING:
    import polars as pl

_ESTIMATES = ("parameters", "discrete", "noise")
_TEXTS = ("settings", "fit", "iterations", "convergence", "provenance")


_log = logging.getLogger("kempf.warehouse")


def insert(warehouse: Warehouse, sets: Sequence[ParameterSet]) -> tuple[str, ...]:
    """Add parameter sets, in at most one commit; those that are there already change nothing.

    Parameters
    ----------
    warehouse : Warehouse
        Made where there is none.
    sets : sequence of ParameterSet
        Of any vessels.

    Returns
    -------
    tuple of str
        Ids that were not there before, in the order given.

    Raises
    ------
    KempfError
        ``parameter_set_differs``: a set with this id is there and says something else; nothing is written.
    """
    given: dict[str, ParameterSet] = {}
    for parameter_set in sets:
        _refuse_other(given.setdefault(parameter_set.parameter_set_id, parameter_set), parameter_set)
    if not given:
        return ()
    keys = {vessel_key(parameter_set.vessel) for parameter_set in given.values()}

    def attempt() -> tuple[str, ...]:
        with delta.ensured(warehouse, "parameter_sets") as table:
            # an id is made of logs, and a log is of one vessel: no other vessel's files need be looked into
            frame = delta.rows(table, "parameter_sets", {"vessel_key": sorted(keys), "parameter_set_id": sorted(given)})
            stored = [_set(r) for r in frame.rows(named=True)]
            for parameter_set in stored:
                _refuse_other(parameter_set, given[parameter_set.parameter_set_id])
            fresh = [name for name in given if name not in {parameter_set.parameter_set_id for parameter_set in stored}]
            if fresh:
                rows = [_as_columns(given[name]) for name in fresh]
                predicate = f"{one_of('vessel_key', keys)} AND {one_of('parameter_set_id', fresh)}"
                delta.replace(table, "parameter_sets", rows, predicate)
            return tuple(fresh)

    fresh = with_retry(attempt)
    for name in fresh:
        parameter_set = given[name]
        _log.info(
            "%s of %s is stored: %s, %s", name, parameter_set.vessel, parameter_set.model_name, parameter_set.estimator
        )
    return fresh


def get(warehouse: Warehouse, name: str, vessel: str | None = None) -> ParameterSet:
    """Return a parameter set by its id, or by a beginning of it that only one has, with all that it rests on.

    Where it brings another one forward, what that says of its manoeuvres stands in it. It raises what `chain_of` does.
    """
    return reduce(brought_forward, chain_of(warehouse, name, vessel))


def get_of(warehouse: Warehouse, name: str, vessel: str) -> ParameterSet:
    """Return a parameter set as `get` does, which must be one of a vessel.

    Raises
    ------
    UsageError
        ``set_of_another_vessel``.
    """
    parameter_set = get(warehouse, name)
    if parameter_set.vessel != vessel:
        raise UsageError(
            "set_of_another_vessel",
            f"{parameter_set.parameter_set_id} is a parameter set of {parameter_set.vessel!r}, not of {vessel!r}.",
            f"List hers with `kempf params list --vessel {vessel!r}`.",
            {"parameter_set_id": parameter_set.parameter_set_id, "vessel": parameter_set.vessel},
        )
    return parameter_set


def chain_of(warehouse: Warehouse, name: str, vessel: str | None = None) -> list[ParameterSet]:
    """Return a parameter set behind those that it brings forward, the first one in front, each as it is stored.

    Errors are those of `as_stored`, and:

    Raises
    ------
    KempfError
        ``set_lost``: one that it rests on is not stored any more.
    """
    parameter_set = as_stored(warehouse, name, vessel)
    chain, lost = _chain(parameter_set, _beside(warehouse, [parameter_set]))
    if lost is not None:
        raise KempfError(
            "set_lost",
            f"{parameter_set.parameter_set_id} brings {lost} forward, which is not in the warehouse any more.",
            "See with `kempf verify` what is damaged; `kempf reprocess` fits all manoeuvres anew.",
            {"parameter_set_id": parameter_set.parameter_set_id, "updates": lost},
        )
    return chain


def get_all(warehouse: Warehouse, vessel: str, names: Collection[str] | None = None) -> list[ParameterSet]:
    """Return the parameter sets of a vessel with all that they rest on, all or some by their whole ids.

    One that rests on a set that is not stored any more is left out: it cannot be read, and is superseded. See
    `all_as_stored`.
    """
    sets = all_as_stored(warehouse, vessel, names)
    known = _beside(warehouse, sets)
    chains = [_chain(parameter_set, known) for parameter_set in sets]
    return [reduce(brought_forward, chain) for chain, lost in chains if lost is None]


def _beside(warehouse: Warehouse, sets: Sequence[ParameterSet]) -> dict[str, ParameterSet]:
    """Return sets of one vessel with those that they may rest on, by id."""
    known = {parameter_set.parameter_set_id: parameter_set for parameter_set in sets}
    updating = [parameter_set for parameter_set in sets if parameter_set.updates]
    if updating:
        before = _brings_forward(warehouse, sets[0].vessel)
        wanted = {update.set for parameter_set in updating if (update := parameter_set.updates)}
        beside: set[str] = set()
        while wanted:
            beside |= wanted
            wanted = {before[name] for name in wanted if name in before} - beside
        for parameter_set in all_as_stored(warehouse, sets[0].vessel, beside - known.keys()):
            known[parameter_set.parameter_set_id] = parameter_set
    return known


def _brings_forward(warehouse: Warehouse, vessel: str) -> dict[str, str]:
    """Return which set each set of a vessel brings forward, by id, of those that do."""
    import polars as pl

    with delta.lent(warehouse, "parameter_sets", {"vessel_key": vessel_key(vessel)}) as lazy:
        update = pl.col("settings_json").str.json_path_match(f"$.{UPDATES}.set")
        return dict(lazy.select("parameter_set_id", update).drop_nulls().collect().rows())


def _chain(parameter_set: ParameterSet, known: Mapping[str, ParameterSet]) -> tuple[list[ParameterSet], str | None]:
    """Return a set behind those that it brings forward, the first one in front, and which of these is lost."""
    chain = [parameter_set]
    while (update := chain[0].updates) is not None:
        if update.set not in known:
            return chain, update.set
        chain.insert(0, known[update.set])
    return chain, None


@dataclass(frozen=True)
class PooledSet:
    """What is known of a pooled set without reading all of it."""

    parameter_set_id: str
    #: Those that it adds, where it brings another one forward.
    segment_ids: tuple[str, ...]
    settings: dict[str, Any]
    code_version: str
    profile_sha256: str

    @property
    def updates(self) -> Update | None:
        """The set that it brings forward; None where it stands by itself."""
        return update_in(self.settings)

    @property
    def manoeuvres(self) -> int:
        """How many it rests on, with all that it brings forward."""
        return (self.updates.manoeuvres if self.updates else 0) + len(self.segment_ids)

    @property
    def fitted_at_once(self) -> int:
        """How many the first of these was fitted to."""
        return self.updates.fitted_at_once if self.updates else len(self.segment_ids)


def pooled(warehouse: Warehouse, vessel: str, model_sha256: str, estimator: str) -> list[PooledSet]:
    """Return what is known of a vessel's sets of one model and estimator, sorted by id."""
    where: Where = {"vessel_key": vessel_key(vessel), "model_sha256": model_sha256, "estimator": estimator}
    columns = ("parameter_set_id", "segment_ids", "settings_json", "provenance_json")
    frame = delta.read(warehouse, "parameter_sets", where, columns).sort("parameter_set_id")
    provenance = frame["provenance_json"].str
    codes, profiles = (provenance.json_path_match(f"$.{key}").to_list() for key in ("code_version", "profile_sha256"))
    return [
        PooledSet(name, tuple(ids), loads(settings), code, profile)
        for (name, ids, settings, _), code, profile in zip(frame.rows(), codes, profiles, strict=True)
    ]


def as_stored(warehouse: Warehouse, name: str, vessel: str | None = None) -> ParameterSet:
    """Return a parameter set as it is stored, by its id or by a beginning of it that only one has.

    Parameters
    ----------
    vessel : str, optional
        Whose it is: the files of others need not be looked into.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_parameter_set``.
    UsageError
        ``ambiguous_parameter_set``: several begin so.
    """
    of_vessel: dict[str, str | list[str]] = {} if vessel is None else {"vessel_key": vessel_key(vessel)}
    found_whole = delta.read(warehouse, "parameter_sets", {**of_vessel, "parameter_set_id": name})
    if found_whole.height:
        return _set(found_whole.rows(named=True)[0])
    ids = delta.read(warehouse, "parameter_sets", of_vessel, ("parameter_set_id",))["parameter_set_id"].to_list()
    names = sorted(candidate for candidate in ids if candidate.startswith(name))
    if not name.strip() or not names:
        raise NotFound(
            "no_parameter_set",
            f"There is no parameter set {name!r} in {warehouse.uri}.",
            "List them with `kempf params list`, or make one with `kempf identify --vessel NAME`.",
            {"parameter_set_id": name},
        )
    if len(names) > 1:
        raise UsageError(
            "ambiguous_parameter_set",
            f"{len(names)} parameter sets begin with {name!r}: {', '.join(names[:5])}{' ...' if names[5:] else ''}.",
            "Give more of the id.",
            {"beginning": name, "found": names},
        )
    return as_stored(warehouse, names[0], vessel)


def stored_anywhere(warehouse: Warehouse, name: str, vessel: str) -> ParameterSet:
    """Return a set by its whole id as it is stored: of a vessel or, where she was renamed since, of her earlier name.

    Raises
    ------
    NotFound
        ``no_parameter_set``: it is lost.
    """
    stored = all_as_stored(warehouse, vessel, [name])
    return stored[0] if stored else as_stored(warehouse, name)


def all_as_stored(warehouse: Warehouse, vessel: str, names: Collection[str] | None = None) -> list[ParameterSet]:
    """Return the parameter sets of a vessel as they are stored, all or some by their whole ids, in one reading.

    Parameters
    ----------
    names : collection of str, optional
        Ids; one that she does not have is left out.

    Returns
    -------
    list of ParameterSet
        Sorted by start, then id.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    if names is not None and not names:
        warehouse.require()
        return []
    of_vessel: dict[str, str | list[str]] = {"vessel_key": vessel_key(vessel)}
    chosen = of_vessel if names is None else {**of_vessel, "parameter_set_id": sorted(names)}
    frame = delta.read(warehouse, "parameter_sets", chosen).sort("start_utc_ns", "parameter_set_id")
    return [_set(row) for row in frame.rows(named=True)]


def summaries(warehouse: Warehouse, vessel: str | None = None) -> pl.DataFrame:
    """Return vessel, id, start, model, estimator and parent of the sets of one vessel or of all.

    Returns
    -------
    polars.DataFrame
        Sorted by vessel, start, id.
    """
    where = {} if vessel is None else {"vessel_key": vessel_key(vessel)}
    columns = ("vessel", "parameter_set_id", "start_utc_ns", "model_name", "estimator", "parent")
    return delta.read(warehouse, "parameter_sets", where, columns).sort("vessel", "start_utc_ns", "parameter_set_id")


def models(warehouse: Warehouse, vessel: str) -> list[tuple[dict[str, Any], str, dict[str, Any]]]:
    """Return every model specification and estimator that a vessel has sets of, in the order of their text.

    Returns
    -------
    list of (dict, str, dict)
        Specification, estimator, and the text of effects that are not in the catalogue, as a set's settings hold it.
    """
    where = {"vessel_key": vessel_key(vessel)}
    columns = ("model_json", "estimator", "settings_json")
    frame = delta.read(warehouse, "parameter_sets", where, columns).unique().sort(*columns)
    return [(loads(text), estimator, loads(settings).get("own") or {}) for text, estimator, settings in frame.rows()]


def specifications(warehouse: Warehouse, names: Collection[str]) -> dict[str, dict[str, Any]]:
    """Return the model specification of some sets of any vessels by their whole ids; one that is lost is left out."""
    columns = ("parameter_set_id", "model_json")
    frame = delta.read(warehouse, "parameter_sets", {"parameter_set_id": sorted(names)}, columns)
    return {name: loads(text) for name, text in frame.rows()}


@dataclass(frozen=True)
class Convergence:
    """How the search for a set ended, without what it found."""

    parameter_set_id: str
    model_name: str
    estimator: str
    #: Those that it adds, where it brings another set forward.
    segment_ids: tuple[str, ...]
    converged: bool
    #: Why it leaves segments out, by segment.
    left_out: dict[str, str]
    #: What separate hulls say of a common one; empty where there are none.
    pooling: dict[str, Any]


def converged(warehouse: Warehouse, vessel: str, names: Collection[str]) -> dict[str, bool]:
    """Return whether the search for each of some sets of a vessel converged, by id; one that is not stored is left out.

    Parameters
    ----------
    names : collection of str
        Whole ids.
    """
    import polars as pl

    where: Where = {"vessel_key": vessel_key(vessel), "parameter_set_id": sorted(names)}
    with delta.lent(warehouse, "parameter_sets", where) as lazy:
        frame = lazy.select("parameter_set_id", pl.col("convergence_json").str.json_path_match("$.converged")).collect()
    return {name: text == "true" for name, text in frame.rows()}


def convergences_to_look_at(
    warehouse: Warehouse, vessel: str | None, code: str | None = None, names: Collection[str] | None = None
) -> list[Convergence]:
    """Return how the search ended for sets, of one vessel or of all, that need a person's attention, sorted by id.

    The search did not converge, segments are left out, or the manoeuvres do not share one hull.

    Parameters
    ----------
    code : str, optional
        Of the sets that this code made alone.
    names : collection of str, optional
        Of these sets alone, by their whole ids.
    """
    import polars as pl

    where: dict[str, str | list[str]] = {} if vessel is None else {"vessel_key": vessel_key(vessel)}
    if names is not None:
        where["parameter_set_id"] = sorted(names)
    columns = ("parameter_set_id", "model_name", "estimator", "segment_ids", "convergence_json", "provenance_json")
    with delta.lent(warehouse, "parameter_sets", where) as lazy:
        by = pl.col("provenance_json").str.json_path_match("$.code_version")
        convergence = pl.col("convergence_json").str
        frame = (
            (lazy if code is None else lazy.filter(by == code))
            .select(
                *columns[:4],
                converged=convergence.json_path_match("$.converged").eq_missing("true"),
                left=convergence.json_path_match("$.left_out").fill_null("{}"),
                pooling=convergence.json_path_match("$.pooling").fill_null("{}"),
            )
            .filter(
                ~pl.col("converged")
                | (pl.col("left") != "{}")
                | pl.col("pooling").str.contains('"may_be_pooled":false', literal=True)
            )
            .collect()
        )
    return [
        Convergence(name, model, estimator, tuple(ids), converged, loads(left), loads(pooling))
        for name, model, estimator, ids, converged, left, pooling in frame.sort("parameter_set_id").rows()
    ]


def codes(warehouse: Warehouse, vessel: str) -> set[str]:
    """Return the fingerprints of the code that made a vessel's sets."""
    provenances = delta.read(warehouse, "parameter_sets", {"vessel_key": vessel_key(vessel)}, ("provenance_json",))
    return set(provenances["provenance_json"].str.json_path_match("$.code_version").drop_nulls().to_list())


def _refuse_other(stored: ParameterSet, given: ParameterSet) -> None:
    if stored is given or content_digest(stored) == content_digest(given):
        return
    disagreements = differences(stored, given)
    fields = [difference.field for difference in disagreements]
    packages = [dict(s.provenance.get("packages") or {}) for s in (stored, given)]
    changed = sorted(n for n in packages[0].keys() | packages[1].keys() if packages[0].get(n) != packages[1].get(n))
    raise KempfError(
        "parameter_set_differs",
        f"{stored.parameter_set_id} is stored already and says something else in {len(fields)} fields: "
        f"{', '.join(fields[:6])}{', ...' if fields[6:] else ''}"
        + (f"; other versions of {', '.join(changed)}." if changed else "."),
        f"See how far they differ with `kempf rerun {stored.parameter_set_id}`; the stored set stays as it is.",
        {"differences": [difference.as_json() for difference in disagreements], "packages": changed},
    )


def _as_columns(parameter_set: ParameterSet) -> dict[str, Any]:
    columns = {**vars(parameter_set), "vessel_key": vessel_key(parameter_set.vessel)}
    columns |= {name: [vars(estimate) for estimate in columns[name]] for name in _ESTIMATES}
    texts = {f"{name}_json": canonical_json(columns.pop(name)) for name in _TEXTS}
    return {**columns, **texts, "model_json": canonical_json(columns.pop("model_spec"))}


def _set(row: dict[str, Any]) -> ParameterSet:
    contents = {name: loads(row.pop(f"{name}_json")) for name in _TEXTS}
    contents["model_spec"] = loads(row.pop("model_json"))
    contents |= {name: tuple(StoredValue(**item) for item in row.pop(name)) for name in _ESTIMATES}
    del row["vessel_key"]
    return ParameterSet.restored(**row, **contents)


def stored_at_ms(warehouse: Warehouse) -> dict[str, int]:
    """Return when each parameter set was stored, ms since 1970, by id: the time of the commit that brought it.

    The files of all commits are kept, see `kempf.warehouse.upkeep.compaction.ALWAYS`; a set whose file is damaged has
    no time.
    """
    instants: dict[str, int] = {}
    with delta.reading(warehouse, "parameter_sets") as table:
        times = delta.commit_times(table) if table is not None else []
    for version, milliseconds in enumerate(times):
        commit = warehouse.read_bytes("parameter_sets", "_delta_log", f"{version:020d}.json") or b""
        for path in seals.added(commit):
            for name in _ids_in(warehouse, path):
                # compaction brings it again
                instants.setdefault(name, milliseconds)
    return instants


def _ids_in(warehouse: Warehouse, path: str) -> list[str]:
    import polars as pl

    with warehouse.opened("parameter_sets", *path.split("/")) as stream:
        try:
            return [] if stream is None else pl.read_parquet(stream, columns=["parameter_set_id"]).to_series().to_list()
        except pl.exceptions.PolarsError:
            return []
