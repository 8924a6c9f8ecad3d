"""The job that makes again what is damaged in a warehouse, from sealed copies and from the raw logs.

Commits are put back from their copies. Data files that are not what was written are taken out of their table and kept
aside; what they held of logs is read again from the raw bytes, registers of logs and vessels are made again from what
is kept beside these. What people said (corrections, notes, aliases) and parameter sets of earlier code cannot be made
again, and are counted.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kempf.flows.jobs import search_log
from kempf.flows.jobs.ingest_logs import ingest_log, look_through
from kempf.flows.jobs.spool import spooled
from kempf.flows.process.progress import Progress, silent
from kempf.flows.process.wrap_error import wrapped
from kempf.schemas.errors import KempfError
from kempf.schemas.instants import month_of
from kempf.schemas.profile import parse
from kempf.schemas.tables import TABLES
from kempf.warehouse import corrections, delta, logs, lost, raw, readings, seals, vessels
from kempf.warehouse.deposit import describe_all
from kempf.warehouse.equivalents import code_of, codes_of
from kempf.warehouse.keys import vessel_key
from kempf.warehouse.logs import LogRow
from kempf.warehouse.migrations.chain import repair_marker
from kempf.warehouse.store import Warehouse
from kempf.warehouse.verify import ASIDE, UNFINISHED, Problem, verify

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
        outcome.done.append("The file that marks the warehouse was written anew.")
    warehouse.require()
    _recall(warehouse, outcome)
    if warehouse.folder is not None:
        for name in TABLES:
            progress(0, 1, f"table {name}")
            try:
                _table(warehouse, warehouse.folder / name, name, outcome)
            except KempfError as error:  # the other tables are repaired all the same
                outcome.gone.append(f"the table {name}: {error.message}")
    _profiles(warehouse, outcome)
    _removed_again(warehouse, outcome)
    _each(warehouse, outcome, progress, _missing_logs(warehouse, outcome), _taken_in)
    _each(warehouse, outcome, progress, _unread_logs(warehouse, outcome), _read_again)
    describe_all(warehouse)
    if not _unread_left(outcome):
        warehouse.delete(*UNFINISHED)
    outcome.left = verify(warehouse, lambda what: progress(0, 1, what))
    outcome.gone += [
        f"{problem.words} Ingest the original file again." for problem in outcome.left if problem.kind == "raw log"
    ]
    return outcome


def _table(warehouse: Warehouse, folder: Path, name: str, outcome: Repaired) -> None:
    """Put the log of a table back, and take its damaged files out."""
    if not folder.is_dir():
        return
    outcome.done += seals.repair_log(folder, name)
    if not (folder / "_delta_log").is_dir():
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
            if name not in _OF_LOGS and name != "logs":
                outcome.gone.append(f"{amount} of the table {name}{_AFTER.get(name, '')}")
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
    "vessels": ": profiles are made again from what is kept beside the raw logs",
    "parameter_sets": ": those of the present code are made again by `kempf reprocess`",
    "aliases": ": which set is current is chosen anew by `kempf reprocess`",
    "diagnoses": ": `kempf diagnose` makes them again",
    "diagnosis_evidence": ": `kempf diagnose` makes them again",
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
) -> None:
    """Repair logs one by one; one that cannot be stops no other."""
    for done, name in enumerate(names):
        progress(done, len(names), f"log {name[:12]}")
        try:
            outcome.done.append(repair_one(warehouse, name))
        except Exception as error:  # noqa: BLE001 - whatever it is, the next log must not pay for it
            outcome.gone.append(f"the log {name}: {wrapped(error).message}")


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


def _missing_logs(warehouse: Warehouse, outcome: Repaired) -> list[str]:
    """Return the raw logs that should count, by what is kept beside them, and that no register lets count."""
    current = {row.log_id for row in logs.current(warehouse)}
    known = current if outcome.registers else {row.log_id for row in logs.all_ingests(warehouse)}
    described = {name: raw.described(warehouse, name) for name in raw.kept(warehouse) if name not in known}
    return [name for name, facts in described.items() if facts is not None and not facts.get("removed")]


def _taken_in(warehouse: Warehouse, name: str) -> str:
    """Take a log in again from its raw bytes and what is kept beside them."""
    facts = raw.described(warehouse, name)
    assert facts is not None
    profile = parse(facts["profile"], f"raw/{name}.json")
    with raw.opened(warehouse, name) as log:
        outcome = ingest_log(warehouse, facts["vessel"], facts["file_name"], log, profile, facts["file_name"])
    return f"{facts['file_name']} of {facts['vessel']} was taken in again from its raw bytes ({outcome.outcome})."


def _profiles(warehouse: Warehouse, outcome: Repaired) -> None:
    """Register the profiles again that logs were read with and that are lost, those of later logs last."""
    known = {version.profile_sha256 for version in vessels.all_versions(warehouse)}
    rows = [*logs.removed(warehouse), *logs.current(warehouse)]
    lost = [row for row in rows if row.profile_sha256 not in known]
    now = vessels.profiles(warehouse)
    for row in lost:
        facts = raw.described(warehouse, row.log_id)
        if facts is not None:
            vessels.register(warehouse, row.vessel, parse(facts["profile"], f"raw/{row.log_id}.json"))
    for vessel in sorted({row.vessel for row in lost} & now.keys()):
        vessels.register(warehouse, vessel, now[vessel])  # what was current and not lost stays current
    removed = {row.vessel for row in lost} - {row.vessel for row in logs.current(warehouse)} - now.keys()
    for vessel in sorted(removed):
        vessels.remove(warehouse, vessel, "her logs were removed")
    if lost:
        outcome.done.append(f"Profiles were registered again: {', '.join(sorted({row.vessel for row in lost}))}.")


def _unread_logs(warehouse: Warehouse, outcome: Repaired) -> list[str]:
    """Return the logs of which something that their bytes gave is missing, and that the present code has read."""
    code = code_of(warehouse, "ingest")
    rows = [row for row in logs.current(warehouse) if row.code_version == code]
    held = delta.distinct(warehouse, "readings", "ingest_id")
    examined = delta.distinct(warehouse, "examinations", "ingest_id")

    def whole(row: LogRow) -> bool:
        key = vessel_key(row.vessel)
        touched = f"{key} {month_of(row.start_utc_ns)}" in outcome.months
        touched = touched or not outcome.vessel_keys.isdisjoint({None, key})
        return not touched and row.ingest_id in held and row.ingest_id in examined

    return [row.log_id for row in rows if not whole(row)]


def _unread_left(outcome: Repaired) -> bool:
    """Return whether a log that was to be read again could not be."""
    return any(words.startswith("the log ") for words in outcome.gone)


def _read_again(warehouse: Warehouse, name: str) -> str:
    """Read a log again and put all that its bytes give in place of what is stored of it."""
    row = logs.by_prefix(warehouse, name)
    profile = vessels.get(warehouse, row.profile_sha256)
    log_corrections = corrections.of_logs(warehouse, [name]).get(name, ())
    with raw.opened(warehouse, name) as log, spooled(row.file_name, log, profile) as read:
        looked_through = look_through(
            row.vessel, row.file_name, log, profile, read, log_corrections, codes_of(warehouse)
        )
        if looked_through.found.examination.ingest_id != row.ingest_id:
            raise KempfError(
                "other_ingest", f"{row.file_name} is read with other code now.", "Run `kempf reprocess`.", {"log": name}
            )
        search_log.store(warehouse, [looked_through.found])
        batch = [(row, read)]
        readings.write(warehouse, batch)
        readings.write_rejected(warehouse, batch)
        lost.write(warehouse, batch)
    return f"{row.file_name} of {row.vessel} was read again from its raw bytes."
