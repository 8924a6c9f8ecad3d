"""Effects that no catalogue names: the right answer to them is 'none of the known effects explains it'.

Letters and strengths as in `benchmarks.diagnose.hidden_effects.effects`.
"""

from __future__ import annotations

from benchmarks.diagnose.hidden_effects import plant
from benchmarks.diagnose.hidden_effects.effects import HiddenEffect, only

#: By name.
OUTSIDERS: dict[str, HiddenEffect] = {
    e.name: e
    for e in (
        HiddenEffect(
            "kick_at_executes",
            "r' += c k(t),  v' -= (L/6) c k(t): a thruster that nobody logs pushes for tau = 0.4 L/V0 after every "
            "execute to the side that was ordered, k = +1 or -1, else 0",
            "rad/s^2",
            only(plant.KICK),
            0,
            fixed=((plant.KICK_S, 0.4, "L/V"),),
        ),
        HiddenEffect(
            "yaw_hysteresis",
            "r' += c s, s = sign(r) once |r| exceeds 0.05 V0/L, and kept until it does so on the other side",
            "rad/s^2",
            only(plant.HYSTERESIS),
            0,
            fixed=((plant.HYSTERESIS_R, 0.05, "V/L"),),
        ),
        HiddenEffect(
            "bow_thruster_product",
            "r' += c v V d,  v' += (L/6) c v V d",
            "1/(rad m^2)",
            only(plant.THRUSTER),
            0,
        ),
        HiddenEffect(
            "bank_shear",
            "r' += c sin(2 pi y / L),  v' += (L/6) c sin(2 pi y / L), y across the track of the approach, from where "
            "the run began",
            "rad/s^2",
            only(plant.BANK),
            0,
            fixed=((plant.BANK_M, 1.0, "L"),),
        ),
        HiddenEffect(
            "late_lift",
            "v' += c v(t - tau) |v|,  r' += (3/L) c v(t - tau) |v|, tau = 0.5 L/V0",
            "1/m",
            only(plant.LATE_LIFT),
            -1,
            fixed=((plant.LATE_S, 0.5, "L/V"),),
        ),
        HiddenEffect(
            "fouled_rudder",
            "rudder force times 1 - c once 60 % of a run's legs are sailed, whole again at the next",
            "1",
            only(plant.FOULING),
            most=0.6,
        ),
        HiddenEffect(
            "heading_harmonic",
            "r' += c sin 3 psi,  v' += (L/6) c sin 3 psi, psi from north",
            "rad/s^2",
            only(plant.HARMONIC),
            0,
        ),
        HiddenEffect(
            "dead_zone",
            "a11 V v and a21 V v with v - c min(max(v, -w), w) in place of v, w = 0.05 V0",
            "1",
            only(plant.DEAD_ZONE),
            most=1.0,
            fixed=((plant.DEAD_ZONE_V, 0.05, "V"),),
        ),
    )
}
