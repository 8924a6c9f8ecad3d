"""The jobs of a workbench in a SQLite file: what waits, what runs, what came of the others.

It is beside the warehouse and never in it; deleting it costs time only. The id of a job is a hash of what is asked for
and of the state that it is asked of, so that the same request is the same job.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from kempf.flows.process.progress import Figures
from kempf.schemas.errors import KempfError, NotFound, UsageError
from kempf.warehouse.storage.canonical import canonical_json, sha256

QUEUED, RUNNING, DONE, FAILED, CANCELLED = "queued", "running", "done", "failed", "cancelled"
#: states that a job leaves by itself
ACTIVE = (QUEUED, RUNNING)
#: jobs that may wait, and how often one is begun whose process dies
MOST_WAITING, MOST_ATTEMPTS = 100, 2

#: By name, with their columns.
_TABLES = {
    "jobs": """(
        id TEXT PRIMARY KEY, number INTEGER NOT NULL, kind TEXT NOT NULL, arguments TEXT NOT NULL, state TEXT NOT NULL,
        attempts INTEGER NOT NULL DEFAULT 0, result TEXT, error TEXT
    )""",
    "ticks": """(
        job TEXT NOT NULL, number INTEGER NOT NULL, done INTEGER NOT NULL, total INTEGER NOT NULL, what TEXT NOT NULL,
        iteration INTEGER, climb INTEGER, log_likelihood REAL, error REAL, fitted INTEGER,
        PRIMARY KEY (job, number)
    )""",
}


@dataclass(frozen=True)
class Job:
    """One piece of work."""

    id: str
    kind: str
    #: What it is done to, JSON content.
    arguments: Mapping[str, Any]
    state: str
    #: How often it was begun.
    attempts: int
    #: What came of it, JSON content; None before it is done.
    result: Any
    #: The error's JSON where it failed.
    error: Mapping[str, Any] | None

    def as_json(self) -> dict[str, Any]:
        """Return the job as JSON content."""
        return dict(vars(self))


@dataclass(frozen=True)
class Tick:
    """How far a job was at a time."""

    number: int
    done: int
    total: int
    what: str
    #: Of an iteration of a fit; None for anything else.
    figures: Figures | None = None

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return asdict(self)


def job_id(kind: str, arguments: Mapping[str, Any], state: str) -> str:
    """Return the id of a job: ``job-`` and 16 hex digits of the hash of what it does and to what.

    Parameters
    ----------
    state : str
        Digest of what it works on.
    """
    return "job-" + sha256(canonical_json([kind, dict(arguments), state]))[:16]


class Queue:
    """The jobs in a file.

    Parameters
    ----------
    path : Path
        Made where there is none.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        with self._connected() as file:
            file.execute("BEGIN IMMEDIATE")
            for name, columns in _TABLES.items():
                _made(file, name, columns)

    @contextmanager
    def _connected(self) -> Iterator[sqlite3.Connection]:
        # one a call: threads and processes share the file, never a connection
        with closing(sqlite3.connect(self.path, timeout=10.0, isolation_level="IMMEDIATE")) as file:
            file.row_factory = sqlite3.Row
            with file:
                yield file

    def ask(self, kind: str, arguments: Mapping[str, Any], state: str, *, again: bool = False) -> Job:
        """Put a job into the queue; one that waits, runs or is done already is that one.

        Parameters
        ----------
        again : bool, optional
            Whether one that is done is begun anew: it changed what it works on, which was changed back since.

        Raises
        ------
        KempfError
            ``jobs_full``: too many wait.
        """
        name = job_id(kind, arguments, state)
        with self._connected() as file:
            there = file.execute("SELECT state FROM jobs WHERE id = ?", (name,)).fetchone()
            if there is None or there["state"] in ((DONE, FAILED, CANCELLED) if again else (FAILED, CANCELLED)):
                _put(file, name, kind, json.dumps(dict(arguments)))
        return self.get(name)

    def again(self, name: str) -> Job:
        """Put a job that failed or was cancelled into the queue once more; one that waits, runs or is done stays.

        Raises
        ------
        NotFound
            ``no_job``.
        KempfError
            ``jobs_full``.
        """
        job = self.get(name)
        if job.state in (FAILED, CANCELLED):
            with self._connected() as file:
                _put(file, name, job.kind, json.dumps(dict(job.arguments)))
        return self.get(name)

    def get(self, name: str) -> Job:
        """Return a job.

        Raises
        ------
        NotFound
            ``no_job``.
        """
        with self._connected() as file:
            row = file.execute("SELECT * FROM jobs WHERE id = ?", (name,)).fetchone()
        if row is None:
            raise NotFound("no_job", f"There is no job {name[:40]!r}.", "Ask for it again.")
        return _job(row)

    def known(self, kind: str, arguments: Mapping[str, Any], state: str) -> Job | None:
        """Return the job of a request; None where nobody asked."""
        try:
            return self.get(job_id(kind, arguments, state))
        except NotFound:
            return None

    def all(self, most: int | None = None) -> list[Job]:
        """Return the jobs, the newest first, all or so many."""
        with self._connected() as file:
            query = "SELECT * FROM jobs ORDER BY number DESC LIMIT ?"
            return [_job(row) for row in file.execute(query, (-1 if most is None else most,))]

    def active(self) -> list[Job]:
        """Return the jobs that wait or run, in the order in which they are done; none where their file was deleted."""
        if not self.path.exists():
            return []
        with self._connected() as file:
            rows = file.execute(
                "SELECT * FROM jobs WHERE state IN (?, ?) ORDER BY state != ?, number", (*ACTIVE, RUNNING)
            )
            return [_job(row) for row in rows]

    def ticks(self, name: str, after: int = 0) -> list[Tick]:
        """Return how far a job was, from a number on that is not among them."""
        with self._connected() as file:
            rows = file.execute("SELECT * FROM ticks WHERE job = ? AND number > ? ORDER BY number", (name, after))
            return [_tick(row) for row in rows]

    def take(self) -> Job | None:
        """Return the job that waits the longest, which runs from now on; None where none waits."""
        with self._connected() as file:
            row = file.execute("SELECT * FROM jobs WHERE state = ? ORDER BY number LIMIT 1", (QUEUED,)).fetchone()
            if row is None:
                return None
            file.execute("UPDATE jobs SET state = ?, attempts = attempts + 1 WHERE id = ?", (RUNNING, row["id"]))
        return self.get(row["id"])

    def tick(self, name: str, ticks: Sequence[Tick]) -> None:
        """Write down how far a job is; the ticks are numbered on from those that are there."""
        with self._connected() as file:
            file.execute("BEGIN IMMEDIATE")
            last = file.execute("SELECT coalesce(max(number), 0) FROM ticks WHERE job = ?", (name,)).fetchone()[0]
            file.executemany(
                "INSERT INTO ticks (job, number, done, total, what, iteration, climb, log_likelihood, error, fitted) "
                "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                [(name, last + k, *_row(tick)) for k, tick in enumerate(ticks, 1)],
            )

    def finish(self, name: str, result: Any) -> None:
        """Let a running job be done."""
        self._leave(name, DONE, result=json.dumps(result))

    def fail(self, name: str, error: KempfError) -> None:
        """Let a running job have failed."""
        self._leave(name, FAILED, error=json.dumps(error.as_json()["error"], default=str))

    def cancel(self, name: str) -> Job:
        """Let a job that waits or runs be cancelled.

        Raises
        ------
        NotFound
            ``no_job``.
        UsageError
            ``job_over``: it has ended already.
        """
        job = self.get(name)
        if job.state not in ACTIVE:
            raise UsageError("job_over", f"The job {name} is {job.state}.", "Nothing is left to cancel.")
        with self._connected() as file:
            file.execute("UPDATE jobs SET state = ? WHERE id = ? AND state IN (?, ?)", (CANCELLED, name, *ACTIVE))
        return self.get(name)

    def died(self, name: str) -> None:
        """Put a job whose process is gone back into the queue, or let it have failed where that was so before."""
        job = self.get(name)
        if job.state != RUNNING:
            return
        if job.attempts >= MOST_ATTEMPTS:
            self.fail(
                name,
                KempfError(
                    "job_lost",
                    f"Its process died {job.attempts} times.",
                    "Nothing is half in the warehouse. Look at the memory of the machine, then ask for it again.",
                ),
            )
            return
        with self._connected() as file:
            file.execute("UPDATE jobs SET state = ? WHERE id = ? AND state = ?", (QUEUED, name, RUNNING))

    def running(self) -> list[str]:
        """Return the ids of the jobs that are said to run."""
        with self._connected() as file:
            return [row["id"] for row in file.execute("SELECT id FROM jobs WHERE state = ?", (RUNNING,))]

    def _leave(self, name: str, state: str, *, result: str | None = None, error: str | None = None) -> None:
        with self._connected() as file:
            file.execute(
                "UPDATE jobs SET state = ?, result = ?, error = ? WHERE id = ? AND state = ?",
                (state, result, error, name, RUNNING),
            )


