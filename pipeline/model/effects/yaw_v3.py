"""v^3 in the yaw equation."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="yaw_v3",
    title="turning moment from drift cubed",
    group="hull",
    plain="Drift turns the hull by more than in proportion, with the cube of the sideways speed.",
    equation="dr/dt += c v^3 / (V L^2)",
    reference=(
        "Abkowitz 1964, Lectures on ship hydrodynamics: steering and manoeuvrability, HyA report Hy-5; Yasukawa & "
        "Yoshimura 2015, Introduction of MMG standard method for ship maneuvering predictions, J. Mar. Sci. "
        "Technol. 20"
    ),
    parameters=(Parameter("c", "1", -100.0, 100.0, (3.0,), "coefficient without dimension, of either sign"),),
    terms={"yaw": "c*v**3/(max(V, 0.1)*L**2)"},
    confounded_with="yaw_v2r, yaw_vr2, cross_flow_drag",
    separated_by=(
        "A pull-out and a spiral hold sway and turn at other ratios than a zigzag does; 10/10 beside 20/20 shows "
        "the order of the growth."
    ),
)
