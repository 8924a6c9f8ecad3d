"""Cubic yaw damping: r^3 in the yaw equation."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="yaw_cubic",
    title="cubic yaw damping",
    group="hull",
    plain="The hull resists turning with the cube of the rate of turn.",
    equation="dr/dt += -c r^3 L / V",
    reference=(
        "Abkowitz 1964, Lectures on ship hydrodynamics: steering and manoeuvrability, HyA report Hy-5; Yasukawa & "
        "Yoshimura 2015, Introduction of MMG standard method for ship maneuvering predictions, J. Mar. Sci. "
        "Technol. 20; van Amerongen 1982, Adaptive steering of ships, thesis, TU Delft"
    ),
    parameters=(Parameter("c", "1", -3.0, 15.0, (0.2,), "coefficient without dimension, positive where it opposes"),),
    terms={"yaw": "-c*r**3*L/max(V, 0.1)"},
    confounded_with="yaw_quadratic, yaw_v2r, yaw_vr2, rudder_stall",
    separated_by=(
        "A pull-out and a spiral hold sway and turn at other ratios than a zigzag does; 10/10 beside 20/20 shows "
        "the order of the growth."
    ),
)
