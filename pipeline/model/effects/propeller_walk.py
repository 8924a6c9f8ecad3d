"""Propeller walk: a single screw pushes the stern sideways with the square of its revolutions."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="propeller_walk",
    title="propeller walk",
    group="propulsion",
    plain="A single propeller pushes the stern to one side, the more the faster it turns.",
    equation="dv/dt += c (V0 n / n0)^2 / L, dr/dt += -8 c (V0 n / n0)^2 / L^2",
    reference=(
        "Fossen 2021, Handbook of marine craft hydrodynamics and motion control, 2nd ed.; Yasukawa & Yoshimura "
        "2015, Introduction of MMG standard method for ship maneuvering predictions, J. Mar. Sci. Technol. 20; "
        "inertias as those of cross_flow_drag, the force at the stern"
    ),
    parameters=(
        Parameter(
            "c",
            "1",
            -0.05,
            0.05,
            (0.003,),
            "side force at the stern without dimension, positive to starboard, at the revolutions of the approach",
        ),
    ),
    terms={"sway": "c*(V0*n/n0)**2/L", "yaw": "-8*c*(V0*n/n0)**2/L**2"},
    needs=("shaft_speed",),
    confounded_with="neutral_angle, gyro_bias, a steady wind force: at constant revolutions it is a constant",
    separated_by="Runs at clearly different revolutions, or the shaft stopped for a while on a straight course.",
)
