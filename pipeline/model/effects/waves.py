"""First-order waves: a narrow-band yaw on top of the slow motion.

A lightly damped oscillator driven by white noise (relative damping 0.1), whose yaw and rate of yaw join heading and
yaw rate. Its standard deviation is the parameter, so that 0 is a calm sea.
"""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, ExtraState, Parameter

EFFECT = Effect(
    name="waves",
    title="yawing in first-order waves",
    group="environment",
    plain="Waves swing the bow to and fro within seconds, too fast for the rudder and on top of the slow turn.",
    equation="psi += m1, r += m2, dm1/dt = m2, dm2/dt = -w^2 m1 - 0.2 w m2 + noise, w = k sqrt(g / L)",
    reference=(
        "Fossen 2021, Handbook of marine craft hydrodynamics and motion control, 2nd ed.; van Amerongen 1982, "
        "Adaptive steering of ships, thesis, TU Delft"
    ),
    parameters=(
        Parameter("c", "rad", 0.0, 0.2, (0.005,), "standard deviation of the yaw from waves"),
        Parameter(
            "k", "1", 0.7, 6.0, (1.0, 1.7, 2.8), "frequency of encounter over the square root of gravity by length"
        ),
    ),
    terms={"heading": "m1", "yaw_rate": "m2"},
    states=(
        ExtraState("m1", "m2", "0", "c"),
        ExtraState(
            "m2", "-k**2*9.81/L*m1 - 0.2*k*sqrt(9.81/L)*m2", "2*sqrt(0.1)*c*(k*sqrt(9.81/L))**1.5", "c*k*sqrt(9.81/L)"
        ),
    ),
    confounded_with="noise of heading and yaw rate; vibration of the rate gyro's mount",
    separated_by="A heading and a rate logged at 2 Hz or faster: waves show as one peak in the spectrum of both.",
)
