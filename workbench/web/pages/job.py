"""A job: how far it is, what came of it; and the form that asks for one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import groupby
from typing import Any, get_args

from kempf.flows.jobs.identify.chosen_set import chosen_set
from kempf.flows.jobs.identify.standing_model import require_current
from kempf.flows.jobs.state.vessel_state import fleet_state
from kempf.pipeline.predict.horizon import horizon_of
from kempf.schemas.correction import Action
from kempf.schemas.effects import get
from kempf.schemas.errors import UsageError
from kempf.warehouse.tables import segments, vessels
from kempf.workbench.instants import end_of
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.data.predictions import key_of
from kempf.workbench.web.data.sailed import MANOEUVRES, SIDES, request_of
from kempf.workbench.web.draw.climb import draw_climb, in_words
from kempf.workbench.web.jobs.kinds import KINDS
from kempf.workbench.web.jobs.queue import ACTIVE, DONE, FAILED, QUEUED, Job
from kempf.workbench.web.pages.manoeuvre_names import kind_and_side
from kempf.workbench.web.pages.page import Page
from kempf.workbench.web.window import instant

Arguments = dict[str, Any]
_ACTIONS: tuple[Action, ...] = get_args(Action)
#: letters of a reason
_MOST_REASON = 2000

#: iterations that the page shows, the last ones
_MOST = 200


def document(app_state: AppState, name: str, after: int = 0) -> dict[str, Any]:
    """Return a job and how far it was, from a tick on that is not among them."""
    job = app_state.queue.get(name)
    shown = {**job.as_json(), "ticks": [tick.as_json() for tick in app_state.queue.ticks(name, after)]}
    if shown["result"] is not None:
        shown["result"] = {"to": f"/jobs/{job.id}", **shown["result"]}
    return shown


def gather(app_state: AppState, name: str) -> Page:
    """Return the page of a job."""
    job = app_state.queue.get(name)
    ticks = app_state.queue.ticks(name)
    # one piece of work ticks many times
    pieces = [piece for piece, _ in groupby(tick.what for tick in ticks)]
    if job.state == FAILED and pieces[-1:] == ["done"]:  # with every file looked at, none of which went in
        pieces.pop()
    iterations = [(tick.what, tick.figures) for tick in ticks if tick.figures is not None]
    shown = iterations[-_MOST:]
    figures = [iteration for _, iteration in shown]
    content = {
        **{"job": job, "active": job.state in ACTIVE, "ticks": ticks, "pieces": pieces, "iterations": shown},
        **{"drawn": draw_climb(figures), "sentence": in_words(figures), "most": _MOST},
    }
    waiting = [one.id for one in app_state.queue.active()]
    content["before"] = waiting.index(job.id) if job.state == QUEUED and job.id in waiting else 0
    vessel = job.arguments["vessel"]
    if job.kind == "ingest" and job.result is not None:
        content["names"] = _names_of_found(app_state, job.result["outcomes"])
    return Page(
        "job.html", f"{KINDS[job.kind].title}: {vessel}", content, (("Jobs", "/jobs"), (vessel, of_vessel(vessel)))
    )


def _names_of_found(app_state: AppState, outcomes: list[dict[str, Any]]) -> dict[str, str]:
    """Return what the manoeuvres that a job found are called, by id; of those that are no more there is none."""
    ingests = [one["ingest_id"] for one in outcomes if one.get("ingest_id")]
    return {one.segment_id: kind_and_side(one) for one in segments.of_ingests(app_state.warehouse, ingests)}


def ask(app_state: AppState, form: Mapping[str, str]) -> Job:
    """Put what a form asks for into the queue.

    Raises
    ------
    UsageError
        ``job_unknown``, ``moved_meanwhile``: the vessel's model is another than the page showed; and what is wrong with
        the fields of the form.
    NotFound
        ``no_vessel``, ``no_parameter_set``, ``effect_unknown``.
    """
    kind, vessel = form.get("kind", ""), form.get("vessel", "")
    if kind not in KINDS or kind == "ingest":
        raise UsageError("job_unknown", f"There is no job {kind[:40]!r}.", f"Ask for one of {', '.join(KINDS)}.")
    vessels.require(app_state.warehouse, vessel)
    require_current(app_state.warehouse, vessel, form.get("standing"))
    arguments, digest = settled(app_state, kind, vessel, form)
    return app_state.queue.ask(kind, arguments, digest, again=KINDS[kind].changes)


def place_of(job: Job) -> str:
    """Return where an answer is that is made already and that the job keeps; else the page of the job."""
    made = job.result if job.state == DONE else {}
    return str(made["to"]) if "to" in made and "document" in made else f"/jobs/{job.id}"


def settled(app_state: AppState, kind: str, vessel: str, form: Mapping[str, str]) -> tuple[Arguments, str]:
    """Return the arguments of a job, with what the form leaves open, and the digest of what it works on."""
    arguments: Arguments = {"vessel": vessel, **{name: form.get(name, "") for name in KINDS[kind].fields}}
    settle = _SETTLE.get(kind)
    own = settle(app_state, arguments) if settle is not None else None
    return arguments, own or fleet_state(app_state.warehouse, [vessel])[vessel].digest


def _predict(app_state: AppState, arguments: Arguments) -> str:
    arguments["horizon"] = horizon_of(arguments["horizon"]).name
    _name_the_set(app_state, arguments)
    # a set that came since moves no prediction with another one
    state = fleet_state(app_state.warehouse, [arguments["vessel"]])[arguments["vessel"]]
    arguments["key"] = key_of(state, arguments["set"], arguments["horizon"])
    return str(arguments["key"])


def _sail(app_state: AppState, arguments: Arguments) -> None:
    _name_the_set(app_state, arguments)
    arguments["manoeuvre"] = arguments["manoeuvre"] or MANOEUVRES[0]
    arguments["side"] = arguments["side"] or SIDES[0]
    request_of(arguments)  # what cannot be sailed is said at once


def _name_the_set(app_state: AppState, arguments: Arguments) -> None:
    name = arguments["set"] or None
    arguments["set"] = chosen_set(app_state.warehouse, arguments["vessel"], name)[0].parameter_set_id


def _known_set(app_state: AppState, arguments: Arguments) -> None:
    if arguments["set"]:
        _name_the_set(app_state, arguments)


def _formula(app_state: AppState, arguments: Arguments) -> None:
    from kempf.flows.jobs.diagnose.try_formula import formula_of_ones_own

    arguments["name"] = arguments["name"].strip() or "own"
    formula_of_ones_own(arguments["name"], arguments["formula"])


def _add(app_state: AppState, arguments: Arguments) -> None:
    if not arguments["formula"]:
        get(arguments["effect"])


def _stretch(app_state: AppState, arguments: Arguments) -> None:
    _name_the_set(app_state, arguments)
    begin, end = instant(arguments.pop("from")), instant(arguments.pop("to"))
    if end <= begin:
        raise UsageError("window_empty", "The stretch ends before it begins.", "Give a later end.")
    arguments["window_utc_ns"] = [begin, end]


def _then(app_state: AppState, arguments: Arguments) -> None:
    arguments["as_of"] = arguments["as_of"].strip()
    if arguments["as_of"]:
        end_of(arguments["as_of"], "as_of")


def _correction(app_state: AppState, arguments: Arguments) -> None:
    if arguments["action"] not in _ACTIONS:
        raise UsageError(
            "action_unknown",
            f"A manoeuvre is not {arguments['action'][:40]!r}.",
            f"Choose one of {', '.join(_ACTIONS)}.",
        )
    if len(arguments["reason"]) > _MOST_REASON:
        raise UsageError("reason_too_long", f"The reason has more than {_MOST_REASON} letters.", "Write it shorter.")
    begin, end = arguments.pop("from"), arguments.pop("to")
    wanted = arguments["action"] in ("correct", "add")
    arguments["bounds_utc_ns"] = [instant(begin), instant(end)] if wanted else None


#: What a job needs looked at before it waits; it may return a digest of its own.
_SETTLE: Mapping[str, Callable[[AppState, Arguments], str | None]] = {
    "predict": _predict,
    "explain": _stretch,
    "what_if": _name_the_set,
    "next_trial": _name_the_set,
    "report": _known_set,
    "sail": _sail,
    "changes": _then,
    "try": _formula,
    "add": _add,
    "preview": _correction,
    "correct": _correction,
}
