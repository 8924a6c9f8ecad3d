"""The instruments: each samples the truth on its own clock, adds its noise, and its message arrives a little later."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.simulate.hulls import SimulatedHull
from kempf.pipeline.simulate.random_streams import stream
from kempf.pipeline.simulate.sensors import SENSORS, Setting
from kempf.pipeline.simulate.trajectory import Trajectory
from kempf.schemas.errors import UsageError
from kempf.schemas.units import SECOND_NS

Float = NDArray[np.float64]
Nanoseconds = NDArray[np.int64]


@dataclass(frozen=True)
class Instrument:
    """An instrument and its clock.

    Parameters
    ----------
    name : str
        A key of `kempf.pipeline.simulate.sensors.SENSORS`.
    rate_hz : float
        Samples per second.
    phase_s : float
        Instant of the first sample after the start of the trial.
    jitter_s : float
        A sample lies up to this far from its tick, uniformly; less than half the period.
    latency_s, latency_jitter_s : float
        Mean and standard deviation of the time from the sample to the arrival of its message.
    noise : mapping of str to float
        Standard deviation by canonical quantity, SI; a quantity that is absent has none.
    """

    name: str
    rate_hz: float
    phase_s: float = 0.0
    jitter_s: float = 0.002
    latency_s: float = 0.010
    latency_jitter_s: float = 0.002
    noise: Mapping[str, float] = field(default_factory=dict)


def _deg(value: float) -> float:
    return value * pi / 180.0


#: What a ship on trial carries: 1 Hz GNSS with 0.05 m/s and yaw rate with 0.03 deg/s, the rest as usual.
DEFAULT_INSTRUMENTS: tuple[Instrument, ...] = (
    # a receiver samples on the UTC second itself
    Instrument("gnss", 1.0, 0.15, 0.0, noise={"velocity": 0.05, "position": 0.8}),
    Instrument("heading", 5.0, 0.04, noise={"heading": _deg(0.05)}),
    Instrument("yaw_rate", 1.0, 0.11, noise={"yaw_rate": _deg(0.03)}),
    Instrument("rudder", 2.0, 0.27, noise={"rudder_angle": _deg(0.1)}),
    Instrument("log", 1.0, 0.42, noise={"speed_through_water": 0.05}),
    Instrument("wind", 1.0, 0.63, noise={"wind_speed": 0.3, "wind_angle": _deg(2.0)}),
    Instrument("shaft", 1.0, 0.35, noise={"shaft_speed": 0.002}),
    Instrument("depth", 1.0, 0.51, noise={"water_depth": 0.05}),
    Instrument("roll", 4.0, 0.08, noise={"roll": _deg(0.05)}),
)


@dataclass(frozen=True, eq=False)
class InstrumentRecord:
    """What one instrument measured."""

    #: Which, with its settings.
    instrument: Instrument
    #: Shape (n,). Instants of measurement, strictly increasing.
    measured_utc_ns: Nanoseconds
    #: Shape (n,). Instants at which the messages reached the logger, not decreasing.
    arrival_utc_ns: Nanoseconds
    #: Shape (n,). By canonical column (`kempf.schemas.channels`), SI; angles on the circle within [0, 2 pi).
    values: dict[str, Float]


def measure(
    instrument: Instrument,
    trajectory: Trajectory,
    hull: SimulatedHull,
    setting: Setting,
    *,
    start_utc_ns: int,
    seed: int,
    noise_scale: float,
) -> InstrumentRecord:
    """Return what an instrument makes of a true path.

    Parameters
    ----------
    instrument : Instrument
        The instrument.
    trajectory : Trajectory
        The truth.
    hull : SimulatedHull
        The ship.
    setting : Setting
        Origin, antenna and what else a sensor needs to know.
    start_utc_ns : int
        UTC of the trajectory's first row.
    seed : int
        Of the clock and the noise.
    noise_scale : float
        Factor on every standard deviation of the noise; clocks are not touched.

    Raises
    ------
    UsageError
        The instrument or a quantity of its noise is unknown, or its clock is impossible.
    """
    _check(instrument)
    clock = stream(seed, f"clock {instrument.name}")
    period = 1.0 / instrument.rate_hz
    n = int(np.floor((trajectory.duration_s - instrument.phase_s - instrument.jitter_s) * instrument.rate_hz)) + 1
    ticks = instrument.phase_s + np.arange(max(n, 0)) * period
    ticks = np.maximum(ticks + instrument.jitter_s * clock.uniform(-1.0, 1.0, ticks.size), 0.0)
    since_start = np.rint(ticks * SECOND_NS).astype(np.int64)
    delay = instrument.latency_s + instrument.latency_jitter_s * clock.standard_normal(ticks.size)
    delay_ns = np.rint(np.maximum(delay, 0.0) * SECOND_NS).astype(np.int64)
    # what is measured is the truth at the very instant of the stamp, nanoseconds included
    sample = trajectory.at(since_start / SECOND_NS)
    noise = {name: std * noise_scale for name, std in instrument.noise.items()}
    values = SENSORS[instrument.name].read(sample, hull, setting, noise, stream(seed, f"noise {instrument.name}"))
    measured = since_start + start_utc_ns
    return InstrumentRecord(instrument, measured, np.maximum.accumulate(measured + delay_ns), values)


def _check(instrument: Instrument) -> None:
    if instrument.name not in SENSORS:
        raise UsageError(
            "instrument_unknown",
            f"There is no instrument {instrument.name!r}.",
            f"Take one of {', '.join(sorted(SENSORS))}.",
        )
    unknown = sorted(set(instrument.noise) - set(SENSORS[instrument.name].noises))
    if unknown:
        raise UsageError(
            "instrument_noise_unknown",
            f"The instrument {instrument.name!r} has no noise of {', '.join(unknown)}.",
            f"Name {', '.join(SENSORS[instrument.name].noises)}.",
        )
    if not (instrument.rate_hz > 0 and instrument.phase_s >= 0 and 0 <= instrument.jitter_s < 0.5 / instrument.rate_hz):
        raise UsageError(
            "instrument_clock",
            f"The instrument {instrument.name!r} samples at {instrument.rate_hz} Hz from {instrument.phase_s} s on, "
            f"jitter {instrument.jitter_s} s; expected a positive rate, a phase from 0 on, jitter below half a period.",
            "Correct rate_hz, phase_s or jitter_s.",
        )
