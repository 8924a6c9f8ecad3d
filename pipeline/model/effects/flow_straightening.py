"""The drift changes the flow to the rudder: v^2 delta."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="flow_straightening",
    title="change of the rudder's inflow by drift",
    group="rudder",
    plain=(
        "A hull that is swept sideways sends more, or less, flow over its rudder, which then turns the ship more, "
        "or less."
    ),
    equation="delta += c delta (v / V)^2",
    reference=(
        "Abkowitz 1964, Lectures on ship hydrodynamics: steering and manoeuvrability, HyA report Hy-5; Yasukawa & "
        "Yoshimura 2015, Introduction of MMG standard method for ship maneuvering predictions, J. Mar. Sci. "
        "Technol. 20"
    ),
    parameters=(
        Parameter("c", "1", -15.0, 15.0, (1.0,), "change of the rudder's force at a drift angle of one radian"),
    ),
    terms={"rudder": "c*delta*(v/max(V, 0.1))**2"},
    confounded_with="yaw_v2r, yaw_v3, rudder_stall",
    separated_by=(
        "Putting the rudder over while the ship still turns, as in a pull-out and in a 20/10 beside a 20/20: "
        "rudder and drift then come in other pairs."
    ),
)
