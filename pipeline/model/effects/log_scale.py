"""The speed log reads a constant share too little."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="log_scale",
    title="scale error of the speed log",
    group="sensor",
    plain="The speed log reads a fixed share too high or too low.",
    equation="V = (1 + c) V logged",
    reference="ITTC recommended procedure 7.5-02-06-01, Free running model tests; Fossen 2021",
    parameters=(Parameter("c", "1", -0.3, 0.3, (0.03,), "share by which the ship goes faster than her log says"),),
    terms={"speed": "c*V"},
    confounded_with="all six hull parameters: each takes the scale upon itself, so zigzags alone never show it",
    separated_by=(
        "A measured mile, or GNSS speed on two opposite headings, beside the log: the mean of the two is the "
        "speed through the water."
    ),
)
