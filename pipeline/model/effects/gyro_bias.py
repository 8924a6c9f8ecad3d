"""The rate gyro reads a constant too much."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="gyro_bias",
    title="bias of the rate gyro",
    group="sensor",
    plain="The rate gyro shows a turn while the ship goes straight ahead.",
    equation="y_r += c",
    reference="Titterton & Weston 2004, Strapdown inertial navigation technology, 2nd ed.",
    parameters=(Parameter("c", "rad/s", -0.02, 0.02, (0.0005,), "rate of turn that the gyro shows at rest"),),
    terms={"yaw_rate": "c"},
    confounded_with=("neutral_angle, propeller_walk; the bias that the model carries anyway where a heading is logged"),
    separated_by="Log the heading beside the rate of turn: the heading does not drift with the gyro.",
)
