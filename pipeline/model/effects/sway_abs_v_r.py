"""|v|r in the sway equation."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="sway_abs_v_r",
    title="side force from the turn that grows with drift",
    group="hull",
    plain="A turn pushes the hull sideways the more, the faster it is swept sideways, whichever way.",
    equation="dv/dt += c |v| r",
    reference=(
        "Norrbin 1971, Theory and observations on the use of a mathematical model for ship manoeuvring, SSPA publ. 68"
    ),
    parameters=(Parameter("c", "1", -15.0, 15.0, (0.1,), "coefficient without dimension, of either sign"),),
    terms={"sway": "c*abs(v)*r"},
    confounded_with="sway_abs_r_v, sway_v2r, cross_flow_drag",
    separated_by=(
        "A pull-out and a spiral hold sway and turn at other ratios than a zigzag does; 10/10 beside 20/20 shows "
        "the order of the growth."
    ),
)
