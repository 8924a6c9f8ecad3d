"""A tiny ship for the tests: first-order Nomoto with a rate-limited rudder, stepped at 0.02 s, and her instruments.

With ``straight`` below zero she is unstable on a straight course, and the cube of her yaw rate holds her (Norrbin).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from kempf.pipeline.channels.series import Float, Series

STEP_S = 0.02
START_NS = 1_750_000_000_000_000_000


@dataclass
class Ship:
    """State and orders in deg and s; ``scale`` stretches time, so that a boat and a tanker can be had."""

    gain_per_s: float = 0.06
    time_constant_s: float = 12.0
    rudder_rate_deg_s: float = 2.5
    scale: float = 1.0
    drift_deg_s: float = 0.0
    straight: float = 1.0
    cubic: float = 0.0
    heading: float = 0.0
    yaw_rate: float = 0.0
    rudder: float = 0.0
    log: list[tuple[float, float]] = field(default_factory=list)

    @property
    def now(self) -> float:
        return len(self.log) * STEP_S * self.scale

    def steer(self, order: float, until: Callable[[], bool] | None = None, at_most_s: float = 2000.0) -> None:
        end, log = self.now + at_most_s * self.scale, self.log
        heading, yaw_rate, rudder, done = self.heading, self.yaw_rate, self.rudder, len(self.log)
        move = self.rudder_rate_deg_s * STEP_S
        while done * STEP_S * self.scale < end and not (until and until()):
            rudder += min(max(order - rudder, -move), move)
            push = self.gain_per_s * rudder + self.drift_deg_s
            resistance = self.straight * yaw_rate + self.cubic * yaw_rate**3
            yaw_rate += STEP_S * (push - resistance) / self.time_constant_s
            heading += STEP_S * yaw_rate
            log.append((heading, rudder))
            done += 1
            if until:
                self.heading, self.yaw_rate, self.rudder = heading, yaw_rate, rudder
        self.heading, self.yaw_rate, self.rudder = heading, yaw_rate, rudder

    def wait(self, order: float, seconds: float) -> None:
        self.steer(order, at_most_s=seconds)

    def autopilot(self, course: float, seconds: float, gain: float = 1.0, damping: float = 8.0) -> None:
        end = self.now + seconds * self.scale
        while self.now < end:
            order = gain * (course - self.heading) - damping * self.yaw_rate
            self.steer(min(max(order, -20.0), 20.0), at_most_s=0.2)

    def by_hand(self, seed: int) -> None:
        """Let a helmsman hold any angle for any time, about the course 0, until 1500 s."""
        random = np.random.default_rng(seed)
        self.wait(0.0, 60.0)
        while self.now < 1500.0:
            towards = -1.0 if self.heading > 0 else 1.0
            self.wait(towards * float(random.uniform(-3.0, 12.0)), float(random.uniform(6.0, 35.0)))

    def zigzag(self, psi0: float, delta0: float, side: int, legs: int, neutral: float = 0.0) -> list[float]:
        """Run a zigzag about the present heading and return the instants of its executes, s."""
        base, executes = self.heading, []
        for _ in range(legs):
            executes.append(self.now)
            self.steer(
                side * delta0 + neutral,
                lambda base=base, side=side: side * (self.heading - base) >= psi0,  # type: ignore[misc]
            )
            side = -side
        return executes


@dataclass(frozen=True)
class Instruments:
    heading_s: float = 0.2
    rudder_s: float = 0.5
    heading_noise_deg: float = 0.05
    rudder_noise_deg: float = 0.1
    rudder_step_deg: float = 0.0
    seed: int = 1


def measure(ship: Ship, instruments: Instruments, rudder_zero_deg: float = 0.0) -> tuple[Series, Series]:
    """Sample heading and rudder, each at its own instants."""
    random = np.random.default_rng(instruments.seed)
    heading, rudder = np.array(ship.log).T
    time = np.arange(1, len(ship.log) + 1) * STEP_S * ship.scale

    def sample(values: Float, period_s: float, noise: float, step: float) -> Series:
        at = np.arange(random.uniform(0.0, period_s * ship.scale), time[-1], period_s * ship.scale)
        value = np.interp(at, time, values) + noise * random.standard_normal(at.size)
        if step:
            value = np.round(value / step) * step
        return Series(START_NS + np.round(at * 1e9).astype(np.int64), np.deg2rad(value))

    return (
        sample(heading, instruments.heading_s, instruments.heading_noise_deg, 0.0),
        sample(
            rudder + rudder_zero_deg, instruments.rudder_s, instruments.rudder_noise_deg, instruments.rudder_step_deg
        ),
    )
