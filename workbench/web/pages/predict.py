"""A standard manoeuvre predicted: every figure with its interval, the criteria, and what was measured of its kind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from kempf.flows.jobs.state.out_of_date import said_of_vessel
from kempf.workbench.manoeuvre_figures import FIGURES, LAST_TURN, beside_in_words, in_words
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.data.sailed import MANOEUVRES
from kempf.workbench.web.draw.sailed import draw_sailed
from kempf.workbench.web.pages.answer import answer
from kempf.workbench.web.pages.manoeuvre_names import names_of
from kempf.workbench.web.pages.page import Page


def document(app_state: AppState, vessel: str, fields: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what `kempf predict MANOEUVRE --vessel NAME --compare --json` prints, where it was made; else None."""
    return answer(app_state, "sail", vessel, fields).document


def gather(app_state: AppState, vessel: str, fields: Mapping[str, str]) -> Page:
    """Return the page of a predicted manoeuvre.

    Parameters
    ----------
    fields : mapping of str to str
        Fields of `kempf.workbench.web.data.sailed.request_of`, any of them; the errors are its.
    """
    reply = answer(app_state, "sail", vessel, fields)
    content: dict[str, Any] = {
        "vessel": vessel,
        "stale": said_of_vessel(app_state.warehouse, vessel),
        "asked": reply.arguments,
        "manoeuvres": MANOEUVRES,
        "made": reply.document,
        "job": reply.waiting,
    }
    if reply.made is not None:
        prediction = reply.made["document"]
        content |= {
            "drawn": draw_sailed(prediction["manoeuvre"], reply.made["curves"]),
            "names": names_of(app_state.warehouse, vessel),
            "rows": list(_rows(prediction)),
            "measured": list(_measured(prediction)),
            "last_turn": LAST_TURN if prediction["manoeuvre"]["kind"] == "turning-circle" else None,
        }
    return Page("predict.html", "Predict a manoeuvre", content, ((vessel, of_vessel(vessel)),))


def _rows(prediction: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    # one that an earlier version made has no such key
    at_full_scale = (prediction.get("full_scale") or {}).get("figures", {})
    for name, entry in prediction["figures"].items():
        several = isinstance(entry, list)
        for place, figure in enumerate(entry if several else [entry]):
            words = in_words(name, place if several else None, prediction["manoeuvre"])
            full = at_full_scale.get(name)
            yield {
                "words": words,
                "unit": FIGURES[name][1],
                **figure,
                "full": full[place] if full and several else full,
            }


def _measured(prediction: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    for manoeuvre in prediction["measured"]:
        for figure in manoeuvre["figures"]:
            name, _, place = figure["figure"].partition(".")
            kind = prediction["manoeuvre"]["kind"]
            words = beside_in_words(kind, name, int(place) if place else None, manoeuvre)
            yield {
                **figure,
                "words": words,
                "unit": FIGURES[name][1],
                "segment_id": manoeuvre["segment_id"],
                **_whose(manoeuvre),
            }


def _whose(manoeuvre: Mapping[str, Any]) -> dict[str, Any]:
    return {name: manoeuvre[name] for name in ("side", "sample", "why")}
