"""A predicted manoeuvre, with the measured ones beside it where they are asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from kempf.flows.jobs.compare_predicted import MeasuredManoeuvre
from kempf.flows.jobs.one_sided import OneSided, one_sided
from kempf.flows.jobs.predicted import Predicted
from kempf.workbench.manoeuvre_figures import in_words

#: said where fewer than this share of measured figures agree with what is predicted
MOST = 0.75
LACKS = (
    "intervals of predictions hold the errors of the parameters and the models that fit alike; what all of these "
    "models lack is in none"
)


def sentence_of(found: OneSided) -> str:
    """Say that a figure is predicted too large in all measured manoeuvres, or too small in all."""
    base, _, place = found.figure.partition(".")
    return found.sentence(in_words(base, int(place) if place else None, {}))


def prediction_document(
    predicted: Predicted,
    measured: Sequence[MeasuredManoeuvre] | None,
    others: Mapping[str, int],
    figure: str | None = None,
) -> dict[str, Any]:
    """Return what `kempf predict --json` prints.

    Parameters
    ----------
    measured : sequence of MeasuredManoeuvre or None
        None where they are not asked for.
    others : mapping of str to int
        How many of the kind are of other angles, by the option that predicts them.
    figure : str, optional
        Where it is drawn.
    """
    document = predicted.show()
    if measured is not None:
        document |= {
            "measured": [manoeuvre.show() for manoeuvre in measured],
            "one_sided": [{**vars(found), "sentence": sentence_of(found)} for found in one_sided(measured)],
            "other_orders": dict(others),
        }
    return {**document, "figure": figure}
