"""Froude's law: what is measured on a free-running model of a ship, at full scale."""

from __future__ import annotations

#: With which power of the linear scale a figure goes, by its unit (ITTC 7.5-02-06-01, free running model tests):
#: lengths with the scale, times and speeds with its root.
_POWER = {"m": 1.0, "s": 0.5, "m/s": 0.5, "deg/s": -0.5, "deg": 0.0, "%": 0.0}


def at_full_scale(value: float, unit: str, model_scale: float) -> float:
    """Return a figure of a model as that of its ship.

    Parameters
    ----------
    value : float
        Of the model.
    unit : {"m", "s", "m/s", "deg/s", "deg", "%"}
        Of the figure; the ship's has the same one.
    model_scale : float
        Length of the ship over that of the model.

    Examples
    --------
    >>> at_full_scale(7.0, "m", 45.714), round(at_full_scale(1.179, "m/s", 45.714), 2)
    (319.998, 7.97)
    """
    return float(value * model_scale ** _POWER[unit])