def _put(file: sqlite3.Connection, name: str, kind: str, arguments: str) -> None:
    """Let a job wait behind the others, with nothing of what it was before."""
    waiting = file.execute("SELECT count(*) FROM jobs WHERE state = ?", (QUEUED,)).fetchone()[0]
    if waiting >= MOST_WAITING:
        raise KempfError("jobs_full", f"{waiting} jobs wait already.", "Wait, or cancel some.")
    number = file.execute("SELECT coalesce(max(number), 0) + 1 FROM jobs").fetchone()[0]
    file.execute("DELETE FROM ticks WHERE job = ?", (name,))
    file.execute(
        "INSERT OR REPLACE INTO jobs (id, number, kind, arguments, state) VALUES (?, ?, ?, ?, ?)",
        (name, number, kind, arguments, QUEUED),
    )


def _made(file: sqlite3.Connection, name: str, columns: str) -> None:
    """Make a table; one of another version goes: what it holds costs time only."""
    file.execute(f"CREATE TEMP TABLE wanted {columns}")
    query = "SELECT name FROM pragma_table_info(?)"
    wanted, there = (file.execute(query, (table,)).fetchall() for table in ("wanted", name))
    file.execute("DROP TABLE temp.wanted")
    if [tuple(row) for row in there] != [tuple(row) for row in wanted]:
        file.execute(f"DROP TABLE IF EXISTS {name}")
        file.execute(f"CREATE TABLE {name} {columns}")


def _row(tick: Tick) -> tuple[Any, ...]:
    figures = tick.figures
    values = (
        (None,) * 5
        if figures is None
        else (figures.iteration, figures.climb, figures.log_likelihood, figures.error, figures.fitted)
    )
    return (tick.done, tick.total, tick.what, *values)


def _tick(row: sqlite3.Row) -> Tick:
    figures = None
    if row["iteration"] is not None:
        figures = Figures(
            row["iteration"], row["climb"], row["log_likelihood"], row["error"], fitted=bool(row["fitted"])
        )
    return Tick(row["number"], row["done"], row["total"], row["what"], figures)


def _job(row: sqlite3.Row) -> Job:
    def content(text: str | None) -> Any:
        return None if text is None else json.loads(text)

    return Job(
        row["id"],
        row["kind"],
        content(row["arguments"]),
        row["state"],
        row["attempts"],
        content(row["result"]),
        content(row["error"]),
    )
