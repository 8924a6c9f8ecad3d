"""The speed lost in a turn, where no log tells it.

A state of its own: drift and turn take speed away, the rudder's drag takes more, and the propeller gives it back
within some five ship lengths. The rate of recovery is that of a Mariner's linear resistance, 0.2 V / L.
"""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, ExtraState, Parameter

EFFECT = Effect(
    name="speed_loss",
    title="speed lost in the turn",
    group="propulsion",
    plain=(
        "The ship loses speed while she turns and regains it slowly; without a log this passes for a change of "
        "everything that goes with speed."
    ),
    equation="V += -m, dm/dt = -c v r + k V^2 delta^2 / L - 0.2 V m / L",
    reference=(
        "Abkowitz 1964, Lectures on ship hydrodynamics: steering and manoeuvrability, HyA report Hy-5; Blanke "
        "1981, Ship propulsion losses related to automatic steering and prime mover control, thesis, TU Denmark"
    ),
    parameters=(
        Parameter("c", "1", -0.5, 3.0, (0.1,), "share of the centrifugal force that brakes her, over that of her mass"),
        Parameter("k", "1", -0.05, 0.6, (0.03,), "drag of the rudder without dimension, over the mass with added mass"),
    ),
    terms={"speed": "-m1"},
    told_by=("speed_through_water",),
    states=(ExtraState("m1", "-c*v*r + k*V**2*delta**2/L - 0.2*V*m1/L"),),
    confounded_with=(
        "speed_exponent, the quadratic and cubic hull terms: all weaken what a long turn does; with a log of the "
        "speed it is told already"
    ),
    separated_by="Log the speed through the water.",
)
