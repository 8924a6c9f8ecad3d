"""The linear ship as a controller's designer wants her: A, B, C, D with names and units, continuous or discrete.

States v, r, psi and, where the model has them, the wind force F and the current: V_T of eq. (16), or c_N and c_E fixed
over ground; then the states of effects and of the rudder's way to the hull. psi is the heading counted from the course;
with c_N and c_E the lateral speed of eq. (19) is taken at that course, to first order. The disturbances have the
correlation rates of the model, or none at all (zero derivative, as an integrating controller wants them).
Discrete matrices are exact for a rudder held over the step; the noise of the step by Van Loan (1978), "Computing
integrals involving the matrix exponential", IEEE Transactions on Automatic Control 23.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import cos, isfinite, sin

import numpy as np
from scipy.linalg import expm

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.chain import N_CHAIN, PSI, F, R, V
from kempf.pipeline.model.disturbances import level_of_change
from kempf.pipeline.model.ship import Hull
from kempf.pipeline.model.zero_order_hold import zero_order_hold
from kempf.pipeline.steering.motion import ShipEffects, linear_motion
from kempf.pipeline.steering.nomoto import require_numbers
from kempf.pipeline.steering.rudder_path import rudder_path
from kempf.schemas.errors import UsageError
from kempf.schemas.model_spec import ModelSpec

#: name and unit of what the model puts out, in order
OUTPUTS = {"lateral_speed": "m/s", "yaw_rate": "rad/s", "heading": "rad", "cross_track_speed": "m/s"}
#: how many of them an instrument measures
N_MEASURED = 3
#: changes of the wind force, m/s^2, and of the current, m/s, and the times they take, s
_CHANGES = ((1.1e-3, 300.0), (0.056, 1800.0))
#: time constants that a state may forget in within one piece of a step
_FORGETS = 4.0
#: units of the states that effects of the catalogue bring along
_UNITS = {"memory_m1": "m/s", "waves_m1": "rad", "waves_m2": "rad"}


@dataclass(frozen=True)
class NoiseLevels:
    """Standard deviations of the disturbances and the measurements."""

    #: wind_m_s2, current_m_s: Of the wind force and the current in the long run: sigma_F and sigma_V of eq. (16), with
    #: the correlation rates of the model they are used with (`usual_levels`).
    wind_m_s2: float
    current_m_s: float
    #: lateral_speed_m_s, yaw_rate_rad_s, heading_rad: Of one measurement.
    lateral_speed_m_s: float = 0.05
    yaw_rate_rad_s: float = 5.2e-4
    heading_rad: float = 9e-4


def usual_levels(spec: ModelSpec) -> NoiseLevels:
    """Return the levels of usual weather and instruments: a force and a stream that change as `_CHANGES` says.

    Parameters
    ----------
    spec : ModelSpec
        Its correlation rates say which levels in the long run these changes belong to.
    """
    (force, force_s), (stream, stream_s) = _CHANGES
    return NoiseLevels(
        level_of_change(force, force_s, spec.wind_correlation_rate_per_s),
        level_of_change(stream, stream_s, spec.current_correlation_rate_per_s),
    )


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x' = A x + B u + noise (continuous) or x[k+1] = A x[k] + B u[k] + noise (discrete); y = C x + D u."""

    #: Shape (n, n).
    A: Float
    #: Shape (n, 1).
    B: Float
    #: Shape (4, n).
    C: Float
    #: Shape (4, 1). Zero but for an effect that measures accelerations.
    D: Float
    #: Shape (n, n). Covariance of the noise of a step; of a continuous model its intensity (covariance per second).
    Q: Float
    #: Shape (3, 3). Covariance of one measurement of the first three outputs.
    R: Float
    #: states, inputs, outputs: Unit by name, in order.
    states: dict[str, str]
    inputs: dict[str, str]
    outputs: dict[str, str]
    speed_m_s: float
    course_rad: float
    #: None for a continuous model.
    step_s: float | None
    #: With which she holds the course in calm air; u is counted from it.
    rudder_rad: float = 0.0
    #: Shape (4,). Outputs on that course; y is counted from them.
    offsets: Float = field(default_factory=lambda: np.zeros(len(OUTPUTS)))

    @property
    def measured(self) -> Float:
        """H: the rows of C that instruments measure, shape (3, n)."""
        return self.C[:N_MEASURED]

    @property
    def steered(self) -> list[int]:
        """Which states the rudder moves; v, r and psi are always among them."""
        states = [i for i in range(len(self.states)) if i <= PSI or self.B[i, 0] != 0.0]
        for i in states:  # grows while it is walked
            states += [int(j) for j in np.flatnonzero(self.A[:, i]) if j not in states]
        return sorted(states)


