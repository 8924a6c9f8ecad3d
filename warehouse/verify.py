"""Whether everything is there and as it was written: raw logs, the files of every table, and what refers to what."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from kempf.schemas.errors import KempfError
from kempf.schemas.tables import TABLES
from kempf.warehouse import delta, logs, raw, seals, vessels
from kempf.warehouse.deposit import description
from kempf.warehouse.store import Warehouse

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

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return asdict(self)


Look = Callable[[str], None]


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
            yield Problem("raw log", "raw", name, f"The raw log {name} is damaged: its bytes do not have this hash.")


def damages(warehouse: Warehouse, name: str) -> list[Problem]:
    """Return what is damaged of one table, that which its newest version rests on first."""
    if warehouse.folder is None:
        return _readable(warehouse, name)
    folder = warehouse.folder / name
    if not (folder / "_delta_log").is_dir():
        lost = seals.sealed_versions(folder)
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

    rows = column("logs", "log_id", "ingest_id", "profile_sha256", "vessel")
    kept = set(raw.kept(warehouse))
    log_ids = {row[0] for row in rows or ()}
    purged = _values_of(warehouse, "purges", "log_id")
    for log_id in sorted(log_ids - kept - purged):
        yield Problem("reference", "logs", log_id, f"The log {log_id} is not kept as delivered.")
    profiles = {row[0] for row in column("vessels", "profile_sha256") or ()}
    for hash_ in sorted({row[2] for row in rows or ()} - profiles):
        yield Problem("reference", "vessels", hash_, f"The profile {hash_} that logs were read with is lost.")
    ingests = {row[1] for row in rows or () if row[0] not in purged}
    yield from _half_purged(warehouse, purged & kept, {row[1]: row[0] for row in rows or () if row[0] in purged})
    for name in ("readings", "examinations"):
        held = _ingests_of(warehouse, name)
        if held is not None and rows is not None:
            for ingest in sorted(ingests - held):
                yield Problem("reference", name, ingest, f"Of the ingest {ingest} there is nothing in {name}.")
    sets = column("parameter_sets", "parameter_set_id")
    if rows is not None and sets is not None:
        yield from _of_sets(warehouse, log_ids, {row[0] for row in sets})
    known = set() if rows is None else {*log_ids}
    for log_id in sorted(kept - known) if rows is not None else ():
        facts = raw.described(warehouse, log_id)
        if facts is not None and not facts.get("removed"):
            words = f"The raw log {log_id} ({facts['file_name']} of {facts['vessel']}) is in no table."
            yield Problem("reference", "logs", log_id, words)
        if raw.is_half_described(warehouse, log_id):
            words = f"The raw log {log_id} is in no table, and what is kept beside it is damaged."
            yield Problem("raw log", "raw", f"{log_id}.json", words)
    yield from _descriptions(warehouse)


def _half_purged(warehouse: Warehouse, kept: set[str], ingests: dict[str, str]) -> Iterator[Problem]:
    """Yield the logs that were to be deleted for good and of which something is still there."""
    there = {ingests[ingest] for ingest in (_ingests_of(warehouse, "readings") or set()) & ingests.keys()}
    for log_id in sorted(kept | there):
        words = f"Of the purged log {log_id} something is still there: `kempf purge {log_id[:12]}` goes on."
        yield Problem("reference", "purges", log_id, words)


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
    for name, column, kind, there in (
        ("parameter_sets", "log_ids", "log", log_ids),
        ("aliases", "parameter_set_id", "parameter set", set_ids),
        ("diagnoses", "parameter_set_id", "parameter set", set_ids),
    ):
        for value in sorted(_values_of(warehouse, name, column) - there):
            yield Problem("reference", name, value, f"The {kind} {value} that {name} refer to is lost.")


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
