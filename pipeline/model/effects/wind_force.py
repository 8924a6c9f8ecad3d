"""Force and moment of the relative wind, by the anemometer.

One harmonic each, as the coefficients of most superstructures have them at first order. The wind blows from gamma,
clockwise from the bow: a wind from starboard pushes to port.
"""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="wind_force",
    title="force and moment of the wind",
    group="environment",
    plain=("The wind pushes the ship sideways and turns her, with the square of its speed and by where it comes from."),
    equation="dv/dt += -c U^2 sin(gamma) / L, dr/dt += -k U^2 sin(2 gamma) / L^2",
    reference=(
        "Blendermann 1994, Parameter identification of wind loads on ships, J. Wind Eng. Ind. Aerodyn. 51; "
        "Isherwood 1972, Wind resistance of merchant ships, Trans. RINA"
    ),
    parameters=(
        Parameter(
            "c", "1", -0.01, 0.1, (0.003,), "side force without dimension, positive where the wind pushes to leeward"
        ),
        Parameter(
            "k",
            "1",
            -0.3,
            0.3,
            (0.005,),
            "moment without dimension, positive where wind from ahead of the beam turns the bow to leeward",
        ),
    ),
    terms={"sway": "-c*U**2*sin(gamma)/L", "yaw": "-k*U**2*sin(2*gamma)/L**2"},
    needs=("wind_speed", "wind_angle"),
    confounded_with="the slow wind force of the model itself, neutral_angle, earth_current",
    separated_by="Runs on several headings in a wind above 8 m/s with the anemometer logged.",
)
