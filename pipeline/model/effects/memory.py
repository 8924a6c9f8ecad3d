"""Memory of the flow: the force across the hull settles only some ship lengths after the drift has changed.

A slow state follows the drift within three ship lengths; the hull feels how far the drift is ahead of it, so nothing
is left in steady motion, where the linear damping says it all.
"""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, ExtraState, Parameter

EFFECT = Effect(
    name="memory",
    title="memory of the flow around the hull",
    group="other",
    plain=(
        "The flow around the hull needs some ship lengths to settle, so that the side force depends on the drift "
        "of the last minute too."
    ),
    equation="dv/dt += -c V (v - m) / L, dm/dt = V (v - m) / (3 L)",
    reference=(
        "Cummins 1962, The impulse response function and ship motions, DTMB report 1661; Fossen 2021, Handbook of "
        "marine craft hydrodynamics and motion control, 2nd ed."
    ),
    parameters=(
        Parameter("c", "1", -2.0, 5.0, (0.05,), "side force without dimension of a drift that has just begun"),
    ),
    terms={"sway": "-c*V*(v - m1)/L"},
    states=(ExtraState("m1", "V*(v - m1)/(3*L)"),),
    confounded_with="a11 and a12: a zigzag never holds a drift for long enough; the slow wind force",
    separated_by=(
        "A pull-out or a turning circle: after the rudder is put amidships the slow tail of the drift is there to "
        "be seen."
    ),
)
