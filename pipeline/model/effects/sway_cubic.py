"""Cubic sway damping: v^3 in the sway equation, the first odd term of Taylor's series."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="sway_cubic",
    title="cubic sway damping",
    group="hull",
    plain="The hull resists sideways flow with the cube of its speed.",
    equation="dv/dt += -c v^3 / (V L)",
    reference=(
        "Abkowitz 1964, Lectures on ship hydrodynamics: steering and manoeuvrability, HyA report Hy-5; Yasukawa & "
        "Yoshimura 2015, Introduction of MMG standard method for ship maneuvering predictions, J. Mar. Sci. "
        "Technol. 20"
    ),
    parameters=(Parameter("c", "1", -3.0, 30.0, (1.0,), "coefficient without dimension, positive where it opposes"),),
    terms={"sway": "-c*v**3/(max(V, 0.1)*L)"},
    confounded_with="sway_quadratic, sway_v2r, sway_vr2, cross_flow_drag",
    separated_by=(
        "A pull-out and a spiral hold sway and turn at other ratios than a zigzag does; 10/10 beside 20/20 shows "
        "the order of the growth."
    ),
)
