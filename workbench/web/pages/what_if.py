"""One parameter of a set moved by a slider: the free run it gives, and what it costs in likelihood."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kempf.flows.jobs.chosen_set import chosen_set
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.desk import Desk
from kempf.workbench.web.draw.what_if import draw_what_if
from kempf.workbench.web.jobs.kinds import KINDS
from kempf.workbench.web.jobs.queue import ACTIVE, DONE, Job
from kempf.workbench.web.pages.job import settled
from kempf.workbench.web.pages.page import Page

_KIND = "what_if"


def document(desk: Desk, vessel: str, asked: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what `kempf what-if PARAMETER --vessel NAME --json` prints, where it was made; else None."""
    job = _asked_for(desk, vessel, asked)[1]
    return job.result["document"] if job is not None and job.state == DONE else None


def gather(desk: Desk, vessel: str, asked: Mapping[str, str]) -> Page:
    """Return the page of a parameter that is moved.

    Parameters
    ----------
    asked : mapping of str to str
        ``parameter``, ``set``, ``segment``, any of them.
    """
    arguments, job = _asked_for(desk, vessel, asked)
    one = chosen_set(desk.warehouse, vessel, arguments["set"])[0]
    content: dict[str, Any] = {
        "vessel": vessel,
        "asked": arguments,
        "parameters": [p.name for p in one.parameters],
        "segments": list(one.segment_ids),
        "made": None,
        "job": job if job is not None and job.state in ACTIVE else None,
    }
    if job is not None and job.state == DONE:
        made = job.result["document"]
        content |= {
            "made": made,
            "drawn": draw_what_if(job.result["series"]),
            "middle": min(range(len(made["tried"])), key=lambda k: abs(made["tried"][k]["value"] - made["value"])),
        }
    return Page("what_if.html", "What if", content, ((vessel, of_vessel(vessel)),))


def _asked_for(desk: Desk, vessel: str, asked: Mapping[str, str]) -> tuple[dict[str, Any], Job | None]:
    given = {name: asked.get(name, "") for name in KINDS[_KIND].fields}
    arguments, digest = settled(desk, _KIND, vessel, given)
    if not arguments["parameter"]:
        arguments["parameter"] = chosen_set(desk.warehouse, vessel, arguments["set"])[0].parameters[0].name
    return arguments, desk.queue.known(_KIND, arguments, digest)
