"""Numbers as a person reads them: the digits that the standard error leaves, degrees for angles, the error beside."""

from __future__ import annotations

from math import degrees, floor, isfinite, isnan, log10, pi

#: a larger number is written with its power of ten
_WHOLE = 1e6


def number(value: float | None, digits: int = 4) -> str:
    """Write a number with so many significant digits, whole below a million; a dash for none.

    Examples
    --------
    >>> number(-0.000130912), number(None), number(1362.4, 3), number(12.3e6, 3)
    ('-0.0001309', '-', '1362', '1.23e+07')
    """
    if value is None or isnan(value):
        return "-"
    return f"{value:.0f}" if 10.0**digits <= abs(value) < _WHOLE else f"{value:.{digits}g}"


def percent(share: float | None, digits: int = 3) -> str:
    """Write a share in percent, without the sign; a dash for none. See `number`.

    Examples
    --------
    >>> percent(0.0314159), percent(None)
    ('3.14', '-')
    """
    return "-" if share is None else number(100.0 * share, digits)


def in_degrees(value: float, std: float, unit: str) -> tuple[float, float, str]:
    """Return a value, its error and its unit, angles in degrees; whole turns of a direction do not count.

    Examples
    --------
    >>> in_degrees(0.5, 0.25, "m/s"), in_degrees(2.5 * pi, 0.0, "rad")
    ((0.5, 0.25, 'm/s'), (90.0, 0.0, 'deg'))
    """
    if unit == "rad" and abs(value) > 2.0 * pi:
        value %= 2.0 * pi
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


def with_error(value: float, std: float, unit: str) -> str:
    """Return a value with its standard error and its unit.

    Examples
    --------
    >>> with_error(3.9, 0.15, "s"), with_error(-3.11e-5, 5.7e-6, "1/m^2")
    ('3.90 ± 0.15 s', '(-3.11 ± 0.57)·10⁻⁵ 1/m²')
    """
    value, std, unit = in_degrees(value, std, unit)
    shown = "" if unit in ("", "1") else f" {unit.replace('^2', '²')}"
    if not isfinite(value):
        return "not known"
    known = isfinite(std) and std > 0.0
    largest = max(abs(value), std if known else 0.0)
    power = floor(log10(largest)) if largest and not 1e-3 <= largest < 1e6 else 0
    value, std = value / 10.0**power, std / 10.0**power
    text = f"{rounded(value, std)} ± {rounded(std, std)}" if known else f"{value:.3g}"
    if not power:
        return f"{text}{shown}"
    return f"{f'({text})' if known else text}·10{_raised(power)}{shown}"


def _raised(power: int) -> str:
    return str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
