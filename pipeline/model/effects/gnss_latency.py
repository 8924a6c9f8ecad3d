"""The GNSS velocity comes late, while the heading that turns it into the ship's frame is of now.

With w the velocity over ground in the earth's frame, eq. (18) takes its part across the heading of now: n(K(t)) w(t -
tau), which is n(K) w - tau n(K) dw/dt to first order. The acceleration across a ship that turns is dv/dt + V r, and a
constant current adds none: y_v = v + V_T - tau (dv/dt + V r).
"""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="gnss_latency",
    title="latency of the GNSS velocity",
    group="sensor",
    plain="The GNSS shows where the ship went some time ago, which in a turn looks like drift.",
    equation="y_v += -tau (dv/dt + V r)",
    reference=(
        "Fossen 2021, Handbook of marine craft hydrodynamics and motion control, 2nd ed.; eq. (18), first order in tau"
    ),
    parameters=(Parameter("tau", "s", -2.0, 10.0, (0.2,), "time by which the velocity comes late"),),
    terms={"lateral_speed": "-tau*(vdot + V*r)"},
    confounded_with=(
        "antenna_lever at a constant speed, where V tau stands for the arm; heading_latency in the lateral speed"
    ),
    separated_by=(
        "Runs at two speeds: the late velocity grows with speed, the arm of the antenna does not; or time stamps "
        "from the receiver itself."
    ),
)
