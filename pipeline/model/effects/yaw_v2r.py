"""v^2 r in the yaw equation: the strongest of the cubic yaw terms of most hulls."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="yaw_v2r",
    title="yaw damping from drift squared",
    group="hull",
    plain="A hull that is swept sideways resists turning with the square of the drift.",
    equation="dr/dt += -c v^2 r / (V L)",
    reference=(
        "Abkowitz 1964, Lectures on ship hydrodynamics: steering and manoeuvrability, HyA report Hy-5; Yasukawa & "
        "Yoshimura 2015, Introduction of MMG standard method for ship maneuvering predictions, J. Mar. Sci. "
        "Technol. 20"
    ),
    parameters=(Parameter("c", "1", -20.0, 150.0, (1.0,), "coefficient without dimension, positive where it opposes"),),
    terms={"yaw": "-c*v**2*r/(max(V, 0.1)*L)"},
    confounded_with="yaw_abs_v_r, yaw_v3, yaw_vr2, yaw_cubic, cross_flow_drag",
    separated_by=(
        "A pull-out and a spiral hold sway and turn at other ratios than a zigzag does; 10/10 beside 20/20 shows "
        "the order of the growth."
    ),
)
