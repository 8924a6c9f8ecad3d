"""A ship that sails standard manoeuvres: the numbers of one model, and what all ships of the model share."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.manoeuvre import motion
from kempf.pipeline.manoeuvre.helm import KINDS
from kempf.pipeline.model.effect_model import EffectModel

#: steps of the integration in the time in which she sails her own length: far below any time scale of hers
STEPS_A_LENGTH = 50.0
#: rows of a track: more than that no manoeuvre has
_MOST_ROWS = 40_000


@dataclass(frozen=True)
class Start:
    """How a manoeuvre begins where it does not from a steady straight course; None is as on one."""

    forward_m_s: float | None = None
    lateral_m_s: float | None = None
    yaw_rate_rad_s: float | None = None
    rudder_rad: float | None = None

    @classmethod
    def at_end_of(cls, track: SailedTrack) -> Start:
        """Return the motion in which a manoeuvre ended, to go on from."""
        return cls(*track.rows[-1, [motion.FORWARD, motion.LATERAL, motion.RATE, motion.RUDDER]].tolist())

    def off_by(self, std: Start, normal: Float) -> Start:
        """Return it with errors of its speeds and turn: standard errors times normal numbers, shape (3,)."""
        names = ("forward_m_s", "lateral_m_s", "yaw_rate_rad_s")
        errors = {name: (getattr(std, name) or 0.0) * float(number) for name, number in zip(names, normal, strict=True)}
        return replace(
            self,
            **{name: getattr(self, name) + error for name, error in errors.items() if getattr(self, name) is not None},
        )

    def vector(self) -> Float:
        """Return it as the compiled motion reads it, shape (4,)."""
        parts = (self.forward_m_s, self.lateral_m_s, self.yaw_rate_rad_s, self.rudder_rad)
        return np.array([np.nan if part is None else part for part in parts], dtype=np.float64)


@dataclass(frozen=True)
class Waters:
    """What is the same for all ships of a model."""

    model: EffectModel
    length_m: float
    draught_m: float
    #: Of the approach, m/s.
    approach_m_s: float
    #: Length by which her time scale goes: hers, or where the profile has none, that of a ship who answers as she does.
    scale_m: float
    #: Power of the speed in the rudder's force.
    rudder_speed_exponent: float = 2.0
    #: Which log the ship is as in, 0 for the first: what a change of the load goes by.
    day: float = 0.0
    #: wind_force_m_s2, wind_arm_per_m: A steady wind, F and l of eq. (16); none unless one is to be compared with.
    wind_force_m_s2: float = 0.0
    wind_arm_per_m: float = 0.0
    #: true_wind_m_s, true_wind_from_rad: A steady wind, for the speed and for effects that ask for it; from where,
    #: clockwise from the course of the approach.
    true_wind_m_s: float = 0.0
    true_wind_from_rad: float = 0.0
    #: Shape (k, 3). Its course in the manoeuvre where it is known: instant from the beginning, s, and its parts from
    #: ahead and from starboard of the approach, m/s; without rows it is the steady one.
    air: Float = field(default_factory=lambda: np.zeros((0, 3)), repr=False, compare=False)
    #: The speed that the shaft keeps on a straight course; that of the approach where she has settled on it.
    settled_m_s: float | None = None
    #: What effects take for the speed that the shaft keeps, as a share of it: as in the logs they were identified from.
    shaft_share: float = 1.0
    start: Start = Start()

    @property
    def own_time_s(self) -> float:
        """Time in which she sails her own length on the approach, s."""
        return self.scale_m / self.approach_m_s


@dataclass(frozen=True, eq=False)
class Ship:
    """One ship: an estimate, or a draw from what the estimate leaves open."""

    waters: Waters
    #: Shape (6,). a11, a12, a21, a22, b1, b2 of eq. (16).
    hull: Float
    #: Shape (p,). Parameters of the effects.
    effects: Float
    #: Shape (5,). Time constant of the speed in lengths `Waters.scale_m`, loss by -scale v r / V_s^2, by
    #: (scale r / V_s)^2, by delta^2, and by the wind's W / V_s^2 of `kempf.pipeline.manoeuvre.surge`.
    surge: Float
    rudder_rate_rad_s: float

    @property
    def numbers(self) -> Float:
        """What the compiled motion reads, shape (17,)."""
        w, (tau, by_drift, by_rate, by_rudder, by_wind) = self.waters, self.surge
        share = w.scale_m / w.length_m
        surge = (tau * share, by_drift * share, by_rate * share**2, by_rudder)
        settled = w.approach_m_s if w.settled_m_s is None else w.settled_m_s
        rest = (
            *(self.rudder_rate_rad_s, w.rudder_speed_exponent, w.scale_m, w.wind_force_m_s2, w.wind_arm_per_m),
            *(settled, w.true_wind_m_s, w.true_wind_from_rad, settled * w.shaft_share, by_wind),
        )
        return np.array([w.length_m, w.draught_m, w.approach_m_s, *surge, *rest])

    @property
    def unstable(self) -> bool:
        """Whether a small turn to starboard is held by less rudder than the straight course: she turns by herself."""
        straight, turning = self.rudder_for(0.0), self.rudder_for(1e-3 / self.waters.own_time_s)
        return straight is not None and turning is not None and turning.rudder_rad < straight.rudder_rad

    def beginning(self, start: Start) -> Ship:
        """Return the ship that begins with a motion."""
        return replace(self, waters=replace(self.waters, start=start))

    def _shared(self) -> tuple[Float, Float, Float, float, object, int]:
        w = self.waters
        hull = np.ascontiguousarray(self.hull[:, None])
        return self.numbers, hull, np.ascontiguousarray(self.effects), float(w.day), w.model.table, w.model.extra

    def sail(self, phases: Float, *, steps_a_length: float = STEPS_A_LENGTH) -> SailedTrack:
        """Sail a manoeuvre; see `kempf.pipeline.manoeuvre.motion.sail`.

        Parameters
        ----------
        phases : ndarray, shape (q, 4)
            Rudder order, rad, NaN for the rudder of a straight course; side to which the heading passes its target, 0
            for none; target, rad; longest duration, s.
        steps_a_length : float, optional
            Steps of the integration in the time in which she sails her own length.
        """
        kinds, sizes = self._gear()
        track, ends = np.empty((_MOST_ROWS, motion.N_TRACK)), np.full(len(phases), -1, dtype=np.int64)
        step = self.waters.own_time_s / steps_a_length
        how, rows = motion.sail(
            *(*self._shared(), kinds, sizes, self.waters.start.vector(), np.ascontiguousarray(self.waters.air)),
            *(np.ascontiguousarray(phases, dtype=np.float64), step, track, ends),
        )
        return SailedTrack(track[:rows].copy(), ends, int(how))

    def rudder_for(self, yaw_rate_rad_s: float, start: Float | None = None) -> Balance | None:
        """Return the steady turn at a yaw rate, None where there is none.

        Parameters
        ----------
        start : ndarray, shape (2 + k,), optional
            `Balance.solution` of a turn beside it.
        """
        return self._balance(yaw_rate_rad_s, start, rate_given=True)

    def rate_by(self, rudder_rad: float, start: Float | None = None) -> Balance | None:
        """Return the steady turn that a rudder keeps up, None where there is none; an unstable one counts, too."""
        return self._balance(rudder_rad, start, rate_given=False)

    def _balance(self, given: float, start: Float | None, *, rate_given: bool) -> Balance | None:
        z = np.zeros(2 + self.waters.model.extra) if start is None else start.copy()
        forward, converged = motion.balanced(*self._shared(), float(given), rate_given, z)
        if not converged:
            return None
        rate, rudder = (given, float(z[1])) if rate_given else (float(z[1]), given)
        return Balance(rate, rudder, float(z[0]), float(forward), z)

    def felt_rad(self, order_rad: float) -> float:
        """Return the rudder that the hull feels once the reading has come to an order from amidships: short of play."""
        return float(np.sign(order_rad)) * max(abs(order_rad) - self.lost_rad, 0.0)

    @property
    def lost_rad(self) -> float:
        """By how much the rudder that the hull feels stays behind its reading, to the side from which it comes."""
        kinds, sizes = self._gear()
        return 0.5 * float(np.sum(sizes[kinds == KINDS["backlash"]]))

    def _gear(self) -> tuple[NDArray[np.int64], Float]:
        parts = zip(self.waters.model.effects, self.waters.model.split(self.effects), strict=True)
        gear = [
            (KINDS[effect.rudder_course], float(own[0])) for effect, own in parts if effect.rudder_course is not None
        ]
        return np.array([kind for kind, _ in gear], dtype=np.int64), np.array([size for _, size in gear])


@dataclass(frozen=True, eq=False)
class Balance:
    """A steady turn."""

    #: yaw_rate_rad_s, rudder_rad: What belongs together; the rudder as the hull feels it.
    yaw_rate_rad_s: float
    rudder_rad: float
    #: lateral_m_s, forward_m_s: Speeds.
    lateral_m_s: float
    forward_m_s: float
    #: Shape (2 + k,). To start from for a turn beside it.
    solution: Float = field(repr=False)


@dataclass(frozen=True, eq=False)
class SailedTrack:
    """A manoeuvre as the simulated ship sailed it."""

    #: Shape (n, 9). Columns of `kempf.pipeline.manoeuvre.motion`.
    rows: Float
    #: Shape (q,). Row at which each phase ended; -1 where it did not.
    ends: NDArray[np.int64]
    #: `SAILED`, `RAN_AWAY` or `NEVER_CAME` of `kempf.pipeline.manoeuvre.motion`.
    how: int

    def column(self, which: int) -> Float:
        """Return a column, shape (n,)."""
        values: Float = self.rows[:, which]
        return values
