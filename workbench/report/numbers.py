"""Numbers as a person reads them: the digits that the uncertainty leaves, degrees for angles, the interval beside."""

from __future__ import annotations

from math import degrees, floor, isfinite, log10

#: half width of a 95 % interval in standard errors
WIDTH_95 = 1.96


def in_degrees(value: float, std: float, unit: str) -> tuple[float, float, str]:
    """Return a value, its error and its unit, angles in degrees.

    Examples
    --------
    >>> in_degrees(0.5, 0.25, "m/s")
    (0.5, 0.25, 'm/s')
    """
    if unit in ("rad", "rad/s", "rad/s^2"):
        return degrees(value), degrees(std), unit.replace("rad", "deg")
    if unit == "s/rad":
        return value / degrees(1.0), std / degrees(1.0), "s/deg"
    return value, std, unit


def rounded(value: float, spread: float) -> str:
    """Return a number with two digits of its spread.

    Examples
    --------
    >>> rounded(0.0123456, 0.00098), rounded(12345.6, 230.0), rounded(1.5, float("nan"))
    ('0.01235', '12350', '1.5')
    """
    if not isfinite(value):
        return "not known"
    if not isfinite(spread) or spread <= 0.0:
        return f"{value:.4g}"
    digits = 1 - floor(log10(spread))
    return f"{round(value, digits):.{max(0, digits)}f}"


def with_interval(value: float, std: float, unit: str) -> str:
    """Return a value with the half width of its 95 % interval and its unit.

    Examples
    --------
    >>> with_interval(3.9, 0.15, "s")
    '3.90 ± 0.29 s'
    """
    value, std, unit = in_degrees(value, std, unit)
    half = WIDTH_95 * std
    shown = "" if unit in ("", "1") else f" {unit}"
    if not isfinite(value):
        return "not known"
    if not isfinite(half):
        return f"{value:.3g}{shown}"
    return f"{rounded(value, half)} ± {rounded(half, half)}{shown}"
