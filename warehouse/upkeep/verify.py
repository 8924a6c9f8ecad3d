"""Whether everything is there and as it was written: raw logs, the files of every table, and what refers to what."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from kempf.schemas.errors import KempfError
from kempf.schemas.profile import VesselProfile, parse
from kempf.schemas.tables import TABLES
from kempf.warehouse.storage import delta, seals
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, logs, purges, raw, vessels
from kempf.warehouse.tables.deposit import description
from kempf.warehouse.tables.equivalents import code_of
from kempf.warehouse.tables.logs import LogRow

#: where a repair keeps damaged files aside, below the warehouse, and what it has still to do where it was cut off
ASIDE = "damaged"
UNFINISHED = (ASIDE, "unfinished.json")

Kind = Literal["raw log", "table", "reference"]


@dataclass(frozen=True)
class Problem:
    """One thing that is not as it should be."""

    kind: Kind
    #: Which table; ``raw`` for raw logs.
    table: str
    #: Path below the warehouse, or an id.
    where: str
    #: What is wrong, one sentence.
    words: str
    #: Whether the newest version of the table is not touched by it: only what was known earlier cannot be read.
    past: bool = False
    #: What helps where `kempf repair` does not, one sentence; None where it does.
    next_step: str | None = None

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return asdict(self)


Look = Callable[[str], None]

_ORIGINAL = "Ingest the original file again."
_WITH_PROFILE = "Ingest the original files again with the profile."


def verify(warehouse: Warehouse, look: Look = lambda what: None) -> list[Problem]:
    """Check everything.

    Parameters
    ----------
    look : callable, optional
        Called with what is looked at next.

    Returns
    -------
    list of Problem
        Empty where all is well.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    warehouse.require()
    problems = [*_raw(warehouse, look)]
    for name in TABLES:
        look(f"table {name}")
        problems += damages(warehouse, name)
    look("references")
    return [*problems, *unfinished(warehouse), *_references(warehouse)]


def unfinished(warehouse: Warehouse) -> Iterator[Problem]:
    """Yield the repair that was not finished, where there is one."""
    if warehouse.read_bytes(*UNFINISHED) is not None:
        yield Problem("reference", "readings", "/".join(UNFINISHED), "A repair was not finished.")


def _raw(warehouse: Warehouse, look: Look) -> Iterator[Problem]:
    for name in raw.kept(warehouse):
        look(f"raw log {name[:12]}")
        if not raw.is_whole(warehouse, name):
            words = f"The raw log {name} is damaged: its bytes do not have this hash."
            yield Problem("raw log", "raw", name, words, next_step=_ORIGINAL)


def damages(warehouse: Warehouse, name: str) -> list[Problem]:
    """Return what is damaged of one table, that which its newest version rests on first."""
    if delta.is_gone(warehouse, name):
        return [Problem("table", name, name, f"The table {name} is gone.")]
    if warehouse.folder is None:
        return _readable(warehouse, name)
    folder = warehouse.folder / name
    if not (folder / "_delta_log").is_dir():
        lost = seals.sealed_versions(folder)  # of a table that nobody has written to since its loss is noticed
        return [Problem("table", name, name, f"The table {name} is gone.")] if lost else []
    newest = max(seals.sealed_versions(folder), default=-1)
    problems = [_problem(damage) for damage in seals.damages_of_log(folder, name, newest)]
    problems += [_problem(damage) for damage in seals.torn_commits(folder, name)]
    if any(problem.where.startswith(f"{name}/_delta_log/") for problem in problems):
        return problems  # which files count is not known before the log is whole
    opened = _opened(warehouse, name)
    if isinstance(opened, Problem):
        return [*problems, opened]
    live = {Path(path) for path in opened}
    for path in sorted(live | set(folder.rglob("*.parquet"))):
        if folder / "_delta_log" in path.parents or (path not in live and not path.exists()):
            continue
        damage = seals.damage_of_file(folder, name, path)
        if damage is not None:
            problems.append(_problem(damage, past=path not in live and damage.what != "seal"))
    return problems if any(not problem.past for problem in problems) else [*problems, *_readable(warehouse, name)]


def _opened(warehouse: Warehouse, name: str) -> list[str] | Problem:
    """Return the files of the newest version of a table, or why it cannot be opened."""
    try:
        table = delta.open_table(warehouse, name)
    except KempfError as error:
        return Problem("table", name, name, error.message)
    return [] if table is None else table.file_uris()


def _readable(warehouse: Warehouse, name: str) -> list[Problem]:
    """Return why a table cannot be read, a file that is not sealed for example; nothing where it can."""
    try:
        with delta.lent(warehouse, name) as rows:
            # every column, a batch at a time: readings may be large
            for batch in rows.collect_batches():
                del batch
    except Exception as error:  # noqa: BLE001 - whatever it is, it is what is to be reported
        return [Problem("table", name, name, f"The table {name} cannot be read: {error}")]
    return []


