"""What a naval architect would question in six identified parameters; nothing is mended here, only said."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.warehouse.tables.parameter_set import ParameterSet

#: Lag-1 autocorrelation from which innovations are called not white: they hold fewer values than were counted.
_NOT_WHITE = 0.3


def values(one: ParameterSet) -> tuple[Float, Float]:
    """Values and standard errors of the six parameters, shape (6,) each; NaN for an unknown error."""
    std = [np.nan if p.std is None else p.std for p in one.parameters]
    return np.array([p.value for p in one.parameters]), np.array(std)


def scale(length_m: float) -> Float:
    """Factors that make the six parameters nondimensional with the length and the ship's own speed, shape (6,)."""
    return np.array([length_m, 1.0, length_m**2, length_m, length_m, length_m**2])


def signs(value: Float) -> list[str]:
    """Say which of the six parameters, shape (6,), have a sign that no hull has."""
    a11, _, a21, a22, b1, b2 = value
    return [
        text
        for found, text in (
            (a11 >= 0, "a11 >= 0: sway is driven, not damped"),
            (a22 >= 0, "a22 >= 0: yaw is driven, not damped"),
            (a21 > 0, "a21 > 0: drifting turns the bow the wrong way"),
            (b1 >= 0, "b1 >= 0: the rudder pushes the wrong way"),
            (b2 <= 0, "b2 <= 0: the rudder turns the wrong way"),
        )
        if found
    ]


def size_per_s(value: Float, speed_m_s: Float) -> float:
    """How fast these six parameters answer, 1/s: the number that the compiled likelihood holds below its limit.

    The limit is `pipeline.estimate.filters.linear_kernel.FASTEST_PER_S`; a search that ends there has not found a
    maximum.
    """
    a11, a12, a21, a22 = value[:4]
    between = 0.5 * (speed_m_s[1:] + speed_m_s[:-1])
    return float((abs(a11) + abs(a22) + np.sqrt(abs(a12 * a21))) * np.max(between))


def odd(one: ParameterSet) -> list[str]:
    """Say what is odd, in a few words each; an empty list for a plausible set."""
    value, std = values(one)
    wrong_signs = signs(value)
    loose = [p.name for p, v, s in zip(one.parameters, value, std, strict=True) if not s < abs(v)]
    if loose:
        wrong_signs.append(f"error as large as the value: {', '.join(loose)}")
    colours = {
        name: channel["lag1_autocorrelation"]
        for name, channel in one.fit.get("channels", {}).items()
        if abs(channel["lag1_autocorrelation"] or 0.0) > _NOT_WHITE
    }
    if colours:
        listed = ", ".join(f"{name.replace('_', ' ')} {lag1:.2f}" for name, lag1 in colours.items())
        wrong_signs.append(f"innovations not white (lag 1: {listed})")
    return wrong_signs
