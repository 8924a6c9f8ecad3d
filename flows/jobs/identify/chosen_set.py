"""Which parameter set of a vessel a command works on: one that is named, by id or alias, else her current one."""

from __future__ import annotations

from kempf.flows.jobs.state.withdrawn_set import why_withdrawn
from kempf.schemas.errors import NotFound, UsageError
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets, vessels
from kempf.warehouse.tables.parameter_set import ParameterSet


def chosen_set(warehouse: Warehouse, vessel: str, name: str | None = None) -> tuple[ParameterSet, str | None]:
    """Return a parameter set of a vessel and the alias it was chosen by, None where an id named it.

    Parameters
    ----------
    name : str, optional
        An alias of hers, an id, or a unique beginning of one; by default ``current``.

    Raises
    ------
    NotFound
        ``no_vessel``, ``no_parameter_set``: nothing is current, or there is no such set.
    UsageError
        ``set_of_another_vessel``.
    """
    vessels.require(warehouse, vessel)
    pointed = aliases.of_vessel(warehouse, vessel)
    alias = aliases.CURRENT if name is None else name
    if alias in pointed:
        # what was withdrawn may be a set of the name that she had before
        whose = None if alias == aliases.WITHDRAWN else vessel
        return parameter_sets.get(warehouse, pointed[alias], whose), alias
    if name is None and aliases.WITHDRAWN in pointed:
        why, commands = why_withdrawn(warehouse, vessel, pointed[aliases.WITHDRAWN])
        raise NotFound(
            "no_parameter_set",
            f"No parameter set of {vessel!r} is current: {why}.",
            f"What helps: {', '.join(f'`{command}`' for command in commands)}.",
            {"vessel": vessel, "withdrawn": pointed[aliases.WITHDRAWN]},
        )
    if name is None:
        raise NotFound(
            "no_parameter_set",
            f"No parameter set of {vessel!r} is current.",
            f"Make one with `kempf identify --vessel {vessel!r}`, or choose one with `kempf params alias current ID`.",
            {"vessel": vessel},
        )
    return parameter_sets.get_of(warehouse, name, vessel), None


def named_set(warehouse: Warehouse, name: str | None, vessel: str | None = None) -> ParameterSet:
    """Return a parameter set by its id, a unique beginning of it, or an alias that one vessel alone has.

    Parameters
    ----------
    name : str or None
        None for ``current``.
    vessel : str, optional
        Whose alias it is, see `chosen_set`.

    Raises
    ------
    NotFound
        ``no_parameter_set``.
    UsageError
        ``alias_ambiguous``: several vessels have this alias. ``ambiguous_parameter_set``: several ids begin so.
    """
    if vessel is not None:
        return chosen_set(warehouse, vessel, name)[0]
    name = aliases.CURRENT if name is None else name
    if name.startswith("ps-"):
        return parameter_sets.get(warehouse, name)
    held = aliases.holders(warehouse, name)
    if len(held) > 1:
        raise UsageError(
            "alias_ambiguous",
            f"{name!r} names a parameter set of each of {', '.join(held)}.",
            f"Say which vessel, such as with --vessel {min(held)!r}, or give the id that `kempf params list` shows.",
            {"alias": name, "parameter_sets": held},
        )
    return parameter_sets.get(warehouse, held[min(held)] if held else name)
