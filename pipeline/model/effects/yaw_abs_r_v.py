"""|r|v in the yaw equation."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="yaw_abs_r_v",
    title="turning moment from drift that grows with the turn",
    group="hull",
    plain="Drift turns the hull the more, the faster it turns, whichever way.",
    equation="dr/dt += c |r| v / L",
    reference=(
        "Norrbin 1971, Theory and observations on the use of a mathematical model for ship manoeuvring, SSPA publ. 68"
    ),
    parameters=(Parameter("c", "1", -40.0, 40.0, (0.3,), "coefficient without dimension, of either sign"),),
    terms={"yaw": "c*abs(r)*v/L"},
    confounded_with="yaw_abs_v_r, yaw_vr2, cross_flow_drag",
    separated_by=(
        "A pull-out and a spiral hold sway and turn at other ratios than a zigzag does; 10/10 beside 20/20 shows "
        "the order of the growth."
    ),
)
