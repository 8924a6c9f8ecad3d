"""The registers of vessels, logs and purges are made again from what is kept beside the raw logs."""

from __future__ import annotations

import shlex

from kempf.flows.jobs.repair.repaired import Repaired
from kempf.flows.jobs.state.former_vessel import moved_to, reason_of_rename
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, purges, raw, vessels
from kempf.warehouse.upkeep.verify import ingests_with_profile, kept_profile


def put_receipts_back(warehouse: Warehouse, outcome: Repaired) -> None:
    """Put the receipts of purges back into their table, and where the raw logs were."""
    held = purges.of_logs(warehouse)
    for log_id, purge in purges.noted(warehouse).items():
        if log_id not in held:
            purges.add(warehouse, purge)
            outcome.done.append(f"The receipt of the purge of {purge.file_name} of {purge.vessel} was put back.")
    purges.note_all(warehouse)


def register_profiles(warehouse: Warehouse, outcome: Repaired) -> None:
    """Register the profiles again that logs were read with and that are lost, those of later logs last."""
    known = vessels.all_versions(warehouse)
    hashes, before = {version.profile_sha256 for version in known}, {version.vessel for version in known}
    now, removed = vessels.profiles(warehouse), vessels.removed(warehouse)
    again: set[str] = set()
    for row in ingests_with_profile(warehouse):
        profile = kept_profile(warehouse, row.log_id) if row.profile_sha256 not in hashes else None
        if profile is not None and vessels.register(warehouse, row.vessel, profile):
            again.add(row.vessel)
    counting = {row.vessel for row in logs.current(warehouse)}
    for vessel in sorted(again & now.keys()):
        vessels.register(warehouse, vessel, now[vessel])  # what was current and not lost stays current
    for vessel in sorted((again & removed.keys()) - counting):
        vessels.remove(warehouse, vessel, removed[vessel])
    of_logs = {row.vessel for row in logs.all_ingests(warehouse)}
    for vessel in sorted(of_logs - before - counting):
        again |= _without_logs(warehouse, vessel, outcome)
    if again:
        outcome.done.append(f"Profiles were registered again: {', '.join(sorted(again))}.")


def _without_logs(warehouse: Warehouse, vessel: str, outcome: Repaired) -> set[str]:
    """Let a vessel who is lost from the register, and of whose logs none counts, be what her logs show she was.

    Where all of them went to one vessel she was renamed. Else nobody knows whether she was removed with her logs.
    Return her where she was registered.
    """
    rows = logs.removed(warehouse, vessel)
    last = logs.find(warehouse, [row.log_id for row in rows])
    moves = [moved_to(row.removed or "") if last[row.log_id].vessel != vessel else None for row in rows]
    names = {None if one is None else one[0] for one in moves}
    beside = [profile for row in rows if (profile := kept_profile(warehouse, row.log_id)) is not None]
    if beside and len(names) == 1 and moves[-1] is not None:
        name, reason = moves[-1]
        vessels.register(warehouse, vessel, beside[-1].model_copy(update={"vessel": vessel}))
        vessels.remove(warehouse, vessel, reason_of_rename(name, reason))
        outcome.done.append(f"{vessel} has the name {name} now, as before: all her logs went there.")
        return {vessel}
    if vessel in vessels.names(warehouse):
        outcome.gone.append(
            f"whether {vessel!r} was removed or renamed, of whose logs none counts: she counts again; "
            f"`kempf vessels remove {shlex.quote(vessel)} --reason TEXT` takes her out"
        )
    elif outcome.vessels:
        words = f"the profile of {vessel!r}, of whose logs none counts, and whether she was removed or renamed"
        if words not in outcome.gone:
            outcome.gone.append(words)
    return set()


def remove_again(warehouse: Warehouse, outcome: Repaired) -> None:
    """Let logs count no longer of which it is kept beside them that they were removed, or that they are another's."""
    if not outcome.registers:
        return
    for row in logs.current(warehouse):
        facts = raw.described(warehouse, row.log_id)
        if facts is not None and (facts.get("removed") or facts["vessel"] != row.vessel):
            reason = facts.get("removed") or f"moved to {facts['vessel']!r}"
            logs.mark(warehouse, [row.log_id], reason)
            outcome.done.append(f"{row.file_name} of {row.vessel} counts no longer, as before: {reason}.")
