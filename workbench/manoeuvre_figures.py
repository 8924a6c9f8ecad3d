"""Figures of a manoeuvre in words, measured or predicted, as the command line and the pages have them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kempf.schemas.froude import at_full_scale

#: What a figure is called and its unit, by name.
FIGURES = {
    "advance_m": ("advance", "m"),
    "transfer_m": ("transfer", "m"),
    "tactical_diameter_m": ("tactical diameter", "m"),
    "steady_diameter_m": ("steady diameter", "m"),
    "steady_yaw_rate_deg_s": ("steady yaw rate", "deg/s"),
    "steady_drift_deg": ("steady drift angle", "deg"),
    "speed_loss_percent": ("speed loss", "%"),
    "time_to_90_s": ("time to 90 deg", "s"),
    "time_to_180_s": ("time to 180 deg", "s"),
    "overshoots_deg": ("overshoot", "deg"),
    "initial_turning_m": ("distance to the second execute", "m"),
    "time_to_second_execute_s": ("time to the second execute", "s"),
    "period_s": ("period", "s"),
    "initial_yaw_rate_deg_s": ("yaw rate of the turn", "deg/s"),
    "residual_yaw_rate_deg_s": ("residual yaw rate", "deg/s"),
    "residual_share_percent": ("share of the rate that is left", "%"),
    "time_to_half_s": ("time to half the rate", "s"),
    "loop_width_deg": ("width of the loop", "deg"),
    "loop_height_deg_s": ("height of the loop", "deg/s"),
    "neutral_rudder_deg": ("rudder of a straight course", "deg"),
    "from_starboard_deg_s": ("yaw rate from starboard at", "deg/s"),
    "from_port_deg_s": ("yaw rate from port at", "deg/s"),
}


#: Of a measured circle the steady figures are means over its last turn, and so are those predicted beside it.
_OF_LAST_TURN = {
    "steady_diameter_m": "diameter of the last turn",
    "steady_yaw_rate_deg_s": "yaw rate in the last turn",
    "steady_drift_deg": "drift angle in the last turn",
    "speed_loss_percent": "speed loss in the last turn",
}
#: Said below measured circles.
LAST_TURN = (
    "a circle is predicted for as long as it was sailed: while her speed still falls, what is said of the last turn is "
    "not the steady figure of the prediction above"
)


def scaled(name: str, figure: Mapping[str, float | None], model_scale: float) -> dict[str, float | None]:
    """Return value and interval of a model's figure at full scale, by Froude's law.

    Parameters
    ----------
    name : str
        Of the figure, without its place in a list.
    figure : mapping of str to float or None
        Such as value, low and high.
    model_scale : float
        Length of the ship over that of the model.
    """
    unit = FIGURES[name][1]
    return {key: None if at is None else at_full_scale(at, unit, model_scale) for key, at in figure.items()}


def in_words(name: str, place: int | None, manoeuvre: Mapping[str, Any]) -> str:
    """Return what a figure is called, one of a list by its place.

    Parameters
    ----------
    name : str
        Such as ``overshoots_deg``.
    place : int or None
        Of a list, from 0.
    manoeuvre : mapping
        JSON content of the manoeuvre, predicted or measured; a spiral has ``orders_deg``.

    Examples
    --------
    >>> in_words("overshoots_deg", 0, {}), in_words("advance_m", None, {})
    ('overshoot 1', 'advance')
    """
    words = FIGURES[name][0]
    if place is None:
        return words
    if manoeuvre.get("orders_deg"):
        # no minus before a nought
        return f"{words} {round(manoeuvre['orders_deg'][place], 1) + 0.0:g} deg"
    return f"{words} {place + 1}"


def beside_in_words(kind: str, name: str, place: int | None, manoeuvre: Mapping[str, Any]) -> str:
    """Return what a figure is called beside a measured manoeuvre of a kind, such as ``turning-circle``.

    Examples
    --------
    >>> beside_in_words("turning-circle", "steady_yaw_rate_deg_s", None, {})
    'yaw rate in the last turn'
    """
    words = in_words(name, place, manoeuvre)
    return _OF_LAST_TURN.get(name, words) if kind == "turning-circle" else words
