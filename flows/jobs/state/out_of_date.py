"""What of a warehouse the present code, or the present profile of a vessel, would make anew. Nothing is stored.

Commands that read work on what is stored and print one of these sentences.
"""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence

from kempf.flows.jobs.state.withdrawn_set import why_withdrawn
from kempf.schemas.enumeration import counted
from kempf.warehouse.queries.standing import standing_ids
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, corrections, examinations, logs, parameter_sets, vessels
from kempf.warehouse.tables.equivalents import code_of
from kempf.warehouse.tables.logs import LogRow
from kempf.warehouse.tables.parameter_set import ParameterSet

_OLDER = "with an older profile or another version of kempf"


def unread(warehouse: Warehouse, rows: Sequence[LogRow], profiles: Mapping[str, str]) -> list[LogRow]:
    """Return those of some logs that were read by other code than the present or with another profile.

    Parameters
    ----------
    profiles : mapping of str to str
        Hash of the present profile by vessel.
    """
    code = code_of(warehouse, "ingest")
    return [row for row in rows if (row.code_version, row.profile_sha256) != (code, profiles.get(row.vessel))]


def unsearched(warehouse: Warehouse, rows: Sequence[LogRow]) -> list[LogRow]:
    """Return those of some logs that were looked through by other code or with other corrections, or never."""
    code = code_of(warehouse, "segment")
    bases = examinations.codes(warehouse, [row.ingest_id for row in rows], {row.vessel for row in rows})
    corrections_by_log = corrections.of_logs(warehouse, [row.log_id for row in rows])
    return [
        row
        for row in rows
        if bases.get(row.ingest_id) != corrections.basis(code, corrections_by_log.get(row.log_id, ()))
    ]


def said_of_logs(warehouse: Warehouse, vessel: str | None = None) -> str | None:
    """Return the sentence that logs of one vessel or of all are out of date; None where none is.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    stale = _stale(warehouse, vessel)
    if not stale:
        return None
    whose = f" of {next(iter(stale))}" if len(stale) == 1 else f" of {len(stale)} vessels"
    return f"{counted(stale.total(), 'log')}{whose} read {_OLDER}; next: {command_for(stale)}"


def said_of_vessel(warehouse: Warehouse, vessel: str) -> str | None:
    """Return the sentence that a vessel's logs or parameter sets are out of date; None where neither are.

    Sets are where other code made all of them, where her current one is superseded, and where it was withdrawn.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    stale = _stale(warehouse, vessel).total()
    codes = parameter_sets.codes(warehouse, vessel)
    old = bool(codes) and code_of(warehouse, "estimate") not in codes
    parts = [f"{counted(stale, 'log')} read"] * bool(stale) + ["parameter sets made"] * old
    said = [f"{' and '.join(parts)} {_OLDER}"] if parts else []
    pointed = aliases.of_vessel(warehouse, vessel)
    current, withdrawn = pointed.get(aliases.CURRENT), pointed.get(aliases.WITHDRAWN)
    commands = [command_for([vessel])]
    if current is None and withdrawn is not None:
        why, helping = why_withdrawn(warehouse, vessel, withdrawn)
        # with logs or sets that are out of date it may be these
        commands = [*dict.fromkeys([*commands * bool(parts), *helping])]
        said.append(f"no parameter set is current, since {why}")
    # of other code every set is superseded, which is said already
    elif current is not None and not old and current not in standing_ids(warehouse, vessel):
        said.append(
            f"the current parameter set {current} is superseded: her logs, her manoeuvres or the code have changed "
            "since it was made"
        )
    return f"{vessel}: {'; '.join(said)}; next: {', '.join(commands)}" if said else None


def said_of_sets(warehouse: Warehouse, sets: Iterable[ParameterSet]) -> str | None:
    """Return the sentence that some parameter sets are of other code than the present; None where none is."""
    code = code_of(warehouse, "estimate")
    old = [stored for stored in sets if stored.provenance.get("code_version") != code]
    if not old:
        return None
    names = ", ".join(stored.parameter_set_id for stored in old)
    return f"{names}: made with another version of kempf; next: {command_for({stored.vessel for stored in old})}"


def _stale(warehouse: Warehouse, vessel: str | None) -> Counter[str]:
    """Count the logs, by vessel, that were not read and looked through by the present code with the present profile."""
    rows = logs.current(warehouse, vessel)
    old = unread(warehouse, rows, vessels.current_hashes(warehouse, vessel))
    names = {row.ingest_id for row in old}
    old += unsearched(warehouse, [row for row in rows if row.ingest_id not in names])
    return Counter(row.vessel for row in old)


def command_for(names: Collection[str]) -> str:
    """Return the command that brings one vessel up to date, of several the whole fleet, as a shell takes it."""
    only = f" --vessel {shlex.quote(next(iter(names)))}" if len(names) == 1 else ""
    return f"kempf reprocess{only}"
