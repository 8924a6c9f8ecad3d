"""The propeller's race over the rudder: the inflow depends on shaft speed as well as on the ship's speed.

Share c of the rudder's squared inflow goes with the race, the rest with the ship; both agree on the approach.
"""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="propeller_wash",
    title="propeller race over the rudder",
    group="propulsion",
    plain=(
        "The rudder stands in the race of the propeller, which keeps its strength while the ship slows down in a turn."
    ),
    equation="V^2 in the rudder's force becomes (1 - c) V^2 + c (V0 n / n0)^2",
    reference=(
        "Yasukawa & Yoshimura 2015, Introduction of MMG standard method for ship maneuvering predictions, J. Mar. "
        "Sci. Technol. 20; ITTC recommended procedure 7.5-02-06-03, Validation of manoeuvring simulation models"
    ),
    parameters=(
        Parameter("c", "1", -0.3, 1.5, (0.3,), "share of the rudder's squared inflow that comes from the propeller"),
    ),
    terms={"sway": "b1*c*delta*((V0*n/n0)**2 - V**2)", "yaw": "b2*c*delta*((V0*n/n0)**2 - V**2)"},
    needs=("shaft_speed",),
    confounded_with="speed_exponent at a constant shaft speed, rudder_stall",
    separated_by=(
        "A zigzag with the revolutions raised or lowered at its start: the race answers at once, the ship's speed "
        "only slowly."
    ),
)
