"""The rudder's neutral angle: the reading is off by a constant."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="neutral_angle",
    title="neutral angle of the rudder",
    group="rudder",
    plain="The ship goes straight ahead at a rudder reading other than zero.",
    equation="delta += c",
    reference=(
        "van Amerongen 1982, Adaptive steering of ships, thesis, TU Delft; ITTC recommended procedure "
        "7.5-02-06-01, Free running model tests"
    ),
    parameters=(
        Parameter(
            "c",
            "rad",
            -0.15,
            0.15,
            (0.01,),
            "angle by which the rudder stands further to starboard than its reading says",
        ),
    ),
    terms={"rudder": "c"},
    confounded_with="gyro_bias, propeller_walk, a steady wind force, rudder_asymmetry",
    separated_by=(
        "Runs at other speeds and headings: a wrong zero turns the ship with the square of the speed and on every "
        "heading, the wind does not; a heading beside the rate gyro tells its bias."
    ),
)
