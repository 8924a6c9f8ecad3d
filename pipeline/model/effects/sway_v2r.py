"""v^2 r in the sway equation."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="sway_v2r",
    title="side force from drift squared and turn",
    group="hull",
    plain="Drift and turn together push the hull sideways with the square of the drift.",
    equation="dv/dt += c v^2 r / V",
    reference=(
        "Abkowitz 1964, Lectures on ship hydrodynamics: steering and manoeuvrability, HyA report Hy-5; Yasukawa & "
        "Yoshimura 2015, Introduction of MMG standard method for ship maneuvering predictions, J. Mar. Sci. "
        "Technol. 20"
    ),
    parameters=(Parameter("c", "1", -20.0, 20.0, (0.4,), "coefficient without dimension, of either sign"),),
    terms={"sway": "c*v**2*r/max(V, 0.1)"},
    confounded_with="sway_cubic, sway_vr2, cross_flow_drag",
    separated_by=(
        "A pull-out and a spiral hold sway and turn at other ratios than a zigzag does; 10/10 beside 20/20 shows "
        "the order of the growth."
    ),
)
