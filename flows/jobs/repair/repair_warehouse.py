"""The job that makes again what is damaged in a warehouse, from sealed copies and from the raw logs.

Commits are put back from their copies. Data files that are not what was written are taken out of their table and kept
aside; what they held of logs is read again from the raw bytes, registers of logs and vessels are made again from what
is kept beside these. A table that is lost whole is made anew, and filled so. What people said (corrections, notes,
aliases) and parameter sets of earlier code cannot be made again, and are counted.
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from kempf.flows.jobs.ingest import search_log
from kempf.flows.jobs.ingest.ingest_logs import ingest_log, look_through, store
from kempf.flows.jobs.ingest.spool import spooled
from kempf.flows.jobs.state.former_vessel import moved_to, reason_of_rename
from kempf.flows.process.progress import Progress, silent
from kempf.flows.process.wrap_error import wrapped
from kempf.schemas.enumeration import counted
from kempf.schemas.errors import KempfError
from kempf.schemas.instants import month_of
from kempf.schemas.profile import parse
from kempf.schemas.tables import TABLES
from kempf.warehouse import (
    aliases,
    corrections,
    delta,
    logs,
    lost,
    parameter_sets,
    purges,
    raw,
    readings,
    seals,
    vessels,
)
from kempf.warehouse.deposit import describe_all
from kempf.warehouse.equivalents import code_of, codes_of
from kempf.warehouse.keys import vessel_key
from kempf.warehouse.logs import LogRow
from kempf.warehouse.migrations.chain import MARKER_MENDED, repair_marker
from kempf.warehouse.store import Warehouse
from kempf.warehouse.verify import (
    ASIDE,
    UNFINISHED,
    Problem,
    ingests_to_hold,
    ingests_with_profile,
    kept_profile,
    verify,
)

#: tables whose rows come of the bytes of a log and of nothing else
_OF_LOGS = ("readings", "rejected", "lost", "examinations", "segments")


@dataclass
class Repaired:
    """What became of a damaged warehouse."""

    #: done, gone: What was made again, and what is lost for good, a sentence each.
    done: list[str] = field(default_factory=list)
    gone: list[str] = field(default_factory=list)
    #: What is still wrong.
    left: list[Problem] = field(default_factory=list)
    #: Of what logs gave that had to be taken out: months (key of the vessel, blank, month), and keys of vessels; None
    #: stands for all of them.
    months: set[str] = field(default_factory=set)
    vessel_keys: set[str | None] = field(default_factory=set)
    #: How much of the parameter sets is lost, such as "2 rows of the table parameter_sets".
    sets: list[str] = field(default_factory=list)
    #: Whether names of parameter sets are lost.
    names: bool = False
    #: Whether rows of the register of vessels are lost.
    vessels: bool = False
    #: Whether rows of the register of logs had to be taken out: then what is kept beside the raw logs counts.
    registers: bool = False

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return {"done": self.done, "lost": self.gone, "left": [problem.as_json() for problem in self.left]}


def repair(warehouse: Warehouse, progress: Progress = silent) -> Repaired:
    """Make again what is damaged, as far as it can be; a warehouse in which all is well is not touched.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    outcome = Repaired()
    if repair_marker(warehouse):
        outcome.done.append(MARKER_MENDED)
    warehouse.require()
    _recall(warehouse, outcome)
    for name in TABLES:
        progress(0, 1, f"table {name}")
        try:
            if warehouse.folder is not None:
                _table(warehouse, warehouse.folder / name, name, outcome)
            if delta.is_gone(warehouse, name):
                _made_anew(warehouse, name, outcome)
        except KempfError as error:  # the other tables are repaired all the same
            outcome.gone.append(f"the table {name}: {error.message}")
    _receipts(warehouse, outcome)
    _profiles(warehouse, outcome)
    _removed_again(warehouse, outcome)
    missing, present = _missing_logs(warehouse, outcome), vessels.profiles(warehouse)
    _each(warehouse, outcome, progress, missing, _taken_in, "log")
    if missing:
        # what was current stays so, also where a log was last read with an earlier profile
        vessels.register_all(warehouse, list(present.items()))
        _profiles(warehouse, outcome)  # of those that were taken in again as removed ones
    unread = _unread_ingests(warehouse, outcome, frozenset(missing))
    _each(warehouse, outcome, progress, unread, _read_again, "log of the ingest")
    describe_all(warehouse)
    if not _unread_left(outcome):
        warehouse.delete(*UNFINISHED)
    outcome.left = verify(warehouse, lambda what: progress(0, 1, what))
    _sets_lost(outcome)
    if outcome.names:
        _say_models(warehouse, outcome)
    return outcome


