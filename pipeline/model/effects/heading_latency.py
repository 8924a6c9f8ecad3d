"""The heading comes late.

It reads K(t - tau), to first order K - tau r; and eq. (18), which takes the velocity across the heading as it reads,
sees V tau r more.
"""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="heading_latency",
    title="latency of the heading",
    group="sensor",
    plain="The compass shows the heading of some time ago, as a gyro repeater with a follow-up does.",
    equation="y_psi += -tau r, y_v += tau V r",
    reference=(
        "Fossen 2021, Handbook of marine craft hydrodynamics and motion control, 2nd ed.; eq. (18), first order in tau"
    ),
    parameters=(Parameter("tau", "s", -2.0, 10.0, (0.2,), "time by which the heading comes late"),),
    terms={"heading": "-tau*r", "lateral_speed": "tau*V*r"},
    confounded_with="rudder_lag and dead_time; gnss_latency with the other sign in the lateral speed",
    separated_by=(
        "Log a rate of turn beside the heading on one clock: its integral stands where the heading ought to."
    ),
)
