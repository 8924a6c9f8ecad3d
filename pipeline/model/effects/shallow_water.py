"""Shallow water: the hull's damping grows as the water under the keel gets less.

The damping terms of eq. (16) grow with the square of draught over depth; a12 is left alone, most of it is the ship's
own inertia.
"""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="shallow_water",
    title="shallow water",
    group="environment",
    plain="With little water under the keel the flow must pass around the hull, which resists drift and turn more.",
    equation="a11, a21, a22 become (1 + c (T / h)^2) times themselves",
    reference=(
        "Clarke, Gedling & Hine 1983, The application of manoeuvring criteria in hull design using linear theory, "
        "Trans. RINA 125; ITTC recommended procedure 7.5-02-06-03"
    ),
    parameters=(Parameter("c", "1", -1.0, 10.0, (0.5,), "growth of the damping at a depth equal to the draught"),),
    terms={"sway": "c*(T/max(max(h, T), 0.1))**2*a11*V*v", "yaw": "c*(T/max(max(h, T), 0.1))**2*(a21*V*v + a22*V*r)"},
    needs=("water_depth",),
    confounded_with=(
        "all hull parameters where the depth never changes; load_condition where it changes from day to day"
    ),
    separated_by="Runs of one loading condition in water of clearly different depth, one below three draughts.",
)