def _table(warehouse: Warehouse, folder: Path, name: str, outcome: Repaired) -> None:
    """Put the log of a table back, and take its damaged files out."""
    if not folder.is_dir():
        return
    outcome.done += seals.repair_log(folder, name)
    if not (folder / "_delta_log").is_dir() or delta.is_gone(warehouse, name):
        return
    table = delta.open_table(warehouse, name)
    if table is None:
        return
    live = {Path(path) for path in table.file_uris()}
    every = live | {path for path in folder.rglob("*.parquet") if folder / "_delta_log" not in path.parents}
    outcome.done += seals.repair_seals(folder, name, sorted(every))
    bad = [path for path in sorted(every) if _is_bad(folder, name, path, live)]
    rows = _rows_by_file(table)
    for path in bad:
        if path in live:
            # first: where it ends here, the next repair goes on
            _remember(warehouse, folder, path, name, outcome)
        _put_aside(warehouse, folder, path)
        if path in live:
            count = rows.get(path.name)
            amount = f"{count} rows" if count is not None else "rows"
            outcome.done.append(f"{name}/{path.relative_to(folder).as_posix()} was taken out of its table.")
            _say_lost(f"{amount} of the table {name}", name, outcome)
        else:
            outcome.gone.append(
                f"what the table {name} held earlier in {path.name}; the newest version does not need it"
            )
    if any(path in live for path in bad):
        table.repair()
    seals.seal(table)


def _remember(warehouse: Warehouse, folder: Path, path: Path, name: str, outcome: Repaired) -> None:
    """Note of whom a data file was, where the raw logs give it again, and keep that until it is done."""
    parts = dict(part.partition("=")[::2] for part in path.relative_to(folder).parts[:-1])
    if name == "logs":
        outcome.registers = True
    elif name not in _OF_LOGS:
        return
    elif "month" in parts:
        outcome.months.add(f"{parts['vessel_key']} {parts['month']}")
    else:
        outcome.vessel_keys.add(parts.get("vessel_key"))
    _keep_unfinished(warehouse, outcome)


def _made_anew(warehouse: Warehouse, name: str, outcome: Repaired) -> None:
    """Make a table that is lost whole, without rows; what logs gave of it is read again after."""
    outcome.registers |= name == "logs"
    if name in _OF_LOGS:
        outcome.vessel_keys.add(None)
    if name in (*_OF_LOGS, "logs"):
        _keep_unfinished(warehouse, outcome)  # first, as with single files
    delta.make_anew(warehouse, name)
    outcome.done.append(f"The table {name} was gone, and was made anew.")
    _say_lost(f"the table {name}", name, outcome)


def _say_lost(what: str, name: str, outcome: Repaired) -> None:
    """Say that rows of a table are lost that no log gives again."""
    outcome.names |= name == "aliases"
    outcome.vessels |= name == "vessels"
    if name == "parameter_sets":
        outcome.sets.append(what)
    elif name not in _OF_LOGS and name != "logs":
        outcome.gone.append(f"{what}{_AFTER.get(name, '')}")


def _sets_lost(outcome: Repaired) -> None:
    """Say which parameter sets come again; of those that names point to nobody knows what they were made with."""
    named = any(problem.table == "aliases" and problem.kind == "reference" for problem in outcome.left)
    which = " that no name points to" if named else ""
    for what in outcome.sets:
        outcome.gone.append(f"{what}: those of the present code{which} are made again by `kempf reprocess`")


def _say_models(warehouse: Warehouse, outcome: Repaired) -> None:
    """Name of every vessel without a current set the last one with effects: `kempf reprocess` chooses a plain one."""
    try:
        sets = parameter_sets.summaries(warehouse)
        effects = parameter_sets.specifications(warehouse, sets["parameter_set_id"].to_list())
        times = parameter_sets.stored_at_ms(warehouse)
        current = aliases.holders(warehouse, aliases.CURRENT)
    except KempfError:
        return  # it is named as what is still wrong
    last: dict[str, str] = {}
    for vessel, name in sorted(sets.select("vessel", "parameter_set_id").rows(), key=lambda row: times.get(row[1], 0)):
        if effects[name].get("effects") and vessel not in current:
            last[vessel] = name
    for vessel, name in sorted(last.items()):
        outcome.gone.append(
            f"which set was the current one of {vessel!r}: her last one with effects is {name} "
            f"({', '.join(effects[name]['effects'])}); `kempf params alias current {name} --vessel "
            f"{shlex.quote(vessel)}` before `kempf reprocess` points to it"
        )


