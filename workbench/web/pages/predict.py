"""A standard manoeuvre predicted: every figure with its interval, the criteria, and what was measured of its kind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from kempf.workbench.manoeuvre_figures import FIGURES, in_words
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.data.sailed import MANOEUVRES
from kempf.workbench.web.desk import Desk
from kempf.workbench.web.draw.sailed import draw_sailed
from kempf.workbench.web.pages.answer import answer
from kempf.workbench.web.pages.page import Page


def document(desk: Desk, vessel: str, asked: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what `kempf predict MANOEUVRE --vessel NAME --compare --json` prints, where it was made; else None."""
    return answer(desk, "sail", vessel, asked).document


def gather(desk: Desk, vessel: str, asked: Mapping[str, str]) -> Page:
    """Return the page of a predicted manoeuvre.

    Parameters
    ----------
    asked : mapping of str to str
        Fields of `kempf.workbench.web.data.sailed.request_of`, any of them; the errors are its.
    """
    found = answer(desk, "sail", vessel, asked)
    content: dict[str, Any] = {
        "vessel": vessel,
        "asked": found.arguments,
        "manoeuvres": MANOEUVRES,
        "made": found.document,
        "job": found.waiting,
    }
    if found.made is not None:
        made = found.made["document"]
        content |= {
            "drawn": draw_sailed(made["manoeuvre"], found.made["curves"]),
            "rows": list(_rows(made)),
            "measured": list(_measured(made)),
        }
    return Page("predict.html", "Predict a manoeuvre", content, ((vessel, of_vessel(vessel)),))


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
