"""One manoeuvre as diagnosis takes it: on a grid fine enough for the ship, every measurement with its own instant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import SECOND_NS, Float, Series
from kempf.pipeline.estimate.filters.ekf import ROWS
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.model.dynamics import N_INPUT
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.symbols import CHANNEL_SYMBOLS, LOGGED_CHANNELS

#: the grid's step in times that the ship needs for her length, and its bounds, s
_STEP_LENGTHS, _FINEST_S, _COARSEST_S = 0.06, 0.05, 1.0
_APPROACH_S = 5.0


@dataclass(frozen=True)
class ShipConstants:
    """What the terms may ask of a ship.

    Attributes
    ----------
    length_m, draught_m : float
    arm_per_m : float
        l of eq. (16).
    """

    length_m: float
    draught_m: float
    arm_per_m: float


@dataclass(frozen=True, eq=False)
class GridRun:
    """One manoeuvre.

    Attributes
    ----------
    name : str
    start_utc_ns : int
        Of the first instant.
    step_s : float
    inputs : ndarray, shape (ROWS (n - 1) + 1, N_INPUT)
        See `kempf.pipeline.estimate.filters.ekf.extended`.
    rudder_noise : ndarray, shape (n,)
    measured, offset_s : ndarray, shape (n, 3)
        Means of the readings around each instant, and how much later than it their mean time is.
    current_row : ndarray, shape (n, 2)
    heading_rad : ndarray, shape (n,)
    approach_m_s, approach_per_s : float
        Speed and shaft speed of the approach.
    channels : frozenset of str
        Canonical channels that the run has beyond those it must have.
    ship : ShipConstants
    day : int
    """

    name: str
    start_utc_ns: int
    step_s: float
    inputs: Float
    rudder_noise: Float
    measured: Float
    offset_s: Float
    current_row: Float
    heading_rad: Float
    approach_m_s: float
    approach_per_s: float
    channels: frozenset[str]
    ship: ShipConstants
    day: int

    @property
    def time_s(self) -> Float:
        """Instants, s, shape (n,)."""
        time: Float = self.step_s * np.arange(self.measured.shape[0], dtype=np.float64)
        return time

    @property
    def fine_time_s(self) -> Float:
        """Instants of the input table, s."""
        time: Float = self.step_s / ROWS * np.arange(self.inputs.shape[0], dtype=np.float64)
        return time

    @property
    def speed_m_s(self) -> Float:
        """Speed through the water at the instants, shape (n,)."""
        speed: Float = self.inputs[::ROWS, 0]
        return speed

    @property
    def rudder_rad(self) -> Float:
        """Rudder at the instants, shape (n,)."""
        rudder: Float = self.inputs[::ROWS, 1]
        return rudder


def step_of(records: list[Record], length_m: float) -> float:
    """Return the grid's step for a vessel, s: fine for her length, and no finer than what was measured.

    Parameters
    ----------
    records : list of Record
    length_m : float
    """
    speed = float(np.median([record.mean_speed_m_s for record in records]))
    wanted = float(np.clip(_STEP_LENGTHS * length_m / max(speed, 0.1), _FINEST_S, _COARSEST_S))
    fastest = min(_period(record) for record in records)
    return float(f"{max(wanted, fastest):.2g}")


def _period(record: Record) -> float:
    periods = []
    for column in record.measured.T:
        time = record.time_s[np.isfinite(column)]
        if time.size > 1:
            periods.append(float(np.median(np.diff(time))))
    return min(periods)


def make_run(
    name: str,
    record: Record,
    instruments: Instruments,
    spec: ModelSpec,
    ship: ShipConstants,
    step_s: float,
    day: int = 0,
) -> GridRun:
    """Lay a record on the grid.

    Readings of one kind around an instant are averaged, value and time; what is a moment off the grid is told to the
    filter, so that no reading is moved.

    Parameters
    ----------
    name : str
    record : Record
    instruments : Instruments
        For the channels that effects ask for.
    spec : ModelSpec
        For the frame of the current.
    ship : ShipConstants
    step_s : float
    day : int, optional

    Returns
    -------
    GridRun
    """
    n = int(np.floor(record.time_s[-1] / step_s)) + 1
    time = step_s * np.arange(n)
    measured, offset = np.full((n, 3), np.nan), np.zeros((n, 3))
    for i, column in enumerate(record.measured.T):
        measured[:, i], offset[:, i] = _averaged(record.time_s, column, step_s, n)
    fine: Float = step_s / ROWS * np.arange(ROWS * (n - 1) + 1, dtype=np.float64)
    known = np.isfinite(record.heading_rad)
    inputs = np.zeros((fine.size, N_INPUT))
    inputs[:, 0] = np.interp(fine, record.time_s, record.speed_m_s)
    inputs[:, 1] = np.interp(fine, record.time_s, record.rudder_rad)
    have = set()
    for k, channel in enumerate(CHANNEL_SYMBOLS.values()):
        column = _channel(instruments.get(channel), record.start_utc_ns, fine)
        if column is not None:
            inputs[:, 2 + k] = column
            have.add(channel)
    for channel in LOGGED_CHANNELS:
        if channel not in have and _channel(instruments.get(channel), record.start_utc_ns, fine) is not None:
            have.add(channel)
    heading: Float = 0.0 * fine
    if known.any():
        heading = np.interp(fine, record.time_s[known], record.heading_rad[known])
    inputs[:, -3], inputs[:, -2], inputs[:, -1] = heading, fine, day
    coarse = heading[::ROWS]
    shaft = 2 + list(CHANNEL_SYMBOLS).index("n")
    first = fine <= _APPROACH_S
    return GridRun(
        name=name,
        start_utc_ns=record.start_utc_ns,
        step_s=step_s,
        inputs=inputs,
        rudder_noise=np.interp(time, record.time_s, record.shake_rad_sqrt_s),
        measured=measured,
        offset_s=offset,
        current_row=_current_row(spec, coarse),
        heading_rad=coarse,
        approach_m_s=float(np.median(inputs[first, 0])),
        approach_per_s=float(np.median(inputs[first, shaft])) or 1.0,
        channels=frozenset(have),
        ship=ship,
        day=day,
    )


def _current_row(spec: ModelSpec, heading: Float) -> Float:
    if spec.current == "earth":
        return np.column_stack([-np.sin(heading), np.cos(heading)])
    return np.tile([1.0 if spec.current == "lateral" else 0.0, 0.0], (heading.size, 1))


def _averaged(time: Float, column: Float, step_s: float, n: int) -> tuple[Float, Float]:
    good = np.isfinite(column)
    cell = np.floor(time[good] / step_s + 0.5).astype(np.int64)
    inside = cell < n
    cell = cell[inside]
    counts = np.bincount(cell, minlength=n)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(cell, column[good][inside], minlength=n) / counts
        late = np.bincount(cell, time[good][inside] - step_s * cell, minlength=n) / counts
    return mean, np.nan_to_num(late)


def _channel(series: Series | None, start_ns: int, fine: Float) -> Float | None:
    """Return a channel at the fine instants, or None where the log lacks it there."""
    if series is None or len(series) < 2:
        return None
    value = series.at(start_ns + np.round(fine * SECOND_NS).astype(np.int64), gap_limit_s(series))
    good = np.isfinite(value)
    if np.count_nonzero(good) < 0.9 * value.size:
        return None
    filled: Float = np.interp(fine, fine[good], value[good])
    return filled


def spread(measured: Float) -> Float:
    """Return the standard deviation by channel, shape (3,), 1 where it was not measured.

    Parameters
    ----------
    measured : ndarray, shape (n, 3)
    """
    made = np.isfinite(measured).any(axis=0)
    found: Float = np.where(made, np.nanstd(np.where(made, measured, 0.0), axis=0), 1.0)
    return found
