"""The rate gyro reads a constant share too much."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="gyro_scale",
    title="scale error of the rate gyro",
    group="sensor",
    plain="The rate gyro shows a fixed share more, or less, turn than there is.",
    equation="y_r += c r",
    reference="Titterton & Weston 2004, Strapdown inertial navigation technology, 2nd ed.",
    parameters=(Parameter("c", "1", -0.4, 0.4, (0.02,), "share by which the gyro shows too much"),),
    terms={"yaw_rate": "c*r"},
    confounded_with="the rudder's effectiveness where no heading is logged",
    separated_by=("Log the heading beside the rate of turn: its change over a turn is the integral of the true rate."),
)
