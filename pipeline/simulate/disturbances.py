"""What wind and stream do to the ship: constants plus first-order Gauss-Markov processes, drawn before the run.

A process is exact on the fine grid (not an Euler step of its equation) and linear between the points of the grid, so
the path does not depend on the integrator's step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.simulate.compiled import compiled
from kempf.pipeline.simulate.random_streams import stream

Float = NDArray[np.float64]

#: Columns of the forcing table, in the order the plant reads them.
FORCING = ("wind_force", "current_north", "current_east", "lateral_current")


@dataclass(frozen=True)
class Disturbance:
    """A constant plus a stationary Gauss-Markov process: dx/dt = -mu x + sigma sqrt(2 mu) w.

    Parameters
    ----------
    mean : float
        The constant part.
    std : float
        sigma, standard deviation of the slow part, same unit.
    correlation_rate_per_s : float
        mu, 1/s.
    """

    mean: float = 0.0
    std: float = 0.0
    correlation_rate_per_s: float = 1.0 / 300.0

    def path(self, n: int, step_s: float, random: np.random.Generator) -> Float:
        """Return n values ``step_s`` apart, shape (n,); started from the stationary distribution."""
        if self.std == 0.0:
            return np.full(n, self.mean)
        white = random.standard_normal(n)
        return self.mean + _gauss_markov(white, self.std, float(np.exp(-self.correlation_rate_per_s * step_s)))

    def scaled(self, factor: float) -> Disturbance:
        """Return the disturbance with mean and standard deviation multiplied."""
        return replace(self, mean=self.mean * factor, std=self.std * factor)


@compiled
def _gauss_markov(white: Float, std: float, memory: float) -> Float:
    """Return x with x[0] = std w[0], x[k] = memory x[k-1] + std sqrt(1 - memory^2) w[k], shape (n,)."""
    x = np.empty_like(white)
    gain = std * np.sqrt(1.0 - memory * memory)
    last = std * white[0]
    x[0] = last
    for k in range(1, white.size):
        last = memory * last + gain * white[k]
        x[k] = last
    return x


@dataclass(frozen=True)
class Environment:
    """Wind, stream and water of a trial.

    Parameters
    ----------
    wind_force : Disturbance
        F of eq. (16), m/s^2, positive to starboard. As in the paper it does not depend on the heading.
    current_north, current_east : Disturbance
        The stream over ground, m/s.
    lateral_current : Disturbance
        V_T of eq. (16), m/s: added to the ground velocity across the ship, to starboard, whatever her heading.
    wind_speed : Disturbance
        True wind at the anemometer, m/s; it shows on the anemometer only, the force is `wind_force`.
    wind_from_rad : float
        Where the true wind blows from, clockwise from north.
    water_depth_m : float
        Depth below the transducer.
    """

    wind_force: Disturbance = Disturbance()
    current_north: Disturbance = Disturbance()
    current_east: Disturbance = Disturbance()
    lateral_current: Disturbance = Disturbance()
    wind_speed: Disturbance = Disturbance(8.0, 0.5, 1.0 / 20.0)
    wind_from_rad: float = 4.0
    water_depth_m: float = 60.0

    def scaled(self, factor: float) -> Environment:
        """Return the environment with the force and the streams multiplied by ``factor``."""
        return replace(
            self,
            wind_force=self.wind_force.scaled(factor),
            current_north=self.current_north.scaled(factor),
            current_east=self.current_east.scaled(factor),
            lateral_current=self.lateral_current.scaled(factor),
        )

    def forcing(self, n: int, step_s: float, seed: int) -> Float:
        """Return the paths of `FORCING`, shape (n, 4), in m/s^2 and m/s."""
        paths: list[Disturbance] = [getattr(self, name) for name in FORCING]
        columns = [p.path(n, step_s, stream(seed, name)) for p, name in zip(paths, FORCING, strict=True)]
        return np.ascontiguousarray(np.column_stack(columns))


#: No wind force and no stream.
CALM = Environment()
