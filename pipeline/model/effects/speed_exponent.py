"""The rudder's force goes with another power of the speed than its square."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="speed_exponent",
    title="rudder force with another power of the speed",
    group="propulsion",
    plain=(
        "The rudder loses less force than expected when the ship slows down in a turn, as one behind a propeller "
        "that keeps turning does."
    ),
    equation="V^2 in the rudder's force becomes V^2 (V0 / V)^c",
    reference=(
        "Yasukawa & Yoshimura 2015, Introduction of MMG standard method for ship maneuvering predictions, J. Mar. "
        "Sci. Technol. 20; Fossen 2021, Handbook of marine craft hydrodynamics and motion control, 2nd ed."
    ),
    parameters=(Parameter("c", "1", -1.0, 2.0, (0.3,), "two less the power of the speed"),),
    terms={
        "sway": "b1*V**2*delta*(exp(c*log(max(V0, 0.1)/max(V, 0.1))) - 1)",
        "yaw": "b2*V**2*delta*(exp(c*log(max(V0, 0.1)/max(V, 0.1))) - 1)",
    },
    confounded_with="propeller_wash at a constant shaft speed, rudder_stall; log_scale",
    separated_by="Zigzags at two approach speeds, or one with the shaft speed logged and changed.",
)
