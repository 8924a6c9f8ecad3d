"""Reports that were made for the pages, kept beside the warehouse; deleting them costs time only."""

from __future__ import annotations

from pathlib import Path

from kempf.schemas.errors import NotFound
from kempf.warehouse.storage.canonical import sha256
from kempf.warehouse.storage.whole_file import keep_newest, whole_file
from kempf.workbench.web.jobs.queue import DONE, Job

#: reports kept: the ones made longest ago go first
_MOST = 20


def keep(state: Path, html: str) -> str:
    """Keep a report, and return what it is kept under."""
    folder, key = state / "reports", sha256(html)[:24]
    with whole_file(folder / f"{key}.html") as passing:
        passing.write_text(html, encoding="utf-8")
    keep_newest(folder, "*.html", _MOST)
    return key


def of_job(state: Path, job: Job) -> Path:
    """Return the file of the report that a job made.

    Raises
    ------
    NotFound
        ``no_report``.
    """
    path = state / "reports" / f"{job.result['report']}.html" if job.kind == "report" and job.state == DONE else None
    if path is None or not path.is_file():
        raise NotFound("no_report", f"No report of the job {job.id} is kept.", "Ask for it again on the vessel's page.")
    return path
