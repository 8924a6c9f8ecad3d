"""From the rudder's reading to the rudder that the hull feels, as a linear system: lags and dead times in a row.

A dead time is the Padé approximation of the second order, all-pass, in the continuous system and in the discrete one
made from it: both then have the same states, few and whatever the step. At one radian of phase it errs by 0.0014 rad.
Reference: Golub and Van Loan (2013), "Matrix Computations", 4th ed., sect. 9.3.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.steering.motion import ShipEffects

#: a shorter time than this acts like this one, s
_SHORTEST_S = 1e-3


@dataclass(frozen=True, eq=False)
class RudderPath:
    """x' = A x + B u, y = C x + D u: u the reading, y what the hull feels, rad."""

    #: Shape (k, k).
    A: Float
    #: B, C: Shape (k,).
    B: Float
    C: Float
    D: float
    #: Names; all in rad.
    states: tuple[str, ...]

    def then(self, other: RudderPath) -> RudderPath:
        """Return the path that goes on through another."""
        n, m = len(self.states), len(other.states)
        A = np.zeros((n + m, n + m))
        A[:n, :n], A[n:, n:], A[n:, :n] = self.A, other.A, np.outer(other.B, self.C)
        B = np.concatenate([self.B, other.B * self.D])
        return RudderPath(
            A, B, np.concatenate([other.D * self.C, other.C]), other.D * self.D, (*self.states, *other.states)
        )


def rudder_path(effects: ShipEffects | None) -> RudderPath:
    """Return what the effects on the rudder's course make of it, those without a linear model left out."""
    path = RudderPath(np.zeros((0, 0)), np.zeros(0), np.zeros(0), 1.0, ())
    if effects is None:
        return path
    for effect in effects.model.effects:
        if effect.rudder_course in _LINEAR:
            seconds = float(effects.of(effect.name)[0])
            if seconds > 0.0:
                path = path.then(_LINEAR[effect.rudder_course](effect.name, max(seconds, _SHORTEST_S)))
    return path


def _lag(name: str, tau_s: float) -> RudderPath:
    return RudderPath(np.array([[-1.0 / tau_s]]), np.array([1.0 / tau_s]), np.ones(1), 0.0, (name,))


def _dead_time(name: str, tau_s: float) -> RudderPath:
    # y = u - z2 with z1' = z2 / tau, z2' = (12 u - 12 z1 - 6 z2) / tau
    A = np.array([[0.0, 1.0], [-12.0, -6.0]]) / tau_s
    return RudderPath(A, np.array([0.0, 12.0 / tau_s]), np.array([0.0, -1.0]), 1.0, (f"{name}_1", f"{name}_2"))


#: by what an effect makes of the rudder's course; a play and a rate limit have no linear model
_LINEAR: dict[str, Callable[[str, float], RudderPath]] = {"rudder_lag": _lag, "dead_time": _dead_time}
