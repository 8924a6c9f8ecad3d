"""Names that point to a parameter set, such as ``current``. They move; the sets they point to never change."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import EllipsisType, MappingProxyType

import polars as pl

from kempf.schemas.errors import UsageError
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import one_of, quoted, vessel_key
from kempf.warehouse.storage.retry import with_retry
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets

#: the set that every command takes unless another is named
CURRENT = "current"
#: the set that was `CURRENT` until it was withdrawn; gone once there is a current one again
WITHDRAWN = "withdrawn"
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9._-]{0,63}")


def point(
    warehouse: Warehouse,
    vessel: str,
    parameter_set_id: str,
    alias: str = CURRENT,
    *,
    expected: str | EllipsisType | None = ...,
) -> bool:
    """Let an alias of a vessel point to one of her parameter sets; the latest call wins.

    Parameters
    ----------
    expected : str, optional
        Id of the set that it is taken to point to now, None for none; where it points elsewhere nothing is changed.
        Whatever it is, where nothing is expected.

    Returns
    -------
    bool
        Whether it pointed elsewhere before; else there is no commit.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_parameter_set``.
    UsageError
        ``set_of_another_vessel``, ``moved_meanwhile``.
    """
    parameter_set = parameter_sets.get_of(warehouse, parameter_set_id, vessel)
    before = {} if isinstance(expected, EllipsisType) else {(vessel, alias): expected}
    return bool(point_all(warehouse, {(vessel, alias): parameter_set.parameter_set_id}, before))


def moved_meanwhile(vessel: str, now: str | None, shown: str | None) -> UsageError:
    """Return the error of a change to another model than the one that was looked at."""
    return UsageError(
        "moved_meanwhile",
        f"The model of {vessel!r} is {now or 'none'} now, and was {shown or 'none'} when this was begun.",
        "Look at her model again, then ask once more.",
        {"standing": now, "shown": shown},
    )


def point_all(
    warehouse: Warehouse,
    targets: Mapping[tuple[str, str], str],
    expected: Mapping[tuple[str, str], str | None] = MappingProxyType({}),
) -> tuple[tuple[str, str], ...]:
    """Let aliases of several vessels point to sets that are stored, in at most one commit.

    Parameters
    ----------
    targets : mapping of (str, str) to str
        Whole ids of the vessels' own parameter sets, by vessel and alias.
    expected : mapping of (str, str) to str or None, optional
        Where some of them are taken to point now, None for nowhere.

    Returns
    -------
    tuple of (str, str)
        Those that pointed elsewhere before, sorted.
    """
    for alias in sorted({alias for _, alias in targets}):
        _require_name(alias)
    rows = {
        (vessel, alias): {"vessel_key": vessel_key(vessel), "vessel": vessel, "alias": alias, "parameter_set_id": name}
        for (vessel, alias), name in sorted(targets.items())
    }

    def attempt() -> tuple[tuple[str, str], ...]:
        with delta.ensured(warehouse, "aliases") as table:
            keys = sorted({row["vessel_key"] for row in rows.values()})
            known = delta.rows(table, "aliases", {"vessel_key": keys}).rows(named=True)
            stored = {(row["vessel"], row["alias"]): row["parameter_set_id"] for row in known}
            for (vessel, alias), before in expected.items():
                now = stored.get((vessel, alias))
                if now not in (before, targets[vessel, alias]):
                    raise moved_meanwhile(vessel, now, before)
            changed = tuple(key for key in rows if stored.get(key) != targets[key])
            if changed:
                # of one name only: several would also name what is not among them
                of = {alias: [rows[key]["vessel_key"] for key in changed if key[1] == alias] for _, alias in changed}
                predicate = " OR ".join(
                    f"({one_of('vessel_key', whose)} AND {one_of('alias', _in_place_of(alias))})"
                    for alias, whose in of.items()
                )
                delta.replace(table, "aliases", [rows[key] for key in changed], predicate)
            return changed

    return with_retry(attempt) if rows else ()


def _in_place_of(alias: str) -> tuple[str, ...]:
    """Return the aliases whose rows go where one is given a set."""
    return (alias, WITHDRAWN) if alias == CURRENT else (alias,)


def of_vessel(warehouse: Warehouse, vessel: str) -> dict[str, str]:
    """Return the parameter set id of every alias of a vessel, sorted by alias."""
    return _pointed(delta.read(warehouse, "aliases", {"vessel_key": vessel_key(vessel)}))


def of_model(pointed: Mapping[str, str]) -> str | None:
    """Return which of a vessel's aliases says what her model is: the current set, or the one that was withdrawn."""
    return pointed.get(CURRENT) or pointed.get(WITHDRAWN)


def holders(warehouse: Warehouse, alias: str) -> dict[str, str]:
    """Return the parameter set id that an alias points to, by vessel, sorted."""
    frame = delta.read(warehouse, "aliases", {})
    pointed = {str(rows["vessel"][0]): _pointed(rows) for rows in frame.sort("vessel").partition_by("vessel")}
    return {vessel: names[alias] for vessel, names in pointed.items() if alias in names}


def every(warehouse: Warehouse) -> dict[tuple[str, str], str]:
    """Return the parameter set id that every alias points to, by vessel and alias, sorted."""
    rows = delta.read(warehouse, "aliases", {}, ("vessel", "alias", "parameter_set_id"))
    return dict(sorted(((vessel, alias), name) for vessel, alias, name in rows.rows()))


def _pointed(rows: pl.DataFrame) -> dict[str, str]:
    """Return the parameter set id of every alias in the rows of one vessel, sorted by alias."""
    return dict(sorted(zip(rows["alias"].to_list(), rows["parameter_set_id"].to_list(), strict=True)))


def _require_name(alias: str) -> None:
    if not _NAME.fullmatch(alias) or alias.startswith("ps-"):
        raise UsageError(
            "alias_invalid",
            f"{alias!r} cannot name a parameter set; expected a letter, then letters, digits, dots, hyphens or "
            "underscores, and nothing that looks like an id.",
            "Choose a name such as 'as-built' or 'after-docking'.",
        )


def withdraw(warehouse: Warehouse, vessel: str) -> bool:
    """Let ``current`` of a vessel point to nothing; which set it was stays known as ``withdrawn``.

    Returns
    -------
    bool
        Whether it pointed to anything before; else there is no commit.
    """
    key = vessel_key(vessel)

    def attempt() -> bool:
        with delta.ensured(warehouse, "aliases") as table:
            known = delta.rows(table, "aliases", {"vessel_key": key, "alias": CURRENT}).rows(named=True)
            if not known:
                return False
            both = f"vessel_key = {quoted(key)} AND {one_of('alias', _in_place_of(CURRENT))}"
            delta.replace(table, "aliases", [{**row, "alias": WITHDRAWN} for row in known], both)
            return True

    return with_retry(attempt)
