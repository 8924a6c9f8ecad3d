"""The ship near a steady straight course: d(v, r, F, M, effects' states)/dt as a linear system, and its six parameters.

Without effects that is eq. (16) as it stands. With effects it is their derivative at the course
(`kempf.pipeline.steering.linearise`), and the six parameters are those of a ship of eq. (16) that moves likewise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.chain import N_CHAIN, PSI, F, M, R, V
from kempf.pipeline.model.ship import Hull

if TYPE_CHECKING:
    from kempf.pipeline.model.effect_model import EffectModel

_STEP = 2.0**-20


@dataclass(frozen=True, eq=False)
class ShipEffects:
    """The effects that a ship was identified with."""

    model: EffectModel
    #: Shape (p,). Their parameters.
    values: Float
    #: length_m, draught_m: Those that the effects were fitted with.
    length_m: float = 100.0
    draught_m: float = 1.0
    #: Which log the ship is as in, 0 for the first: what a change of the load goes by.
    day: float = 0.0

    def without(self, *names: str) -> ShipEffects:
        """Return them with some of them absent."""
        kept = [p.absent if effect.name in names else np.nan for effect, p in self.model.parameters]
        return replace(self, values=np.where(np.isnan(kept), self.values, kept))

    def of(self, name: str) -> Float:
        """Return the parameters of one of them, shape (q,)."""
        return self.values[self.model.own(name)]


@dataclass(frozen=True, eq=False)
class LinearMotion:
    """The linear system."""

    #: Shape (5 + k, 5 + k). On v, r, psi, F, M and the effects' own states.
    A: Float
    #: Shape (5 + k,). Of the rudder that the hull feels.
    B: Float
    #: Shape (3, 5 + k). Of measured lateral speed, without the current, yaw rate and heading.
    C: Float
    #: Shape (3,).
    D: Float
    #: Shape (k,). Intensity squared of what drives the effects' states.
    noise: Float
    #: rudder_rad, sway_m_s: With which she holds the course in calm air.
    rudder_rad: float
    sway_m_s: float
    #: Shape (3,). What is measured then.
    offsets: Float
    #: Shape (3,). Share by which a derivative jumps across the course, by sway, turn and rudder; 0 where it is smooth.
    corners: Float

    @property
    def own_states(self) -> list[int]:
        """Which of the effects' states take part: they are moved by something, and something goes by them."""
        own = range(N_CHAIN, self.A.shape[0])
        goes_by = self.A != 0.0
        seen = _reached([i for i in own if goes_by[[V, R], i].any() or self.C[:, i].any()], goes_by, own)
        driven = [i for i in own if goes_by[i, [V, R]].any() or self.B[i] != 0.0 or self.noise[i - N_CHAIN] > 0.0]
        return sorted(set(seen) & set(_reached(driven, goes_by.T, own)))


def _reached(begin: list[int], goes_by: np.ndarray, own: range) -> list[int]:
    states = list(begin)
    for i in states:  # grows while it is walked
        states += [j for j in own if goes_by[i, j] and j not in states]
    return states


def linear_motion(
    hull: Hull,
    effects: ShipEffects | None,
    speed_m_s: float,
    *,
    arm_per_m: float = 0.0,
    course_rad: float = 0.0,
) -> LinearMotion:
    """Linearise a ship about a steady straight course.

    Parameters
    ----------
    speed_m_s : float
        Through the water.
    arm_per_m : float, optional
        l of eq. (16), 1/m.
    course_rad : float, optional
        True course, which some measurements go by.
    """
    if effects is not None:
        from kempf.pipeline.steering.linearise import motion_with_effects

        return motion_with_effects(hull, effects, speed_m_s, arm_per_m, course_rad)
    A, B = np.zeros((N_CHAIN, N_CHAIN)), np.zeros(N_CHAIN)
    own, by_rudder = hull.continuous(speed_m_s)
    A[:2, :2], B[:2] = own, by_rudder[:, 0]
    A[V, F], A[R, F], A[R, M], A[PSI, R] = 1.0, arm_per_m, 1.0, 1.0
    return LinearMotion(A, B, np.eye(3, N_CHAIN), np.zeros(3), np.zeros(0), 0.0, 0.0, np.zeros(3), np.zeros(3))


@dataclass(frozen=True, eq=False)
class LinearHull:
    """The ship of eq. (16) that moves as a ship with effects does near a straight course."""

    #: With the effects' own states settled, as in slow motion.
    hull: Hull
    #: Shape (6, 6). By the delta method from that of hull and effects.
    covariance: Float
    #: Whether there are such states.
    settled: bool


def equivalent_hull(hull: Hull, effects: ShipEffects | None, speed_m_s: float) -> Hull:
    """Return the ship of eq. (16) that moves as one with effects does near a straight course, slow motion assumed."""
    if effects is None:
        return hull
    return Hull(*_settled(linear_motion(hull, effects, speed_m_s), speed_m_s).tolist())


def linear_hull(hull: Hull, effects: ShipEffects | None, covariance: Float, speed_m_s: float) -> LinearHull:
    """Return the equivalent hull with its covariance.

    Parameters
    ----------
    covariance : ndarray, shape (6 + p, 6 + p)
        Of hull and effects; NaN where unknown.
    """
    if effects is None:
        return LinearHull(hull, covariance, settled=False)
    centre = np.concatenate([hull.array(), effects.values])

    def six(theta: Float) -> Float:
        return equivalent_hull(Hull(*theta[:6].tolist()), replace(effects, values=theta[6:]), speed_m_s).array()

    spread = np.sqrt(np.nan_to_num(np.diag(covariance)))
    slopes = np.empty((6, centre.size))
    for k, step in enumerate(_STEP * np.maximum(np.maximum(np.abs(centre), spread), 1e-12)):
        move = np.zeros(centre.size)
        move[k] = step
        slopes[:, k] = (six(centre + move) - six(centre - move)) / (2.0 * step)
    # what does not act on the hull may have no error either
    used = np.any(slopes != 0.0, axis=0)
    own = linear_motion(hull, effects, speed_m_s)
    states = [i for i in own.own_states if own.A[[V, R], i].any()]
    carried = slopes[:, used] @ covariance[np.ix_(used, used)] @ slopes[:, used].T
    return LinearHull(equivalent_hull(hull, effects, speed_m_s), carried, settled=bool(states))


def _settled(motion: LinearMotion, speed_m_s: float) -> Float:
    """Eliminate the effects' states at rest; return a11, a12, a21, a22, b1, b2."""
    own, ship = [i for i in motion.own_states if motion.A[[V, R], i].any()], [V, R]
    A, B = motion.A[np.ix_(ship, ship)], motion.B[ship]
    if own:
        inner = np.linalg.solve(
            motion.A[np.ix_(own, own)], np.column_stack([motion.A[np.ix_(own, ship)], motion.B[own]])
        )
        across = motion.A[np.ix_(ship, own)]
        A, B = A - across @ inner[:, :2], B - across @ inner[:, 2]
    return np.concatenate([A.ravel() / speed_m_s, B / speed_m_s**2])
