"""Which parameter sets of a vessel may be compared over time."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from math import isfinite
from typing import TYPE_CHECKING, Any

from kempf.warehouse.queries.logs_as_of import logs_as_of, sets_as_of
from kempf.warehouse.queries.standing import marked
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.parameter_set import update_in

if TYPE_CHECKING:
    from kempf.warehouse.tables.segments import Segment


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


def comparable_sets(warehouse: Warehouse, vessel: str, as_of: datetime | None = None) -> list[Comparable]:
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
    with sets_as_of(warehouse, as_of) as table:
        sets = marked(table, vessel, logs_as_of(warehouse, vessel, as_of), _COMPARED)
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