def _keep_unfinished(warehouse: Warehouse, outcome: Repaired) -> None:
    content = {
        "months": sorted(outcome.months),
        "vessel_keys": sorted(outcome.vessel_keys, key=str),
        "registers": outcome.registers,
    }
    warehouse.write_bytes(json.dumps(content).encode(), *UNFINISHED)


def _recall(warehouse: Warehouse, outcome: Repaired) -> None:
    """Go on with what an earlier repair did not finish."""
    data = warehouse.read_bytes(*UNFINISHED)
    if data is not None:
        content = json.loads(data)
        outcome.months |= set(content["months"])
        outcome.vessel_keys |= set(content["vessel_keys"])
        outcome.registers = bool(content["registers"])


_AFTER = {
    "vessels": (
        ": profiles are made again from what is kept beside the raw logs, those of earlier ingests and of vessels "
        "without logs are not"
    ),
    "aliases": (
        ": which set is current is chosen anew by `kempf reprocess`, which cannot know the effects of a model; named "
        "aliases are lost, give them again with `kempf params alias NAME ID`"
    ),
    "diagnoses": ": `kempf diagnose` makes them again",
    "diagnosis_evidence": ": `kempf diagnose` makes them again",
    "purges": ": receipts are made again as far as they are kept beside the raw logs",
    "equivalents": ": code that was adopted has to be adopted again with `kempf rerun --all --adopt`",
    "run_history": ": what earlier runs did is not known any more",
    "runs": ": vessels are looked at once more",
    "inbox": ": files are looked at once more",
    "corrections": ": what people said of manoeuvres has to be said again",
    "notes": ": they have to be written again",
}


def _is_bad(folder: Path, name: str, path: Path, live: set[Path]) -> bool:
    damage = seals.damage_of_file(folder, name, path)
    if damage is None and path in live:
        # not sealed, or the seal is that of a file that was cut off before it was sealed
        return not path.exists() or not _can_be_read(path)
    return damage is not None and damage.what != "seal" and (path in live or path.exists())


def _can_be_read(path: Path) -> bool:
    import polars as pl

    try:
        pl.read_parquet(path, glob=False, hive_partitioning=False)
    except Exception:  # noqa: BLE001 - whatever the reader says, it cannot
        return False
    return True


def _rows_by_file(table: Any) -> dict[str, int]:
    import polars as pl

    actions = pl.DataFrame(table.get_add_actions(flatten=True))
    return {str(path).rpartition("/")[2]: int(count) for path, count in actions.select("path", "num_records").rows()}


def _put_aside(warehouse: Warehouse, folder: Path, path: Path) -> None:
    seals.forget(folder, path)
    if path.exists():
        assert warehouse.folder is not None
        aside = warehouse.folder / ASIDE / folder.name
        aside.mkdir(parents=True, exist_ok=True)
        path.replace(aside / path.name)


def _each(
    warehouse: Warehouse,
    outcome: Repaired,
    progress: Progress,
    names: Sequence[str],
    repair_one: Callable[[Warehouse, str], str],
    noun: str,
) -> None:
    """Repair logs one by one; one that cannot be stops no other. They are named by a noun that begins with `log`."""
    for done, name in enumerate(names):
        progress(done, len(names), f"{noun} {name[:12]}")
        try:
            outcome.done.append(repair_one(warehouse, name))
        except Exception as error:  # noqa: BLE001 - whatever it is, the next log must not pay for it
            outcome.gone.append(f"the {noun} {name}: {wrapped(error).message}")


def _removed_again(warehouse: Warehouse, outcome: Repaired) -> None:
    """Let logs count no longer of which it is kept beside them that they were removed, or that they are another's."""
    if not outcome.registers:
        return
    for row in logs.current(warehouse):
        facts = raw.described(warehouse, row.log_id)
        if facts is not None and (facts.get("removed") or facts["vessel"] != row.vessel):
            reason = facts.get("removed") or f"moved to {facts['vessel']!r}"
            logs.mark(warehouse, [row.log_id], reason)
            outcome.done.append(f"{row.file_name} of {row.vessel} counts no longer, as before: {reason}.")


def _receipts(warehouse: Warehouse, outcome: Repaired) -> None:
    """Put the receipts of purges back into their table, and where the raw logs were."""
    held = purges.of_logs(warehouse)
    for log_id, purge in purges.noted(warehouse).items():
        if log_id not in held:
            purges.add(warehouse, purge)
            outcome.done.append(f"The receipt of the purge of {purge.file_name} of {purge.vessel} was put back.")
    purges.note_all(warehouse)


