"""Units a log may be written in, each as a factor to SI, and those of instants, which are whole nanoseconds.

A unit of a log is always named by the profile or fixed by the standard of the message: none is guessed from the values.
"""

from __future__ import annotations

from math import pi

from kempf.schemas.errors import UsageError

#: Nanoseconds in a millisecond, a second and a day (without a leap second).
MILLISECOND_NS = 1_000_000
SECOND_NS = 1_000_000_000
DAY_NS = 86_400 * SECOND_NS

#: unit -> (SI unit, factor): value_SI = value * factor
TO_SI: dict[str, tuple[str, float]] = {
    "rad": ("rad", 1.0),
    "deg": ("rad", pi / 180.0),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", pi / 180.0),
    "deg/min": ("rad/s", pi / 180.0 / 60.0),
    "m/s": ("m/s", 1.0),
    "kn": ("m/s", 1852.0 / 3600.0),
    "km/h": ("m/s", 1.0 / 3.6),
    "cm/s": ("m/s", 0.01),
    "m": ("m", 1.0),
    "nmi": ("m", 1852.0),
    "ft": ("m", 0.3048),
    "fathom": ("m", 1.8288),
    "1/s": ("1/s", 1.0),
    "rpm": ("1/s", 1.0 / 60.0),
}


def factor_to_si(unit: str, si_unit: str, where: str) -> float:
    """Return the factor from ``unit`` to ``si_unit``.

    Parameters
    ----------
    unit : str
        Unit as written in the profile, a key of `TO_SI`.
    si_unit : str
        Unit of the canonical channel.
    where : str
        Where the unit stands, for the message.

    Returns
    -------
    float
        ``value_si = value * factor``.

    Raises
    ------
    UsageError
        The unit is unknown, or is one of another quantity.

    Examples
    --------
    >>> round(factor_to_si("kn", "m/s", "sog"), 6)
    0.514444
    """
    if unit not in TO_SI:
        raise UsageError(
            "unknown_unit",
            f"{where}: the unit {unit!r} is not known.",
            f"Write one of {', '.join(sorted(TO_SI))}.",
            {"unit": unit, "known": sorted(TO_SI)},
        )
    base_unit, factor = TO_SI[unit]
    if base_unit != si_unit:
        fitting = sorted(u for u, (si, _) in TO_SI.items() if si == si_unit)
        raise UsageError(
            "unit_of_another_quantity",
            f"{where}: {unit!r} is a unit of {base_unit}, the channel is in {si_unit}.",
            f"Write one of {', '.join(fitting)}, or map another channel.",
            {"unit": unit, "expected": si_unit},
        )
    return factor


def as_read(unit: str) -> tuple[float, str]:
    """Return the factor to the unit that people read an angle in, and that; of what has no dimension the unit is empty.

    Examples
    --------
    >>> as_read("m/s"), as_read("1")
    ((1.0, 'm/s'), (1.0, ''))
    """
    if unit in ("rad", "rad/s"):
        return 180.0 / pi, unit.replace("rad", "deg")
    return 1.0, "" if unit == "1" else unit
