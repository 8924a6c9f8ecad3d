"""A standard manoeuvre as a form asks for it, and what of its prediction is drawn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast, get_args

from kempf.flows.jobs.predict.predict_request import Kind, PredictRequest, angles_of, required
from kempf.schemas.errors import UsageError
from kempf.schemas.side import Side
from kempf.workbench.web.form_numbers import number_of

if TYPE_CHECKING:
    from kempf.pipeline.manoeuvre.prediction import Prediction

#: Manoeuvres that can be predicted.
MANOEUVRES: tuple[Kind, ...] = get_args(Kind)
#: Sides of a turn, the usual one first.
SIDES: tuple[Side, ...] = get_args(Side)
#: ships of all models that are drawn one by one, and points of each
_SHIPS, _POINTS = 24, 120


def request_of(fields: Mapping[str, Any]) -> PredictRequest:
    """Return what the fields of a form ask for; one that is blank takes what is usual.

    Parameters
    ----------
    fields : mapping of str to str
        ``manoeuvre``, ``set``, ``rudder``, ``angles``, ``side``, ``speed``.

    Raises
    ------
    UsageError
        ``manoeuvre_unknown``, ``side_unknown``, ``number_unreadable``, ``angles_unreadable``; and what
        `kempf.flows.jobs.predict.predict_request.required` raises.
    """
    kind, side = fields["manoeuvre"] or MANOEUVRES[0], fields["side"] or SIDES[0]
    if kind not in MANOEUVRES:
        raise UsageError(
            "manoeuvre_unknown", f"{kind[:40]!r} cannot be predicted.", f"Choose one of {', '.join(MANOEUVRES)}."
        )
    if side not in SIDES:
        raise UsageError("side_unknown", f"{side[:40]!r} is no side.", "Choose starboard or port.")
    rudder, speed = number_of(fields["rudder"], "rudder"), number_of(fields["speed"], "speed")
    angles = angles_of(fields["angles"] or "20/20")
    request = PredictRequest(cast(Kind, kind), fields["set"] or None, rudder, angles, cast(Side, side), speed)
    required(request)
    return request


def curves_of(prediction: Prediction) -> dict[str, list[list[list[float]]]]:
    """Return what ships do as JSON content: points of each, columns as `kempf.pipeline.manoeuvre.sailed` has them.

    Returns
    -------
    dict
        ``estimates``: one curve a model, the one asked for first; ``ships``: some that the data allow.
    """
    drawn = prediction.drawn
    chosen = drawn[:: max(1, -(-len(drawn) // _SHIPS))]
    return {
        "estimates": [_thinned(model.sailed.curve) for model in prediction.models if model.sailed is not None],
        "ships": [_thinned(ship.curve) for ship in chosen],
    }


def _thinned(curve: Any) -> list[list[float]]:
    step = max(1, -(-len(curve) // _POINTS))
    return [[float(f"{value:.6g}") for value in row] for row in curve[::step]]
