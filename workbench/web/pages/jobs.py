"""The jobs: what runs, what waits behind it, and what was done last."""

from __future__ import annotations

from typing import Any

from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.jobs.kinds import KINDS
from kempf.workbench.web.jobs.queue import ACTIVE, Job
from kempf.workbench.web.pages.page import Page

#: jobs that are over and still shown
_MOST = 40


def gather(app_state: AppState) -> Page:
    """Return the page of the jobs."""
    over = [job for job in app_state.queue.all(_MOST) if job.state not in ACTIVE]
    content = {"active": rows(app_state.queue.active()), "over": rows(over)}
    return Page("jobs.html", "Jobs", content)


def rows(jobs: list[Job]) -> list[dict[str, Any]]:
    """Return what a list shows of jobs; one of a kind that an earlier version had is left out."""
    return [
        {"id": job.id, "title": KINDS[job.kind].title, "vessel": job.arguments["vessel"], "state": job.state}
        for job in jobs
        if job.kind in KINDS
    ]
