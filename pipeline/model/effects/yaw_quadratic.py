"""Quadratic yaw damping: r|r| in the yaw equation."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="yaw_quadratic",
    title="quadratic yaw damping",
    group="hull",
    plain="The hull resists turning with the square of the rate of turn.",
    equation="dr/dt += -c r |r|",
    reference=(
        "Norrbin 1971, Theory and observations on the use of a mathematical model for ship manoeuvring, SSPA publ. 68"
    ),
    parameters=(Parameter("c", "1", -2.0, 15.0, (0.1,), "coefficient without dimension, positive where it opposes"),),
    terms={"yaw": "-c*r*abs(r)"},
    confounded_with="yaw_cubic, yaw_abs_v_r, cross_flow_drag, rudder_stall",
    separated_by=(
        "A pull-out and a spiral hold sway and turn at other ratios than a zigzag does; 10/10 beside 20/20 shows "
        "the order of the growth."
    ),
)
