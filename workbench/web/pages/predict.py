"""A standard manoeuvre predicted: every figure with its interval, the criteria, and what was measured of its kind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from kempf.workbench.manoeuvre_figures import FIGURES, in_words
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.data.sailed import MANOEUVRES
from kempf.workbench.web.desk import Desk
from kempf.workbench.web.draw.sailed import draw_sailed
from kempf.workbench.web.jobs.kinds import KINDS
from kempf.workbench.web.jobs.queue import ACTIVE, DONE, Job
from kempf.workbench.web.pages.job import settled
from kempf.workbench.web.pages.page import Page

_KIND = "sail"


def document(desk: Desk, vessel: str, asked: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what `kempf predict MANOEUVRE --vessel NAME --compare --json` prints, where it was made; else None."""
    job = _asked_for(desk, vessel, asked)[1]
    return job.result["document"] if job is not None and job.state == DONE else None


def gather(desk: Desk, vessel: str, asked: Mapping[str, str]) -> Page:
    """Return the page of a predicted manoeuvre.

    Parameters
    ----------
    asked : mapping of str to str
        Fields of `kempf.workbench.web.data.sailed.request_of`, any of them; the errors are its.
    """
    arguments, job = _asked_for(desk, vessel, asked)
    content: dict[str, Any] = {
        "vessel": vessel,
        "asked": arguments,
        "manoeuvres": MANOEUVRES,
        "made": None,
        "job": job if job is not None and job.state in ACTIVE else None,
    }
    if job is not None and job.state == DONE:
        made = job.result["document"]
        content |= {
            "made": made,
            "drawn": draw_sailed(made["manoeuvre"], job.result["curves"]),
            "rows": list(_rows(made)),
            "measured": list(_measured(made)),
        }
    return Page("predict.html", "Predict a manoeuvre", content, ((vessel, of_vessel(vessel)),))


def _asked_for(desk: Desk, vessel: str, asked: Mapping[str, str]) -> tuple[dict[str, Any], Job | None]:
    given = {name: asked.get(name, "") for name in KINDS[_KIND].fields}
    arguments, digest = settled(desk, _KIND, vessel, given)
    return arguments, desk.queue.known(_KIND, arguments, digest)


def _rows(made: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    for name, found in made["figures"].items():
        several = isinstance(found, list)
        for place, one in enumerate(found if several else [found]):
            words = in_words(name, place if several else None, made["manoeuvre"])
            yield {"words": words, "unit": FIGURES[name][1], **one}


def _measured(made: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    for one in made["measured"]:
        for figure in one["figures"]:
            name, _, place = figure["figure"].partition(".")
            words = in_words(name, int(place) if place else None, made["manoeuvre"])
            yield {**figure, "words": words, "unit": FIGURES[name][1], "segment_id": one["segment_id"], **_whose(one)}


def _whose(one: Mapping[str, Any]) -> dict[str, Any]:
    return {name: one[name] for name in ("side", "sample", "why")}