def _problem(damage: seals.Damage, *, past: bool = False) -> Problem:
    rest = "; the newest version does not need it" if past else ""
    words = f"The {damage.what} {damage.path} is damaged: {damage.why}{rest}."
    return Problem("table", damage.table, damage.path, words, past)


def _references(warehouse: Warehouse) -> Iterator[Problem]:
    """Yield what refers to something that is not there, as far as the tables can be read."""

    def column(name: str, *columns: str) -> list[tuple[Any, ...]] | None:
        try:
            return sorted(set(delta.read(warehouse, name, columns=columns).rows()), key=repr)
        except Exception:  # noqa: BLE001 - it is reported as damaged already
            return None

    rows = column("logs", "log_id", "ingest_id")
    kept = set(raw.kept(warehouse))
    log_ids = {row[0] for row in rows or ()}
    noted = purges.noted(warehouse)
    purged = _values_of(warehouse, "purges", "log_id") | noted.keys()
    for log_id in sorted(log_ids - kept - purged):
        yield Problem("reference", "logs", log_id, f"The log {log_id} is not kept as delivered.", next_step=_ORIGINAL)
    yield from _of_profiles(warehouse)
    yield from _receipts(warehouse, noted)
    yield from _half_purged(warehouse, purged & kept, {row[1]: row[0] for row in rows or () if row[0] in purged})
    yield from _of_ingests(warehouse)
    sets = column("parameter_sets", "parameter_set_id")
    if rows is not None and sets is not None:
        yield from _of_sets(warehouse, log_ids | purged, {row[0] for row in sets})
    for log_id in sorted(kept - log_ids - purged) if rows is not None else ():
        facts = raw.described(warehouse, log_id)
        if facts is not None:
            words = f"The raw log {log_id} ({facts['file_name']} of {facts['vessel']}) is in no table."
            yield Problem("reference", "logs", log_id, words)
        if raw.is_half_described(warehouse, log_id):
            words = f"The raw log {log_id} is in no table, and what is kept beside it is damaged."
            yield Problem("raw log", "raw", f"{log_id}.json", words, next_step=_ORIGINAL)
    yield from _descriptions(warehouse)


def ingests_with_profile(warehouse: Warehouse) -> list[LogRow]:
    """Return the ingests of which the profile must be known: those that count, and removed ones that can be restored.

    Beside a raw log only the profile of its last ingest is kept. Removed ones come first.
    """
    purged = purges.of_logs(warehouse)
    return [row for row in (*logs.removed(warehouse), *logs.current(warehouse)) if row.log_id not in purged]


def kept_profile(warehouse: Warehouse, log_id: str) -> VesselProfile | None:
    """Return the profile that is kept beside a raw log; None where it is not, or damaged."""
    facts = raw.described(warehouse, log_id)
    try:
        return None if facts is None else parse(facts["profile"], f"raw/{log_id}.json")
    except KempfError:
        return None


def _of_profiles(warehouse: Warehouse) -> Iterator[Problem]:
    """Yield the profiles that logs were read with and that are lost."""
    try:
        known = {version.profile_sha256 for version in vessels.all_versions(warehouse)}
        lost = [row for row in ingests_with_profile(warehouse) if row.profile_sha256 not in known]
        now = vessels.profiles(warehouse)
    except Exception:  # noqa: BLE001 - it is reported as damaged already
        return
    for hash_ in sorted({row.profile_sha256 for row in lost}):
        rows = [row for row in lost if row.profile_sha256 == hash_]
        beside = [kept_profile(warehouse, row.log_id) for row in rows]
        what = None
        if not any(profile is not None and profile.sha256 == hash_ for profile in beside):
            readable = all(row.vessel in now and row.removed is None for row in rows)
            what = "`kempf reprocess` reads them with the present profile." if readable else _WITH_PROFILE
        words = f"The profile {hash_} that logs were read with is lost."
        yield Problem("reference", "vessels", hash_, words, next_step=what)


def ingests_to_hold(warehouse: Warehouse) -> tuple[list[LogRow], list[LogRow]]:
    """Return the ingests of which the tables must hold what the bytes of the logs gave, and those they need not.

    They must of what counts now, whatever code read it, and of all that the present code reads from the bytes again: a
    log that was removed may be restored. What earlier code read of other logs, or a profile that is lost gave of logs
    that were read again since, nobody can make again, and nobody needs. Those of purged logs are in neither.
    """
    code = code_of(warehouse, "ingest")
    purged = purges.of_logs(warehouse)
    ingests = {row.ingest_id: row for row in logs.all_ingests(warehouse) if row.log_id not in purged}
    counting = {row.ingest_id for row in logs.current(warehouse)}
    known = {version.profile_sha256 for version in vessels.all_versions(warehouse)}
    last = {row.ingest_id for row in ingests_with_profile(warehouse)}

    def can_be_read(row: LogRow) -> bool:
        return row.code_version == code and (row.ingest_id in last or row.profile_sha256 in known)

    must = {name: row for name, row in ingests.items() if name in counting or can_be_read(row)}
    return list(must.values()), [row for name, row in ingests.items() if name not in must]


