"""v r^2 in the sway equation."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="sway_vr2",
    title="side force from drift and turn squared",
    group="hull",
    plain="A turning hull resists being swept sideways with the square of the rate of turn.",
    equation="dv/dt += -c v r^2 L / V",
    reference=(
        "Abkowitz 1964, Lectures on ship hydrodynamics: steering and manoeuvrability, HyA report Hy-5; Yasukawa & "
        "Yoshimura 2015, Introduction of MMG standard method for ship maneuvering predictions, J. Mar. Sci. "
        "Technol. 20"
    ),
    parameters=(Parameter("c", "1", -3.0, 10.0, (0.1,), "coefficient without dimension, positive where it opposes"),),
    terms={"sway": "-c*v*r**2*L/max(V, 0.1)"},
    confounded_with="sway_cubic, sway_v2r, sway_abs_r_v, cross_flow_drag",
    separated_by=(
        "A pull-out and a spiral hold sway and turn at other ratios than a zigzag does; 10/10 beside 20/20 shows "
        "the order of the growth."
    ),
)
