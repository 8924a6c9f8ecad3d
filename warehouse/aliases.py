"""Names that point to a parameter set, such as ``current``. They move; the sets they point to never change."""

from __future__ import annotations

from schemas.errors import UsageError
from warehouse import delta, parameter_sets
from warehouse.keys import quoted, vessel_key
from warehouse.retry import with_retry
from warehouse.store import Warehouse

CURRENT = "current"


def point(warehouse: Warehouse, vessel: str, parameter_set_id: str, alias: str = CURRENT) -> bool:
    """Let an alias of a vessel point to one of her parameter sets; the latest call wins.

    Returns
    -------
    bool
        Whether it pointed elsewhere before; else there is no commit.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_parameter_set``.
    UsageError
        ``set_of_another_vessel``.
    """
    found = parameter_sets.get(warehouse, parameter_set_id)
    if found.vessel != vessel:
        raise UsageError(
            "set_of_another_vessel",
            f"{found.parameter_set_id} is a parameter set of {found.vessel!r}, not of {vessel!r}.",
            f"List hers with `kempf params list --vessel {vessel!r}`.",
            {"parameter_set_id": found.parameter_set_id, "vessel": found.vessel},
        )
    key = vessel_key(vessel)
    row = {"vessel_key": key, "vessel": vessel, "alias": alias, "parameter_set_id": found.parameter_set_id}

    def attempt() -> bool:
        with delta.ensured(warehouse, "aliases") as table:
            stored = delta.rows(table, "aliases", {"vessel_key": key, "alias": alias})
            if stored["parameter_set_id"].to_list() == [found.parameter_set_id]:
                return False
            predicate = f"vessel_key = {quoted(key)} AND alias = {quoted(alias)}"
            delta.replace(table, "aliases", [row], predicate)
            return True

    return with_retry(attempt)


def of_vessel(warehouse: Warehouse, vessel: str) -> dict[str, str]:
    """Return the parameter set id of every alias of a vessel, sorted by alias."""
    frame = delta.read(warehouse, "aliases", {"vessel_key": vessel_key(vessel)})
    return dict(sorted(zip(frame["alias"].to_list(), frame["parameter_set_id"].to_list(), strict=True)))


def withdraw(warehouse: Warehouse, vessel: str, alias: str = CURRENT) -> bool:
    """Let an alias of a vessel point to nothing.

    Returns
    -------
    bool
        Whether it pointed to anything before; else there is no commit.
    """
    key = vessel_key(vessel)

    def attempt() -> bool:
        with delta.ensured(warehouse, "aliases") as table:
            if delta.rows(table, "aliases", {"vessel_key": key, "alias": alias}).height == 0:
                return False
            delta.replace(table, "aliases", [], f"vessel_key = {quoted(key)} AND alias = {quoted(alias)}")
            return True

    return with_retry(attempt)
