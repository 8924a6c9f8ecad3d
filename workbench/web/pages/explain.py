"""A stretch of a manoeuvre, and what every effect would explain of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.desk import Desk
from kempf.workbench.web.jobs.kinds import KINDS
from kempf.workbench.web.jobs.queue import ACTIVE, DONE, Job
from kempf.workbench.web.pages.job import settled
from kempf.workbench.web.pages.page import Page

_KIND = "explain"


def document(desk: Desk, vessel: str, asked: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what `kempf explain --vessel NAME --from T --to T --json` prints, where it was made; else None."""
    job = _asked_for(desk, vessel, asked)[1]
    return job.result["document"] if job is not None and job.state == DONE else None


def gather(desk: Desk, vessel: str, asked: Mapping[str, str]) -> Page:
    """Return the page of a stretch.

    Parameters
    ----------
    asked : mapping of str to str
        ``from`` and ``to``, UTC; ``set``, by default the current one.

    Raises
    ------
    UsageError
        ``instant_unreadable``, ``window_empty``.
    """
    arguments, job = _asked_for(desk, vessel, asked)
    made = job.result["document"] if job is not None and job.state == DONE else None
    scored = [one for one in made["effects"] if one["score"] is not None] if made else []
    content = {
        "vessel": vessel,
        "asked": {"from": asked.get("from", ""), "to": asked.get("to", ""), "set": arguments["set"]},
        "made": made,
        "scored": scored,
        "untestable": [one for one in made["effects"] if one["score"] is None] if made else [],
        "job": job if job is not None and job.state in ACTIVE else None,
    }
    return Page("explain.html", "Explain a stretch", content, ((vessel, of_vessel(vessel)),))


def _asked_for(desk: Desk, vessel: str, asked: Mapping[str, str]) -> tuple[dict[str, Any], Job | None]:
    given = {name: asked.get(name, "") for name in KINDS[_KIND].fields}
    arguments, digest = settled(desk, _KIND, vessel, given)
    return arguments, desk.queue.known(_KIND, arguments, digest)
