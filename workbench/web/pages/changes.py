"""Whether a vessel changed: steps and drifts of her parameters, and what would have been seen."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kempf.schemas.enumeration import as_words
from kempf.warehouse.queries import history
from kempf.warehouse.tables import notes
from kempf.workbench.instants import end_of
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.draw.history import draw_history, shown_kind
from kempf.workbench.web.pages.answer import answer
from kempf.workbench.web.pages.page import Page
from kempf.workbench.web.wording import estimator as estimator_words


def document(app_state: AppState, vessel: str, fields: Mapping[str, str]) -> dict[str, Any] | None:
    """Return what `kempf history --vessel NAME --changes --json` prints, where it was made; else None."""
    return answer(app_state, "changes", vessel, fields).document


def gather(app_state: AppState, vessel: str, fields: Mapping[str, str]) -> Page:
    """Return the page of a vessel's changes.

    Parameters
    ----------
    fields : mapping of str to str
        ``as_of``, an instant: what was known then.
    """
    return Page("changes.html", "Changes", content(app_state, vessel, fields), ((vessel, of_vessel(vessel)),))


def content(app_state: AppState, vessel: str, fields: Mapping[str, str]) -> dict[str, Any]:
    """Return a vessel's parameters over time, as known now or then, with the changes that were found."""
    reply = answer(app_state, "changes", vessel, fields)
    then = end_of(reply.arguments["as_of"], "as_of") if reply.arguments["as_of"] else None
    of = history.of_vessel(app_state.warehouse, vessel, as_of=then)
    kinds = [] if reply.document is None else reply.document["changes"]
    rows = of.rows()
    shown = shown_kind(rows)
    return {
        "vessel": vessel,
        "as_of": reply.arguments["as_of"],
        "nothing": of.note,
        "drawn": draw_history(rows, kinds, notes.of_vessel(app_state.warehouse, vessel, then)),
        "drawn_model": None if shown is None else shown[0],
        "drawn_words": None if shown is None else _said_of_figure(*shown),
        "made": reply.document,
        "tested": [kind for kind in kinds if kind["sets"]],
        "job": reply.waiting,
    }


def _said_of_figure(model: str, estimator: str) -> str:
    """Say what the figure of the parameters shows: of all models and estimators the one that most sets are of."""
    return (
        f"Dots: parameter sets of the model {as_words(model)}, {estimator_words(estimator)}; lines: their "
        "95 % intervals."
    )