def _of_ingests(warehouse: Warehouse) -> Iterator[Problem]:
    """Yield the ingests of which a table that must hold something holds nothing."""
    try:
        must, _ = ingests_to_hold(warehouse)
        code = code_of(warehouse, "ingest")
    except Exception:  # noqa: BLE001 - it is reported as damaged already
        return
    for name in ("readings", "examinations"):
        held = _ingests_of(warehouse, name)
        if held is None:
            continue
        for row in sorted(must, key=lambda row: row.ingest_id):
            if row.ingest_id not in held:
                words = f"Of the ingest {row.ingest_id} there is nothing in {name}."
                by_others = row.code_version != code
                what = "It was read by earlier code: `kempf reprocess` reads the log again." if by_others else None
                yield Problem("reference", name, row.ingest_id, words, next_step=what)


def _receipts(warehouse: Warehouse, noted: Iterable[str]) -> Iterator[Problem]:
    """Yield the purges of which the receipt is kept where the raw log was, and is not in its table."""
    for log_id in sorted(set(noted) - _values_of(warehouse, "purges", "log_id")):
        words = f"The receipt of the purge of the log {log_id} is lost: the log would be taken in again."
        yield Problem("reference", "purges", log_id, words)


def _half_purged(warehouse: Warehouse, kept: set[str], ingests: dict[str, str]) -> Iterator[Problem]:
    """Yield the logs that were to be deleted for good and of which something is still there."""
    there = {ingests[ingest] for ingest in (_ingests_of(warehouse, "readings") or set()) & ingests.keys()}
    for log_id in sorted(kept | there):
        words = f"Of the purged log {log_id} something is still there."
        what = f"`kempf purge {log_id[:12]} --reason TEXT` deletes it."
        yield Problem("reference", "purges", log_id, words, next_step=what)


def _descriptions(warehouse: Warehouse) -> Iterator[Problem]:
    """Yield the raw logs beside which something else is kept than the registers say."""
    try:
        known = logs.find(warehouse, raw.kept(warehouse))
        profiles = {version.profile_sha256: version.profile for version in vessels.all_versions(warehouse)}
    except Exception:  # noqa: BLE001 - it is reported as damaged already
        return
    for log_id, row in sorted(known.items()):
        profile = profiles.get(row.profile_sha256)
        if profile is not None and raw.described(warehouse, log_id) != description(row, profile):
            words = f"What is kept beside the raw log {log_id} is not what the registers say of it."
            yield Problem("reference", "raw", f"{log_id}.json", words)


def _of_sets(warehouse: Warehouse, log_ids: set[str], set_ids: set[str]) -> Iterator[Problem]:
    """Yield the logs that sets rest on and the sets that names point to which are lost.

    A diagnosis says all that it found by itself.
    """
    for value in sorted(_values_of(warehouse, "parameter_sets", "log_ids") - log_ids):
        words = f"The log {value} that parameter_sets refer to is lost."
        yield Problem("reference", "parameter_sets", value, words, next_step=_ORIGINAL)
    try:
        pointed = aliases.every(warehouse)
    except Exception:  # noqa: BLE001 - it is reported as damaged already
        return
    for (vessel, alias), value in pointed.items():
        if value in set_ids:
            continue
        words = f"The parameter set {value} that aliases refer to is lost."
        if alias in (aliases.CURRENT, aliases.WITHDRAWN):
            words += f" It was the current model of {vessel!r}."
            what = (
                "`kempf reprocess` cannot know which effects it had: choose another set with `kempf params alias "
                f"current ID --vessel {shlex.quote(vessel)}` (where there is none, after `kempf reprocess`), then add "
                "them again with `kempf effects add`."
            )
        else:
            words += f" It was {alias!r} of {vessel!r}."
            what = f"Choose another set with `kempf params alias {alias} ID --vessel {shlex.quote(vessel)}`."
        yield Problem("reference", "aliases", value, words, next_step=what)


def _values_of(warehouse: Warehouse, name: str, column: str) -> set[str]:
    """Return the values of a column, those of lists one by one; none of a table that cannot be read."""
    try:
        series = delta.read(warehouse, name, columns=(column,))[column]
    except Exception:  # noqa: BLE001 - it is reported as damaged already
        return set()
    values: Iterable[Any] = series.explode() if series.dtype.is_nested() else series
    return {str(value) for value in values if value is not None}


def _ingests_of(warehouse: Warehouse, name: str) -> set[str] | None:
    """Return the ingests that a table has rows of."""
    try:
        return delta.distinct(warehouse, name, "ingest_id")
    except Exception:  # noqa: BLE001 - it is reported as damaged already
        return None
