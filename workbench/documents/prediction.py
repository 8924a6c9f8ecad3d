"""A predicted manoeuvre, with the measured ones beside it where they are asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import median
from typing import Any

from kempf.flows.jobs.predict.compare_predicted import MeasuredManoeuvre
from kempf.flows.jobs.predict.one_sided import OneSided, one_sided
from kempf.flows.jobs.predict.predicted import SetPrediction
from kempf.pipeline.segment.particulars import Particulars
from kempf.workbench.manoeuvre_figures import in_words, scaled

#: said where fewer than this share of measured figures agree with what is predicted
_MOST = 0.75
_LACKS = (
    "intervals of predictions hold the errors of the parameters and the models that fit alike; what all of these "
    "models lack is in none"
)


def judged(measured: Sequence[MeasuredManoeuvre]) -> list[str]:
    """Say how many measured figures lie in the intervals of their predictions, and how wide these are."""
    figures = [figure for manoeuvre in measured for figure in manoeuvre.figures if figure.inside is not None]
    if not figures:
        return []
    inside, agree = sum(figure.inside is True for figure in figures), sum(figure.agrees is True for figure in figures)
    first = f"{inside} of {len(figures)} measured figures lie inside the interval of their prediction"
    if any(figure.measured_low is not None for figure in figures):
        first += f"; {agree} agree with it by both intervals"
    predicted = [figure.predicted for figure in figures]
    widths = [
        0.5 * (one.high - one.low) / abs(one.value)
        for one in predicted
        # of one about nothing there is no share
        if one.value and one.low is not None and one.high is not None and one.low * one.high > 0.0
    ]
    sentences = [first]
    if widths:
        others = len(predicted) - len(widths)
        sentences.append(
            f"the intervals reach {_percent(median(widths))} % (median) to either side of what is predicted, "
            f"{_percent(max(widths))} % at most{f'; {others} intervals about nothing are left out' if others else ''}"
        )
    unknown = max((run.wind_force_std_m_s2 for run in measured if run.wind_force_m_s2 == 0.0), default=0.0)
    if unknown > 0.0:
        sentences.append(
            "the wind force of these manoeuvres is not known: the intervals allow for one of either sign with a "
            f"standard error of {unknown:.2g} m/s^2, as large as in the zigzags of the set"
        )
    if agree < _MOST * len(figures):
        sentences.append(_LACKS)
    return sentences


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f}" if share >= 1.0 else f"{100.0 * share:.2g}"


def sentence_of(found: OneSided) -> str:
    """Say that a figure is predicted too large in all measured manoeuvres, or too small in all."""
    base, _, place = found.figure.partition(".")
    return found.sentence(in_words(base, int(place) if place else None, {}))


def prediction_document(
    predicted: SetPrediction,
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
    document = predicted.as_json()
    document["full_scale"] = _full_scale(predicted.basis.particulars, document)
    if measured is not None:
        document |= {
            "measured": [manoeuvre.as_json() for manoeuvre in measured],
            "judged": judged(measured),
            "one_sided": [{**vars(found), "sentence": sentence_of(found)} for found in one_sided(measured)],
            "other_orders": dict(others),
        }
    return {**document, "figure": figure}


def _full_scale(vessel: Particulars, document: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the figures of a model at full scale, grouped as its own are; None of a ship."""
    scale = vessel.model_scale
    if scale is None:
        return None
    figures = {
        name: [scaled(name, one, scale) for one in entry] if isinstance(entry, list) else scaled(name, entry, scale)
        for name, entry in document["figures"].items()
    }
    speed = vessel.speed_of_ship(document["speed_m_s"])
    return {"model_scale": scale, "length_m": vessel.length_of_ship_m, "speed_m_s": speed, "figures": figures}
