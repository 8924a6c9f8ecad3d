"""A constant stream over ground, in the lateral speed that GNSS measures."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="earth_current",
    title="a constant current",
    group="environment",
    plain=(
        "The water itself moves over ground, so that GNSS shows a lateral speed that the ship does not have "
        "through the water."
    ),
    equation="y_v += -c1 sin(K) + c2 cos(K)",
    reference="Fossen 2021, Handbook of marine craft hydrodynamics and motion control, 2nd ed.; eq. (19)",
    parameters=(
        Parameter("c1", "m/s", -5.0, 5.0, (0.1,), "stream towards north"),
        Parameter("c2", "m/s", -5.0, 5.0, (0.1,), "stream towards east"),
    ),
    terms={"lateral_speed": "-c1*sin(K) + c2*cos(K)"},
    confounded_with=(
        "the current that the model carries anyway: next to `current: earth` nothing is left of it; "
        "heading_misalignment"
    ),
    separated_by="A model without current states (`current: none`), or runs on several headings.",
)
