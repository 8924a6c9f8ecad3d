"""The rudder loses lift at large angles: delta^3."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="rudder_stall",
    title="loss of rudder force at large angles",
    group="rudder",
    plain=(
        "At large angles the flow leaves the rudder, which then turns the ship by less than in proportion to its angle."
    ),
    equation="delta += -c delta^3",
    reference=(
        "Abkowitz 1964, Lectures on ship hydrodynamics: steering and manoeuvrability, HyA report Hy-5; Fossen "
        "2021, Handbook of marine craft hydrodynamics and motion control, 2nd ed."
    ),
    parameters=(
        Parameter(
            "c", "1/rad^2", -0.3, 2.0, (0.3,), "share of its force that the rudder loses at an angle of one radian"
        ),
    ),
    terms={"rudder": "-c*delta**3"},
    confounded_with="yaw_quadratic, yaw_cubic, rate_limit: all bound what a large rudder angle does",
    separated_by=(
        "Zigzags at several rudder angles on one ship, 10/10, 20/20 and 35/20: stall follows the angle itself at "
        "the moment it is put over, the hull's damping follows the turn seconds later."
    ),
)