def continuous(
    hull: Hull,
    spec: ModelSpec,
    speed_m_s: float,
    *,
    arm_per_m: float = 0.0,
    course_rad: float = 0.0,
    noise: NoiseLevels | None = None,
    constant_disturbances: bool = False,
    effects: ShipEffects | None = None,
) -> StateSpace:
    """Return the continuous model, eq. (16) with the heading, the disturbances and what effects bring as states.

    Parameters
    ----------
    spec : ModelSpec
        Which disturbances, and their correlation rates.
    speed_m_s : float
        Speed through the water V.
    arm_per_m : float, optional
        l of eq. (16), 1/m.
    course_rad : float, optional
        Course round which eq. (19) is taken; matters with an earth-fixed current only.
    noise : NoiseLevels, optional
        Default `usual_levels(spec)`.
    constant_disturbances : bool, optional
        Zero derivatives in place of the correlation rates; the noise that drives them stays.
    effects : ShipEffects, optional
        Linearised; `kempf.pipeline.steering.carried` says what comes of each.

    Raises
    ------
    UsageError
        The speed is not positive or the course not finite.
    DataRejected
        A parameter is not a number.
    """
    require_numbers(hull, speed_m_s)
    if not isfinite(course_rad):
        raise UsageError("course_not_finite", "The course is not a finite number.", "Give a course in degrees.")
    levels = noise or usual_levels(spec)
    motion = linear_motion(hull, effects, speed_m_s, arm_per_m=arm_per_m, course_rad=course_rad)
    path = rudder_path(effects)
    states = {"v": "m/s", "r": "rad/s", "psi": "rad"}
    if spec.wind == "force":
        states["F"] = "m/s^2"
    if spec.current != "none":
        states |= {"V_T": "m/s"} if spec.current == "lateral" else {"c_N": "m/s", "c_E": "m/s"}
    slow, moved = list(states)[3:], motion.own_states
    states |= {name: _UNITS.get(name, "of its effect") for name in _names(effects, moved)}
    states |= dict.fromkeys(path.states, "rad")
    n, k = len(states), len(path.states)
    A, B, C, Q = np.zeros((n, n)), np.zeros((n, 1)), np.zeros((len(OUTPUTS), n)), np.zeros((n, n))
    # rows and columns of the motion, and where they stand here
    own = len(slow) + 3 + np.arange(len(moved))
    there = [V, R, PSI, *([F] if "F" in slow else []), *moved]
    here = np.array([0, 1, 2, *([3] if "F" in slow else []), *own])
    A[np.ix_(here, here)] = motion.A[np.ix_(there, there)]
    A[np.ix_(here, np.arange(n - k, n))] = np.outer(motion.B[there], path.C)
    A[n - k :, n - k :], B[here, 0], B[n - k :, 0] = path.A, motion.B[there] * path.D, path.B
    C[:N_MEASURED, here] = motion.C[:, there]
    C[:N_MEASURED, n - k :] = np.outer(motion.D, path.C)
    C[3, 0], C[3, 2] = 1.0, speed_m_s
    across = {"V_T": 1.0, "c_N": -sin(course_rad), "c_E": cos(course_rad)}
    for i, name in enumerate(slow, start=3):
        mu = spec.wind_correlation_rate_per_s if name == "F" else spec.current_correlation_rate_per_s
        A[i, i] = 0.0 if constant_disturbances else -mu
        Q[i, i] = 2.0 * mu * (levels.wind_m_s2 if name == "F" else levels.current_m_s) ** 2
        if name != "F":
            C[0, i] = C[3, i] = across[name]
    Q[own, own] = [motion.noise[i - N_CHAIN] for i in moved]
    R_ = np.diag(np.square([levels.lateral_speed_m_s, levels.yaw_rate_rad_s, levels.heading_rad]))
    D = np.zeros((len(OUTPUTS), 1))
    D[:N_MEASURED, 0] = motion.D * path.D
    offsets = np.array([*motion.offsets, motion.sway_m_s])
    units = ({"rudder": "rad"}, dict(OUTPUTS))
    return StateSpace(A, B, C, D, Q, R_, states, *units, speed_m_s, course_rad, None, motion.rudder_rad, offsets)


def _names(effects: ShipEffects | None, moved: list[int]) -> list[str]:
    every = [f"{e.name}_{state.name}" for e in (effects.model.effects if effects else ()) for state in e.states]
    return [every[i - N_CHAIN] for i in moved]


def discretised(model: StateSpace, step_s: float) -> StateSpace:
    """Return a continuous model sampled at a step, the rudder held over it.

    Parameters
    ----------
    model : StateSpace
        Continuous.
    step_s : float
        Step, s.

    Raises
    ------
    UsageError
        The step is not positive, or the model is discrete already.
    """
    if model.step_s is not None or not (isfinite(step_s) and step_s > 0.0):
        raise UsageError(
            "step_not_positive",
            f"A step of {step_s:g} s cannot be sampled at (the model has the step {model.step_s}); expected a "
            "continuous model and more than 0 s.",
            "Give a step in seconds.",
        )
    A, B = zero_order_hold(model.A, model.B, step_s)
    return replace(model, A=A, B=B, Q=_noise_of_a_step(model.A, model.Q, step_s), step_s=step_s)


def _noise_of_a_step(A: Float, Q: Float, step_s: float) -> Float:
    """Integrate the noise over a step, halved where a state forgets so fast that its inverse would overflow."""
    n = A.shape[0]
    fastest = float(np.max(np.abs(np.linalg.eigvals(A).real), initial=0.0)) * step_s
    halvings = max(0, int(np.ceil(np.log2(max(fastest, 1e-300) / _FORGETS))))
    part_s = step_s / 2**halvings
    loan = np.zeros((2 * n, 2 * n))
    loan[:n, :n], loan[:n, n:], loan[n:, n:] = -A * part_s, Q * part_s, A.T * part_s
    step = expm(A * part_s)
    noise: Float = step @ expm(loan)[:n, n:]
    for _ in range(halvings):
        noise = step @ noise @ step.T + noise
        step = step @ step
    return 0.5 * (noise + noise.T)
