"""A job: how far it is, what came of it; and the form that asks for one."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import groupby
from typing import Any

from kempf.flows.fleet.state import fleet_state
from kempf.flows.jobs.chosen_set import chosen_set
from kempf.pipeline.predict.horizon import horizon_of
from kempf.schemas.effects import get
from kempf.schemas.errors import UsageError
from kempf.warehouse import vessels
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.data.predictions import key_of
from kempf.workbench.web.desk import Desk
from kempf.workbench.web.draw.climb import draw_climb, in_words
from kempf.workbench.web.jobs.kinds import KINDS
from kempf.workbench.web.jobs.queue import ACTIVE, Job
from kempf.workbench.web.pages.page import Page

#: iterations that the page shows, the last ones
_MOST = 200


def document(desk: Desk, name: str, after: int = 0) -> dict[str, Any]:
    """Return a job and how far it was, from a tick on that is not among them."""
    job = desk.queue.get(name)
    return {**job.show(), "ticks": [tick.show() for tick in desk.queue.ticks(name, after)]}


def gather(desk: Desk, name: str) -> Page:
    """Return the page of a job."""
    job = desk.queue.get(name)
    ticks = desk.queue.ticks(name)
    # one piece of work ticks many times
    pieces = [what for what, _ in groupby(tick.what for tick in ticks)]
    iterations = [(tick.what, tick.figures) for tick in ticks if tick.figures is not None]
    shown = iterations[-_MOST:]
    figures = [one for _, one in shown]
    content = {
        **{"job": job, "active": job.state in ACTIVE, "ticks": ticks, "pieces": pieces, "iterations": shown},
        **{"drawn": draw_climb(figures), "sentence": in_words(figures), "most": _MOST},
    }
    vessel = job.arguments["vessel"]
    return Page("job.html", f"{KINDS[job.kind][1]}: {vessel}", content, ((vessel, of_vessel(vessel)),))


def ask(desk: Desk, form: Mapping[str, str]) -> Job:
    """Put what a form asks for into the queue.

    Raises
    ------
    UsageError
        ``job_unknown``, ``moved_meanwhile``: the vessel's model is another than the page showed.
    NotFound
        ``no_vessel``, ``no_parameter_set``, ``effect_unknown``.
    """
    kind, vessel = form.get("kind", ""), form.get("vessel", "")
    if kind not in KINDS:
        raise UsageError("job_unknown", f"There is no job {kind[:40]!r}.", f"Ask for one of {', '.join(KINDS)}.")
    vessels.require(desk.warehouse, vessel)
    arguments = {"vessel": vessel, **{name: form.get(name, "") for name in KINDS[kind][2]}}
    state = fleet_state(desk.warehouse, [vessel])[vessel]
    _require_standing(dict(state.aliases), vessel, form.get("standing"))
    digest = state.digest
    if kind == "predict":
        arguments["horizon"] = horizon_of(arguments["horizon"]).name
        arguments["set"] = chosen_set(desk.warehouse, vessel, arguments["set"] or None)[0].parameter_set_id
        arguments["key"] = digest = key_of(desk.warehouse, vessel, arguments["set"], arguments["horizon"])
    elif kind == "add":
        get(arguments["effect"])
    return desk.queue.ask(kind, arguments, digest)


def _require_standing(pointed: Mapping[str, str], vessel: str, shown: str | None) -> None:
    """Refuse what is asked for on a page that showed another model than the vessel has now."""
    now = pointed.get("current", "")
    if shown is not None and shown != now:
        raise UsageError(
            "moved_meanwhile",
            f"The model of {vessel!r} is {now or 'none'} now, and was {shown or 'none'} when the page was opened.",
            "Look at her page again, then ask once more.",
            {"standing": now, "shown": shown},
        )
