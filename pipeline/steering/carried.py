"""What a linear model about a straight course has of each effect, in words."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees
from typing import Literal

import numpy as np

from kempf.pipeline.model.ship import Hull
from kempf.pipeline.steering.motion import LinearMotion, ShipEffects, linear_motion

How = Literal["carried", "shifts the course", "no part of a straight course", "left out"]
#: what is taken of a channel that a steady course does not have
_TAKEN = {"wind_speed": "calm air", "wind_angle": "calm air", "water_depth": "deep water", "roll": "no heel"}
#: differences by rounding: as a share of the largest number of a row, and of what is taken for nothing there
_NEGLIGIBLE, _NOTHING = 1e-9, 1e-6


@dataclass(frozen=True)
class Carried:
    """One effect in the linear model."""

    effect: str
    #: ``carried`` in the matrices or as states; ``shifts the course``: only the rudder, drift or readings of the
    #: straight course are others; ``no part of a straight course``; ``left out``: it has no linear model.
    how: How
    #: What a user should know; empty where it is carried as it is.
    sentence: str


def carried(hull: Hull, effects: ShipEffects | None, speed_m_s: float, arm_per_m: float = 0.0) -> tuple[Carried, ...]:
    """Say of every effect what the linear model has of it.

    Parameters
    ----------
    arm_per_m : float, optional
        l of eq. (16), 1/m.
    """
    if effects is None:
        return ()
    whole = linear_motion(hull, effects, speed_m_s, arm_per_m=arm_per_m)
    statements = []
    for effect in effects.model.effects:
        name, size = effect.name, float(effects.of(effect.name)[0])
        if effect.rudder_course is not None:
            statements.append(_on_the_rudder(name, effect.rudder_course, size))
            continue
        bare = linear_motion(hull, effects.without(name), speed_m_s, arm_per_m=arm_per_m)
        statements.append(_compared(name, whole, bare, {_TAKEN[c] for c in effect.needs if c in _TAKEN}))
    return tuple(statements)


def sentences(statements: tuple[Carried, ...]) -> tuple[str, ...]:
    """Return what a user should know, those of no part together."""
    absent = [
        statement.effect
        for statement in statements
        if statement.how == "no part of a straight course" and not statement.sentence
    ]
    lines = [statement.sentence for statement in statements if statement.sentence]
    if absent:
        verb = "is" if len(absent) == 1 else "are"
        lines.append(f"{', '.join(absent)} {verb} no part of a linear model about a straight course")
    return tuple(lines)


def _on_the_rudder(name: str, course: str, size: float) -> Carried:
    if course == "backlash":
        return Carried(name, "left out", f"backlash of {degrees(size):.2g} deg is no part of the linear model")
    if course == "rate_limit":
        limit = f" of {degrees(1.0 / size):.2g} deg/s" if size > 0.0 else ""
        return Carried(name, "left out", f"rate limit{limit} of the rudder is no part of the linear model")
    if course == "dead_time":
        return Carried(name, "carried", f"dead time of {size:.3g} s is a Padé approximation of the second order")
    return Carried(name, "carried", "")


def _compared(name: str, whole: LinearMotion, bare: LinearMotion, assumptions: set[str]) -> Carried:
    if np.any(whole.corners > bare.corners + 1e-6):
        return Carried(
            name,
            "carried",
            f"{name} has a corner at the straight course: the linear model takes the mean of both sides",
        )
    for field in ("A", "B", "C", "D", "noise"):
        if _differ(getattr(whole, field), getattr(bare, field)):
            return Carried(name, "carried", "")
    rest = [[m.rudder_rad, m.sway_m_s, *m.offsets] for m in (whole, bare)]
    if _differ(*map(np.array, rest)):
        moved = whole.rudder_rad - bare.rudder_rad
        how = " as it is measured"
        if abs(moved) > _NEGLIGIBLE * _NOTHING:
            how = f": rudder at {degrees(whole.rudder_rad):.2g} deg"
        return Carried(name, "shifts the course", f"{name} only shifts the straight course{how}")
    if assumptions:
        return Carried(
            name,
            "no part of a straight course",
            f"{name} is no part of the linear model: {', '.join(sorted(assumptions))} taken",
        )
    return Carried(name, "no part of a straight course", "")


def _differ(here: np.ndarray, there: np.ndarray) -> bool:
    size = np.maximum(np.abs(here), np.abs(there))
    if size.ndim > 1 and size.size:
        # an element that is nothing but for rounding is small beside its row, not beside itself
        size = np.broadcast_to(np.max(size, axis=-1, keepdims=True), size.shape)
    return bool(np.any(np.abs(here - there) > _NEGLIGIBLE * np.maximum(size, _NOTHING)))
