"""Sway damping that grows with the turn: |r|v in the sway equation."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="sway_abs_r_v",
    title="sway damping that grows with the turn",
    group="hull",
    plain="The hull resists sideways flow the more, the faster it turns, whichever way.",
    equation="dv/dt += -c |r| v",
    reference=(
        "Norrbin 1971, Theory and observations on the use of a mathematical model for ship manoeuvring, SSPA "
        "publ. 68; Fossen 2021, Handbook of marine craft hydrodynamics and motion control, 2nd ed."
    ),
    parameters=(Parameter("c", "1", -3.0, 15.0, (0.1,), "coefficient without dimension, positive where it opposes"),),
    terms={"sway": "-c*abs(r)*v"},
    confounded_with="sway_quadratic, sway_vr2, cross_flow_drag",
    separated_by=(
        "A pull-out and a spiral hold sway and turn at other ratios than a zigzag does; 10/10 beside 20/20 shows "
        "the order of the growth."
    ),
)
