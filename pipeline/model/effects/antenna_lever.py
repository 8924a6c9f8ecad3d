"""The GNSS antenna stands ahead or aft of where the profile has it."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="antenna_lever",
    title="lever arm of the GNSS antenna",
    group="sensor",
    plain="The antenna stands further ahead or aft than assumed, and moves sideways when the ship turns.",
    equation="y_v += x r",
    reference="Fossen 2021, Handbook of marine craft hydrodynamics and motion control, 2nd ed.; eq. (18)",
    parameters=(
        Parameter("x", "m", -200.0, 200.0, (1.5,), "how far ahead of its place in the profile the antenna stands"),
    ),
    terms={"lateral_speed": "x*r"},
    confounded_with=(
        "the sway parameters: a lateral speed seen from another place of the hull has the same form, so zigzags "
        "alone hardly show it"
    ),
    separated_by="Survey the antenna: measure its distance from midships and write it into the profile.",
)
