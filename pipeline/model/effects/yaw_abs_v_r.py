"""Yaw damping that grows with drift: |v|r in the yaw equation."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="yaw_abs_v_r",
    title="yaw damping that grows with drift",
    group="hull",
    plain="The hull resists turning the more, the faster it is swept sideways, whichever way.",
    equation="dr/dt += -c |v| r / L",
    reference=(
        "Norrbin 1971, Theory and observations on the use of a mathematical model for ship manoeuvring, SSPA "
        "publ. 68; Fossen 2021, Handbook of marine craft hydrodynamics and motion control, 2nd ed."
    ),
    parameters=(Parameter("c", "1", -5.0, 40.0, (0.3,), "coefficient without dimension, positive where it opposes"),),
    terms={"yaw": "-c*abs(v)*r/L"},
    confounded_with="yaw_quadratic, yaw_v2r, cross_flow_drag",
    separated_by=(
        "A pull-out and a spiral hold sway and turn at other ratios than a zigzag does; 10/10 beside 20/20 shows "
        "the order of the growth."
    ),
)
