"""Quadratic sway damping: v|v| in the sway equation."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="sway_quadratic",
    title="quadratic sway damping",
    group="hull",
    plain="The hull resists sideways flow with the square of its speed.",
    equation="dv/dt += -c v |v| / L",
    reference=(
        "Norrbin 1971, Theory and observations on the use of a mathematical model for ship manoeuvring, SSPA "
        "publ. 68; Blanke 1981, Ship propulsion losses related to automatic steering and prime mover control, "
        "thesis, TU Denmark"
    ),
    parameters=(Parameter("c", "1", -1.0, 15.0, (0.2,), "coefficient without dimension, positive where it opposes"),),
    terms={"sway": "-c*v*abs(v)/L"},
    confounded_with="cross_flow_drag, sway_cubic, sway_abs_r_v",
    separated_by=(
        "A pull-out and a spiral hold sway and turn at other ratios than a zigzag does; 10/10 beside 20/20 shows "
        "the order of the growth."
    ),
)
