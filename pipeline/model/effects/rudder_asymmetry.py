"""The rudder turns the ship better to one side than to the other."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="rudder_asymmetry",
    title="port and starboard asymmetry of the rudder",
    group="rudder",
    plain="The rudder turns the ship better to one side than to the other.",
    equation="delta += c |delta|",
    reference=(
        "Abkowitz 1964, Lectures on ship hydrodynamics: steering and manoeuvrability, HyA report Hy-5 (even terms "
        "of the rudder angle); Yasukawa & Yoshimura 2015, Introduction of MMG standard method for ship "
        "maneuvering predictions, J. Mar. Sci. Technol. 20"
    ),
    parameters=(
        Parameter(
            "c",
            "1",
            -0.6,
            0.6,
            (0.05,),
            "share by which starboard rudder does more than its angle says, and port rudder less",
        ),
    ),
    terms={"rudder": "c*abs(delta)"},
    confounded_with=(
        "neutral_angle, gyro_bias, propeller_walk, backlash: in a zigzag the size of the angle hardly changes, so "
        "it is a constant"
    ),
    separated_by=(
        "Zigzags at two rudder angles, begun to both sides, and a spiral: an asymmetry grows with the angle, a "
        "bias does not."
    ),
)