def _missing_logs(warehouse: Warehouse, outcome: Repaired) -> list[str]:
    """Return the raw logs that no register has, and those that should count and that none lets count.

    What is kept beside them says whether they count. Purged ones are left out: they go on being deleted.
    """
    recorded = {row.log_id for row in logs.all_ingests(warehouse)}
    known = {row.log_id for row in logs.current(warehouse)} if outcome.registers else recorded
    left_out = known | purges.of_logs(warehouse).keys()
    described = {name: raw.described(warehouse, name) for name in raw.kept(warehouse) if name not in left_out}
    return [
        name
        for name, facts in described.items()
        if facts is not None and (not facts.get("removed") or name not in recorded)
    ]


def _taken_in(warehouse: Warehouse, name: str) -> str:
    """Take a log in again from its raw bytes and what is kept beside them."""
    facts = raw.described(warehouse, name)
    assert facts is not None
    profile = parse(facts["profile"], f"raw/{name}.json")
    vessel, file_name, removed = facts["vessel"], facts["file_name"], facts.get("removed")
    with raw.opened(warehouse, name) as log:
        if not removed:
            outcome = ingest_log(warehouse, vessel, file_name, log, profile, file_name).outcome
        else:
            with spooled(file_name, log, profile) as read:
                said = corrections.of_logs(warehouse, [name]).get(name, ())
                found = look_through(vessel, file_name, log, profile, read, said, codes_of(warehouse))
                # in one row, so that it never counts in between
                store(warehouse, [replace(found, delivery=replace(found.delivery, removed=removed))])
            outcome = f"removed, as before: {removed}"
    return f"{file_name} of {vessel} was taken in again from its raw bytes ({outcome})."


def _profiles(warehouse: Warehouse, outcome: Repaired) -> None:
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
    """Let a vessel who is lost from the register, and of whose logs none counts, be what her logs tell that she was.

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


def _unread_ingests(warehouse: Warehouse, outcome: Repaired, taken_in: Collection[str]) -> list[str]:
    """Return the ingests of which something that the bytes gave is missing, and that the present code has read.

    Logs that were taken in again just now are whole.
    """
    code = code_of(warehouse, "ingest")
    held = delta.distinct(warehouse, "readings", "ingest_id")
    examined = delta.distinct(warehouse, "examinations", "ingest_id")

    def whole(row: LogRow) -> bool:
        key = vessel_key(row.vessel)
        touched = f"{key} {month_of(row.start_utc_ns)}" in outcome.months
        touched = touched or not outcome.vessel_keys.isdisjoint({None, key})
        touched = touched and row.log_id not in taken_in
        return not touched and row.ingest_id in held and row.ingest_id in examined

    must, others = ingests_to_hold(warehouse)
    touched = [row for row in others if not whole(row)]
    if touched and (outcome.months or outcome.vessel_keys):
        words = "what earlier code, or a profile that is lost, had given of logs that were removed or read again since"
        outcome.gone.append(f"{words} ({counted(len(touched), 'ingest')}); nothing needs it")
    return [row.ingest_id for row in must if row.code_version == code and not whole(row)]


def _unread_left(outcome: Repaired) -> bool:
    """Return whether a log that was to be read again could not be."""
    return any(words.startswith("the log ") for words in outcome.gone)


def _read_again(warehouse: Warehouse, name: str) -> str:
    """Read the log of an ingest again and put all that its bytes give in place of what is stored of it."""
    row = logs.of_ingest(warehouse, name)
    profile = vessels.get(warehouse, row.profile_sha256)
    log_corrections = corrections.of_logs(warehouse, [row.log_id]).get(row.log_id, ())
    with raw.opened(warehouse, row.log_id) as log, spooled(row.file_name, log, profile) as read:
        looked_through = look_through(
            row.vessel, row.file_name, log, profile, read, log_corrections, codes_of(warehouse)
        )
        if looked_through.found.examination.ingest_id != row.ingest_id:
            raise KempfError(
                "other_ingest",
                f"{row.file_name} is read with other code now.",
                "Run `kempf reprocess`.",
                {"log": row.log_id},
            )
        search_log.store(warehouse, [looked_through.found])
        batch = [(row, read)]
        readings.write(warehouse, batch)
        readings.write_rejected(warehouse, batch)
        lost.write(warehouse, batch)
    return f"{row.file_name} of {row.vessel} was read again from its raw bytes."
