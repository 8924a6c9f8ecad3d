"""v r^2 in the yaw equation."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="yaw_vr2",
    title="turning moment from drift and turn squared",
    group="hull",
    plain="Drift turns the hull differently while it is turning, with the square of the rate of turn.",
    equation="dr/dt += c v r^2 / V",
    reference=(
        "Abkowitz 1964, Lectures on ship hydrodynamics: steering and manoeuvrability, HyA report Hy-5; Yasukawa & "
        "Yoshimura 2015, Introduction of MMG standard method for ship maneuvering predictions, J. Mar. Sci. "
        "Technol. 20"
    ),
    parameters=(Parameter("c", "1", -40.0, 40.0, (0.5,), "coefficient without dimension, of either sign"),),
    terms={"yaw": "c*v*r**2/max(V, 0.1)"},
    confounded_with="yaw_v2r, yaw_cubic, cross_flow_drag",
    separated_by=(
        "A pull-out and a spiral hold sway and turn at other ratios than a zigzag does; 10/10 beside 20/20 shows "
        "the order of the growth."
    ),
)
