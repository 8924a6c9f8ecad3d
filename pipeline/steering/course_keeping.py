"""A course-keeping law synthesised from a parameter set: rudder from estimated state and disturbances.

The plant is eq. (16) with the heading; the estimator is the filter (3)-(5) at its steady gain, over the plant augmented
with the wind force F and the current across the course V_T, both with zero derivative. Their estimates give the steady
sway and rudder with which she holds her heading in that wind, and the regulator works on what differs from them:

    delta = delta_F F^ - k (x^ - x_F F^),        x = (v, r, psi)

so that a steady wind is met by a steady rudder and leaves no heading error, also where the parameters are wrong: a
constant innovation would let F^ grow. States that effects bring along, such as a rudder that lags behind its reading,
are estimated like those of the ship, and fed back where the rudder moves them. References: Johnson (1971),
"Accommodation of external disturbances in linear regulator and servomechanism problems", IEEE Transactions on Automatic
Control 16; Kallstrom, Astrom, Thorell, Eriksson and Sten (1979), "Adaptive autopilots for tankers", Automatica 15;
Koyama (1967) for the cost.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from typing import Literal

import numpy as np
from scipy.linalg import solve_discrete_are
from scipy.signal import place_poles

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.ship import Hull
from kempf.pipeline.steering.motion import ShipEffects, equivalent_hull
from kempf.pipeline.steering.nomoto import largest_rate_per_s, turning_frequency_rad_s
from kempf.pipeline.steering.state_space import NoiseLevels, StateSpace, continuous, discretised
from kempf.schemas.errors import DataRejected, UsageError
from kempf.schemas.model_spec import ModelSpec

#: the place of r, psi and the wind force among the states: v, r, psi, F, V_T, then those of effects
_R, _PSI, _F = 1, 2, 3


@dataclass(frozen=True)
class LawSettings:
    """What a law is made to."""

    #: One of {"lqr", "poles"}. ``lqr`` makes the sum of psi^2 + ``rudder_weight`` delta^2 least; ``poles`` places the
    #: poles.
    method: Literal["lqr", "poles"] = "lqr"
    #: Of ``lqr``: cost of a squared radian of rudder beside one of heading.
    rudder_weight: float = 1.0
    #: bandwidth, damping: Of ``poles``: natural frequency of the heading in units of V sqrt(|b2|), and its damping; the
    #: third pole stays where the ship has her faster one.
    bandwidth: float = 1.0
    damping: float = 0.8
    #: Time between two orders; None takes a fifth of her fastest time constant, between 0.1 and 1 s.
    step_s: float | None = None
    #: rudder_limit_rad, rudder_rate_rad_s: Largest angle and rate of the rudder.
    rudder_limit_rad: float = radians(35.0)
    rudder_rate_rad_s: float = radians(2.5)


@dataclass(frozen=True, eq=False)
class Law:
    """A course-keeping law, all constants."""

    #: What it takes the ship for: discrete, states v, r, psi, F, V_T, then those of effects.
    plant: StateSpace
    #: Shape (n_steered,). k: rudder per unit of the states that the rudder moves, v, r, psi first.
    gain: Float
    #: delta_F, rad per m/s^2.
    rudder_per_force: float
    #: Shape (n_steered,). x_F: these states per m/s^2; r and psi are 0.
    state_per_force: Float
    #: Shape (n_state, 3). Steady gain of the filter, applied to the innovation of (y_v, y_r, y_psi).
    observer: Float
    settings: LawSettings

    @property
    def step_s(self) -> float:
        """Time between two orders, s."""
        assert self.plant.step_s is not None
        return self.plant.step_s

    @property
    def feedback(self) -> Float:
        """The whole law as one row, shape (n_state,): delta = -feedback x^, counted from the rudder of the course."""
        row = np.zeros(len(self.plant.states))
        row[self.plant.steered] = self.gain
        row[_F] = -(self.rudder_per_force + self.gain @ self.state_per_force)
        return row

    def order(self, estimate: Float) -> float:
        """Return the rudder order for an estimated state, shape (n_state,), within the limit, rad."""
        limit = self.settings.rudder_limit_rad
        return min(max(self.plant.rudder_rad - float(self.feedback @ estimate), -limit), limit)

    def predict(self, estimate: Float, rudder_rad: float) -> Float:
        """Return the state a step later, shape (n_state,), for the mean rudder of the step."""
        ahead: Float = self.plant.A @ estimate + self.plant.B[:, 0] * (rudder_rad - self.plant.rudder_rad)
        return ahead

    def correct(self, predicted: Float, measured: Float) -> Float:
        """Return the state after a measurement, shape (3,); what is NaN is not corrected with."""
        innovation = measured - self.plant.offsets[: measured.size] - self.plant.measured @ predicted
        corrected: Float = predicted + self.observer @ np.where(np.isfinite(innovation), innovation, 0.0)
        return corrected


def course_law(
    hull: Hull,
    speed_m_s: float,
    *,
    arm_per_m: float = 0.0,
    spec: ModelSpec | None = None,
    noise: NoiseLevels | None = None,
    settings: LawSettings | None = None,
    effects: ShipEffects | None = None,
) -> Law:
    """Synthesise a course-keeping law.

    Parameters
    ----------
    hull : Hull
        The six parameters that the ship is taken to have.
    arm_per_m : float, optional
        l of eq. (16), 1/m.
    spec : ModelSpec, optional
        Correlation rates of the disturbances, which say how fast they may change.
    effects : ShipEffects, optional
        That the ship is taken to have.

    Raises
    ------
    UsageError
        A setting is out of its range.
    DataRejected
        These parameters allow no law: the rudder does not turn such a ship, or her wind and current cannot be separated
        from the measurements.
    """
    chosen = settings or LawSettings()
    _check(chosen)
    of_model = spec or ModelSpec()
    lateral = of_model.model_copy(update={"wind": "force", "current": "lateral"})
    model = continuous(
        hull, lateral, speed_m_s, arm_per_m=arm_per_m, noise=noise, constant_disturbances=True, effects=effects
    )
    settled = equivalent_hull(hull, effects, speed_m_s)
    plant = discretised(model, chosen.step_s or _default_step_s(settled, speed_m_s))
    rudder_per_force, state_per_force = _steady(model)
    steered = plant.steered
    A, B = plant.A[np.ix_(steered, steered)], plant.B[steered]
    if _deficient(A.T, B.T):
        raise _no_law("the rudder does not move every motion of such a ship")
    try:
        gain = _lqr(A, B, chosen) if chosen.method == "lqr" else _placed(A, B, settled, speed_m_s, plant, chosen)
        observer = _observer(plant)
    except (np.linalg.LinAlgError, ValueError) as error:
        raise _no_law(f"the design equation has no solution ({error})") from error
    return Law(plant, gain, rudder_per_force, state_per_force, observer, chosen)


def _default_step_s(hull: Hull, speed_m_s: float) -> float:
    """Return a fifth of the ship's fastest time constant, in tenths of a second, between 0.1 and 1 s."""
    fifth = 0.2 / max(largest_rate_per_s(hull, speed_m_s), 1e-9)
    return float(min(max(np.floor(10.0 * fifth) / 10.0, 0.1), 1.0))


