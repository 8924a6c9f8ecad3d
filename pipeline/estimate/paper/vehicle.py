"""Any linear vehicle as eqs. (1), (2) and (10) have it: every state measured, some together with a disturbance.

What the vehicle is stands here; what is estimated of her does not. A and B are arguments everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.schemas.errors import UsageError


@dataclass(frozen=True)
class SlowDisturbance:
    """A disturbance that is a state of its own: constant, or a first-order Gauss-Markov process.

    ::

        dW/dt = -mu W + sigma sqrt(2 mu) w
    """

    name: str
    #: One a state. How it enters the dynamics in continuous time, unit of the state a second for one unit of W; a force
    #: has the number 1 in the row of its velocity, its moment the arm in that of the rate.
    enters: tuple[float, ...]
    #: One a state. Column of H1: what it adds to each measurement.
    measured: tuple[float, ...]
    #: sigma, and its standard deviation before anything is measured.
    std: float
    #: mu; 0 for a constant, a state with zero derivative.
    rate_per_s: float = 0.0


@dataclass(frozen=True, eq=False)
class AugmentedVehicle:
    """Vehicle and disturbances as one system for the filter (3)-(5)."""

    #: Shape (n_state + n_disturbance, n_state + n_disturbance).
    A: Float
    #: Shape (n_state + n_disturbance, n_input).
    B: Float
    #: Shape (n_state + n_disturbance, n_disturbance).
    G: Float
    #: Shape (n_state, n_state + n_disturbance). [E H1] of eq. (10).
    H: Float


@dataclass(frozen=True)
class LinearVehicle:
    """What is known of a vehicle before A and B are.

    Raises
    ------
    UsageError
        ``vehicle_invalid``: sizes do not fit, or a number is not finite or has the wrong sign.

    Examples
    --------
    A cart pushed by a constant wind, its speed measured by a log with a constant error:

    >>> wind = SlowDisturbance("wind", enters=(1.0,), measured=(0.0,), std=0.1)
    >>> bias = SlowDisturbance("bias", enters=(0.0,), measured=(1.0,), std=0.1)
    >>> cart = LinearVehicle(("speed",), ("thrust",), (1.0,), 0.5, (wind, bias))
    >>> cart.augmented(np.array([[0.9]]), np.array([[1.0]])).H
    array([[1., 0., 1.]])

    Speed alone cannot separate the two:

    >>> cart.hidden(np.array([[0.9]]))
    ('wind', 'bias')
    """

    #: states, inputs: Names in the order of the columns.
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    #: Standard deviation of each state before anything is measured; their mean is zero.
    state_std: tuple[float, ...]
    #: Step of the discrete model.
    step_s: float
    disturbances: tuple[SlowDisturbance, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.states)
        sizes = [len(self.state_std), *(len(row) for d in self.disturbances for row in (d.enters, d.measured))]
        positive = [self.step_s, *self.state_std, *(d.std for d in self.disturbances)]
        numbers = [x for d in self.disturbances for x in (*d.enters, *d.measured, d.rate_per_s)]
        fault = ""
        if n == 0 or any(size != n for size in sizes):
            fault = f"{n} states, but rows of {sorted(set(sizes))} numbers"
        elif not all(np.isfinite(x) and x > 0.0 for x in positive):
            fault = "a step or a standard deviation that is not positive"
        elif not all(np.isfinite(numbers)) or any(d.rate_per_s < 0.0 for d in self.disturbances):
            fault = "a number that is not finite, or a negative correlation rate"
        if fault:
            raise UsageError(
                "vehicle_invalid",
                f"The vehicle model has {fault}.",
                "Give one number a state in state_std, enters and measured; positive steps and deviations.",
            )

    @property
    def carried(self) -> Float:
        """H1 of eq. (10), shape (n_state, n_disturbance)."""
        rows = [d.measured for d in self.disturbances]
        return np.array(rows, dtype=np.float64).reshape(len(rows), len(self.states)).T

    @property
    def initial_covariance(self) -> Float:
        """P[0] of states and disturbances, diagonal."""
        return np.diag(np.square([*self.state_std, *(d.std for d in self.disturbances)]))

    def entering(self, A: Float) -> Float:
        """Return how a disturbance held over a step enters the states, shape (n_state, n_disturbance).

        The integral of e^{A_c s} over the step by the trapezoid between its ends, E and A: the discrete A alone is
        needed, and it need have no logarithm.

        Parameters
        ----------
        A : ndarray, shape (n_state, n_state)
        """
        rows = [d.enters for d in self.disturbances]
        direction = np.array(rows, dtype=np.float64).reshape(len(rows), len(self.states)).T
        result: Float = 0.5 * self.step_s * (direction + A @ direction)
        return result

    def augmented(self, A: Float, B: Float) -> AugmentedVehicle:
        """Join states and disturbances.

        Parameters
        ----------
        A : ndarray, shape (n_state, n_state)
        B : ndarray, shape (n_state, n_input)
        """
        n, m = len(self.states), len(self.disturbances)
        decay = np.exp([-d.rate_per_s * self.step_s for d in self.disturbances])
        whole = np.zeros((n + m, n + m))
        whole[:n, :n], whole[:n, n:], whole[n:, n:] = A, self.entering(A), np.diag(decay)
        G = np.zeros((n + m, m))
        G[n:] = np.diag([d.std for d in self.disturbances] * np.sqrt(1.0 - decay**2))
        return AugmentedVehicle(
            whole, np.vstack([B, np.zeros((m, B.shape[1]))]), G, np.hstack([np.eye(n), self.carried])
        )

    def hidden(self, A: Float) -> tuple[str, ...]:
        """Name the states and disturbances that the measurements leave undetermined; empty where (A, H) is observable.

        Every column is scaled by its prior standard deviation, every measurement by what the priors let it vary.

        Parameters
        ----------
        A : ndarray, shape (n_state, n_state)
        """
        system = self.augmented(A, np.zeros((len(self.states), len(self.inputs))))
        std = np.sqrt(np.diag(self.initial_covariance))
        size = std.size
        row = system.H * std / np.linalg.norm(system.H * std, axis=1, keepdims=True)
        step = system.A * std / std[:, None]
        rows = [row]
        for _ in range(size - 1):
            row = row @ step
            row = row / max(float(np.max(np.abs(row))), 1e-300)
            rows.append(row)
        _, singular, right = np.linalg.svd(np.vstack(rows))
        blind = right[int(np.count_nonzero(singular > 1e-9 * singular[0])) :]
        weight = np.max(np.abs(blind), axis=0, initial=0.0)
        names = (*self.states, *(d.name for d in self.disturbances))
        return tuple(name for name, w in zip(names, weight, strict=True) if w > 0.1)
