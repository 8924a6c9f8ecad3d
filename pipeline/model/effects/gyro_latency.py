"""The rate of turn comes late."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="gyro_latency",
    title="latency of the rate of turn",
    group="sensor",
    plain="The rate of turn is shown late, as by a gyro that filters or a display that averages.",
    equation="y_r += -tau dr/dt",
    reference=("Titterton & Weston 2004, Strapdown inertial navigation technology, 2nd ed.; first order of r(t - tau)"),
    parameters=(Parameter("tau", "s", -2.0, 10.0, (0.2,), "time by which the rate comes late"),),
    terms={"yaw_rate": "-tau*rdot"},
    confounded_with="rudder_lag, dead_time; heading_latency with the other sign",
    separated_by=(
        "Log heading and rate of turn on one clock: the derivative of the heading stands where the rate ought to."
    ),
)