def _steady(model: StateSpace) -> tuple[float, Float]:
    """Solve the continuous model at rest for r = psi = 0: what holds the heading under a unit force."""
    steered = model.steered
    rows, free = [i for i in steered if i != _PSI], [i for i in steered if i not in (_R, _PSI)]
    matrix = np.column_stack([model.A[np.ix_(rows, free)], model.B[rows, 0]])
    sizes = np.linalg.norm(matrix, axis=1)
    if abs(float(np.linalg.det(matrix))) <= 1e-12 * float(np.prod(sizes)):
        raise _no_law("no rudder angle holds such a ship against a steady wind")
    solved = np.linalg.solve(matrix, -model.A[rows, _F])
    states = np.zeros(len(steered))
    states[[steered.index(i) for i in free]] = solved[:-1]
    return float(solved[-1]), states


def _lqr(A: Float, B: Float, settings: LawSettings) -> Float:
    cost = np.zeros_like(A)
    cost[_PSI, _PSI] = 1.0
    weight = np.array([[settings.rudder_weight]])
    P = solve_discrete_are(A, B, cost, weight)
    gain: Float = np.linalg.solve(weight + B.T @ P @ B, B.T @ P @ A)[0]
    return gain


def _placed(A: Float, B: Float, hull: Hull, V: float, plant: StateSpace, settings: LawSettings) -> Float:
    assert plant.step_s is not None
    w, z = settings.bandwidth * turning_frequency_rad_s(hull, V), settings.damping
    swing = w * np.emath.sqrt(z**2 - 1.0)
    fast = -max(largest_rate_per_s(hull, V), 1.1 * w)
    # what effects add keeps the pace that it has, as far as it is stable
    steered = plant.steered
    added = np.linalg.eigvals(plant.A[np.ix_(steered[3:], steered[3:])]) if len(steered) > 3 else np.zeros(0)
    poles = np.concatenate([np.exp(np.array([-z * w + swing, -z * w - swing, fast]) * plant.step_s), added])
    gain: Float = np.real(place_poles(A, B, poles, method="YT").gain_matrix[0])
    return gain


def _observer(plant: StateSpace) -> Float:
    """Steady gain of eqs. (4)-(5), in the form that corrects the prediction."""
    A, H, R = plant.A, plant.measured, plant.R
    if _deficient(A, H):
        raise _no_law("wind and current cannot be separated by such a ship")
    P = solve_discrete_are(A.T, H.T, plant.Q, R)
    gain: Float = np.linalg.solve(H @ P @ H.T + R, H @ P).T
    return gain


def _deficient(A: Float, H: Float) -> bool:
    """Say whether a motion that neither grows nor decays is not seen in H x (Hautus 1969); rows of unit length.

    m/s, rad and m/s^2 differ by orders of magnitude, and a rank is about directions.
    """
    rows = np.vstack([np.eye(A.shape[0]) - A, H])
    scaled = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
    return bool(np.linalg.matrix_rank(scaled) < A.shape[0])


def _check(settings: LawSettings) -> None:
    positive = {
        "rudder_weight": settings.rudder_weight,
        "bandwidth": settings.bandwidth,
        "damping": settings.damping,
        "rudder_limit_rad": settings.rudder_limit_rad,
        "rudder_rate_rad_s": settings.rudder_rate_rad_s,
        "step_s": 1.0 if settings.step_s is None else settings.step_s,
    }
    for name, value in positive.items():
        if not (np.isfinite(value) and value > 0.0):
            raise UsageError("law_setting", f"{name} is {value:g}, expected more than 0.", f"Give a positive {name}.")


def _no_law(why: str) -> DataRejected:
    return DataRejected(
        "no_course_keeping_law",
        f"No course-keeping law follows from these parameters: {why}.",
        "Take a parameter set whose signs are those of a ship (b2 above 0, a11 and a22 below), such as one by maximum "
        "likelihood.",
    )
