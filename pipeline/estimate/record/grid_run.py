"""One manoeuvre as every fit takes it: on a grid fine enough for the ship, each mean of readings at its own instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.instant_errors import IN_THE_LOG, InstantErrors
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.lateral_speed import noise_std
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.channels.standing import without_noise
from kempf.pipeline.estimate.filters.ekf import ROWS
from kempf.pipeline.estimate.record.average import cell_means, instants_of, readings_averaged, step_of
from kempf.pipeline.estimate.record.conditions import conditions
from kempf.pipeline.estimate.record.record import Instants, Record
from kempf.pipeline.estimate.record.rudder_inflow import approach_speed
from kempf.pipeline.estimate.record.speed_error import SpeedError
from kempf.pipeline.estimate.record.speed_readings import SpeedReadings
from kempf.pipeline.model.dynamics import N_INPUT, SPEED_ERROR_GAIN
from kempf.pipeline.model.rudder_line import RudderLine
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.symbols import CHANNEL_SYMBOLS
from kempf.schemas.units import SECOND_NS

_APPROACH_S = 5.0
#: column of the shaft speed in `GridRun.inputs`
SHAFT_COLUMN = 2 + list(CHANNEL_SYMBOLS).index("n")
#: quantile of speed over shaft speed that is that of a settled ship: her straight courses are few in zigzags
_SETTLED = 0.95


@dataclass(frozen=True)
class ShipConstants:
    """What the terms may ask of a ship."""

    length_m: float
    draught_m: float
    #: l of eq. (16).
    arm_per_m: float


@dataclass(frozen=True, eq=False)
class GridRun:
    """One manoeuvre."""

    name: str
    #: Of the first instant.
    start_utc_ns: int
    step_s: float
    #: Shape (ROWS (n - 1) + 1, N_INPUT). See `kempf.pipeline.estimate.filters.ekf.extended`.
    inputs: Float
    #: The rudder with its corners, laid on the instants of the input table. It begins before them, as far back as the
    #: log goes and no longer than the run: where a play in the gear stands, what came before decides.
    rudder_line: RudderLine
    #: Shape (n,).
    rudder_noise: Float
    #: speed_error_std_m_s, speed_error_rate_per_s: Of the error of the speed, a first-order process; 0 where there is
    #: none.
    speed_error_std_m_s: float
    speed_error_rate_per_s: float
    #: measured, offset_s: Shape (n, 3). Means of the readings around each instant, and how much later than it their
    #: mean time is.
    measured: Float
    offset_s: Float
    #: Shape (3,). Noise level of each measurement to start from, in its unit.
    noise_start: Float
    #: Shape (n, 2).
    current_row: Float
    #: Shape (n,).
    heading_rad: Float
    #: approach_m_s, approach_per_s: Speed of the approach, and the shaft speed that keeps it, see `with_common_slip`.
    approach_m_s: float
    approach_per_s: float
    #: Canonical channels that the run has beyond those it must have.
    channels: frozenset[str]
    ship: ShipConstants
    #: Number of the log among the vessel's.
    day: int
    #: Averaged around the instants.
    speed_readings: SpeedReadings
    #: See `kempf.pipeline.estimate.record.record.Record`.
    instant_errors: InstantErrors = IN_THE_LOG
    #: rudder_period_s, heading_period_s: Median time between readings, s: what she does in between is a guess.
    rudder_period_s: float = 0.0
    heading_period_s: float = 0.0
    #: Shape (n,). Of the means of the lateral speed, see `kempf.pipeline.estimate.record.record.Record`.
    lateral_by_late: Float | None = None
    #: See `kempf.pipeline.estimate.record.loads`.
    load: float = 0.0

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
    def speed_error(self) -> SpeedError:
        """The error of the speed at the instants of the input table."""
        rate = self.speed_error_rate_per_s
        return SpeedError(self.inputs[:, SPEED_ERROR_GAIN], self.speed_error_std_m_s, 1.0 / rate if rate > 0.0 else 0.0)

    @property
    def shake(self) -> Float:
        """Intensity of the errors of rudder and speed together, as if the rudder made them, rad s^0.5, shape (n,)."""
        result: Float = np.hypot(self.rudder_noise, self.speed_error.intensity_rad_sqrt_s[::ROWS])
        return result

    @property
    def rudder_rad(self) -> Float:
        """Rudder at the instants, shape (n,)."""
        rudder: Float = self.inputs[::ROWS, 1]
        return rudder

    @property
    def shaft_per_s(self) -> float | None:
        """Mean shaft speed, 1/s; None where it is not logged or the shaft does not turn ahead."""
        if "shaft_speed" not in self.channels or not self.approach_per_s > 0.0:
            return None
        shaft = float(np.mean(self.inputs[::ROWS, SHAFT_COLUMN]))
        return shaft if shaft > 0.0 else None

    @property
    def settled_m_s(self) -> float:
        """Speed that the shaft keeps on a straight course, m/s; that of the approach where the shaft is unknown."""
        shaft = self.shaft_per_s
        return self.approach_m_s if shaft is None else self.approach_m_s * shaft / self.approach_per_s

    def constants(self, rudder_speed_exponent: float) -> Float:
        """Return what the terms may ask of ship and approach, see `kempf.pipeline.estimate.filters.ekf.extended`.

        Parameters
        ----------
        rudder_speed_exponent : float
            See `kempf.schemas.model_spec.ModelSpec`.

        Returns
        -------
        ndarray, shape (7,)
            V0 is the speed that the shaft keeps: at the first execute she may not have come to it.
        """
        ship = self.ship
        return np.array(
            [
                *(ship.arm_per_m, ship.length_m, ship.draught_m, self.settled_m_s),
                *(self.shaft_per_s or self.approach_per_s, rudder_speed_exponent, self.approach_m_s),
            ]
        )

    def instants(self) -> Instants:
        """Return the run as the linear filter takes it, every mean at the mean instant of its readings."""
        own, fine = self._own_instants(), self.fine_time_s
        made = np.isfinite(self.measured)
        time = np.unique(np.concatenate([fine, own[made]]))
        measured = np.full((time.size, made.shape[1]), np.nan)
        for i in range(made.shape[1]):
            measured[np.searchsorted(time, own[made[:, i], i]), i] = self.measured[made[:, i], i]

        def laid(known: Float, column: Float) -> Float:
            course: Float = np.interp(time, known, column)
            return course

        # straight lines from quarter to quarter of a step, with the same integral as Simpson's rule
        rudder, error = self.rudder_line.as_read.copy(), self.speed_error
        rudder[1::2] = (8.0 * rudder[1::2] - rudder[:-1:2] - rudder[2::2]) / 6.0
        return Instants(
            time_s=time,
            speed_m_s=laid(fine, self.inputs[:, 0]),
            rudder_rad=laid(fine, rudder),
            rudder_noise_rad_sqrt_s=laid(self.time_s, self.rudder_noise),
            speed_error=replace(error, gain_rad_s_m=laid(fine, error.gain_rad_s_m)),
            measured=measured,
            heading_rad=laid(self.time_s, self.heading_rad),
            noise_start=self.noise_start,
        )

    def without(self, instants: Instants) -> GridRun:
        """Return the run without the measurements that are gone from its instants.

        Parameters
        ----------
        instants : Instants
            Those of `instants`, some measurements NaN.
        """
        own, measured = self._own_instants(), self.measured.copy()
        for i in range(measured.shape[1]):
            rows = np.flatnonzero(np.isfinite(measured[:, i]))
            kept = np.isfinite(instants.measured[np.searchsorted(instants.time_s, own[rows, i]), i])
            measured[rows[~kept], i] = np.nan
        return replace(self, measured=measured)

    def _own_instants(self) -> Float:
        """Return the mean instant of the readings of every cell, within the run, shape (n, 3)."""
        own: Float = np.clip(self.time_s[:, None] + self.offset_s, 0.0, self.fine_time_s[-1])
        return own


def plain_run(name: str, record: Record, spec: ModelSpec, arm_per_m: float, length_m: float | None) -> GridRun:
    """Lay a record on a grid of its own, without the channels that effects ask for.

    Parameters
    ----------
    arm_per_m : float
        l of eq. (16).
    length_m : float or None
        Of the ship, for the grid's step.
    """
    ship = ShipConstants(length_m or 100.0, 1.0, arm_per_m)
    return make_run(name, record, Instruments({}, {}, ()), spec, ship, step_of([record], length_m))


def averaged(record: Record, spec: ModelSpec, arm_per_m: float, length_m: float | None) -> Record:
    """Return a record with its readings averaged as those of a run are.

    Parameters
    ----------
    arm_per_m : float
        l of eq. (16).
    length_m : float or None
        Of the ship, for the grid's step.
    """
    means = plain_run("", record, spec, arm_per_m, length_m).instants()
    return replace(record, **vars(means), lateral_by_late=None)


def make_run(
    name: str,
    record: Record,
    instruments: Instruments,
    spec: ModelSpec,
    ship: ShipConstants,
    step_s: float,
    day: int = 0,
    load: float | None = None,
) -> GridRun:
    """Lay a record on the grid.

    Readings of one kind around an instant are averaged, value and time; how far a mean is off the grid goes to the
    filter, so that no reading is moved.

    Parameters
    ----------
    instruments : Instruments
        For the channels that effects ask for.
    spec : ModelSpec
        For the frame of the current.
    day : int, optional
        Number of the log among the vessel's.
    load : float, optional
        See `pipeline.estimate.record.loads`; the number of the log by default.
    """
    n = instants_of(record, step_s)
    time = step_s * np.arange(n)
    measured, offset = np.full((n, 3), np.nan), np.zeros((n, 3))
    for i, column in enumerate(record.measured.T):
        measured[:, i], offset[:, i] = cell_means(record.time_s, column, step_s, n)
    by_late = record.lateral_by_late
    fine: Float = step_s / ROWS * np.arange(ROWS * (n - 1) + 1, dtype=np.float64)
    known = np.isfinite(record.heading_rad)
    inputs = np.zeros((fine.size, N_INPUT))
    inputs[:, 0] = np.interp(fine, record.time_s, record.speed_m_s)
    line = _line(instruments.get("rudder_angle"), record, fine)
    inputs[:, 1] = line.angle_rad[line.grid]
    columns, have = conditions(instruments, record, fine)
    for k, symbol in enumerate(CHANNEL_SYMBOLS):
        inputs[:, 2 + k] = columns.get(symbol, 0.0)
    heading: Float = 0.0 * fine
    if known.any():
        heading = np.interp(fine, record.time_s[known], record.heading_rad[known])
    first_of_run = 2 + len(CHANNEL_SYMBOLS)
    load = float(day) if load is None else load
    inputs[:, first_of_run], inputs[:, first_of_run + 1], inputs[:, first_of_run + 2] = heading, fine, load
    inputs[:, SPEED_ERROR_GAIN] = np.interp(fine, record.time_s, record.speed_error.gain_rad_s_m)
    coarse = heading[::ROWS]
    first = fine <= _APPROACH_S
    # what is over within a step is white noise to it
    brief = record.speed_error.time_s < step_s
    return GridRun(
        name=name,
        start_utc_ns=record.start_utc_ns,
        step_s=step_s,
        inputs=inputs,
        rudder_line=line,
        rudder_noise=np.interp(
            time, record.time_s, record.shake_rad_sqrt_s if brief else record.rudder_noise_rad_sqrt_s
        ),
        speed_error_std_m_s=0.0 if brief else record.speed_error.std_m_s,
        speed_error_rate_per_s=0.0 if brief else record.speed_error.rate_per_s,
        measured=measured,
        offset_s=offset,
        noise_start=record.noise_start,
        current_row=current_row(spec, coarse),
        heading_rad=coarse,
        approach_m_s=approach_speed(fine, inputs[:, 0]),
        approach_per_s=float(np.median(inputs[first, SHAFT_COLUMN])) or 1.0,
        channels=have,
        ship=ship,
        day=day,
        speed_readings=readings_averaged(record.speed_readings, step_s, n),
        load=load,
        instant_errors=record.instant_errors,
        rudder_period_s=record.rudder_period_s,
        heading_period_s=record.heading_period_s,
        lateral_by_late=None if by_late is None else cell_means(record.time_s, by_late, step_s, n)[0],
    )


def _line(rudder: Series | None, record: Record, fine: Float) -> RudderLine:
    """Return `GridRun.rudder_line`: before a record as the rudder was read, of which there may be nothing."""
    if rudder is None:
        return RudderLine.through(record.time_s, record.rudder_rad, fine)
    start_ns, back = record.start_utc_ns, np.round(fine[:0:-1] * SECOND_NS).astype(np.int64)
    earlier = rudder.between(start_ns - int(back[0]), start_ns + round(gap_limit_s(rudder) * SECOND_NS))
    course = without_noise(earlier, noise_std(earlier)).at(start_ns - back, gap_limit_s(rudder))
    unknown = np.flatnonzero(np.isnan(course))
    known = slice(int(unknown[-1]) + 1 if unknown.size else 0, None)
    time = np.concatenate([-fine[:0:-1][known], record.time_s])
    return RudderLine.through(time, np.concatenate([course[known], record.rudder_rad]), fine)


def current_row(spec: ModelSpec, heading: Float) -> Float:
    """Return what a unit of the current's two parts is of the lateral speed, shape (n, 2).

    Parameters
    ----------
    heading : ndarray, shape (n,)
        True, rad.
    """
    if spec.current == "earth":
        return np.column_stack([-np.sin(heading), np.cos(heading)])
    return np.tile([1.0 if spec.current == "lateral" else 0.0, 0.0], (heading.size, 1))


def with_common_slip(runs: Sequence[GridRun], kept_m: float | None = None) -> tuple[GridRun, ...]:
    """Return the runs of a vessel with the shaft speed that keeps the speed of each approach.

    The race of a propeller goes with the shaft speed, not with the speed that the ship happens to have at the first
    execute: after a turn, or gathering way, she is slower than her shaft would have her. So the speed that a shaft
    speed keeps is the vessel's, one for all runs: what she comes to in those that have settled.

    Parameters
    ----------
    runs : sequence of GridRun
        With a logged shaft speed or without, which then stay as they are.
    kept_m : float, optional
        `common_slip` of other runs of hers, which these are to share.
    """
    kept = common_slip(runs) if kept_m is None else kept_m
    if kept is None:
        return tuple(runs)
    return tuple(
        replace(run, approach_per_s=run.approach_m_s / kept) if "shaft_speed" in run.channels else run for run in runs
    )


def common_slip(runs: Sequence[GridRun]) -> float | None:
    """Return the speed that a shaft speed of one revolution a second keeps, m; None where no run has both."""
    turning = [(run.speed_m_s, run.inputs[::ROWS, SHAFT_COLUMN]) for run in runs if "shaft_speed" in run.channels]
    ratios = [speed[n > 0.0] / n[n > 0.0] for speed, n in turning if np.any(n > 0.0)]
    kept = float(np.quantile(np.concatenate(ratios), _SETTLED)) if ratios else 0.0
    return kept if kept > 0.0 else None


def spread(measured: Float) -> Float:
    """Return the standard deviation by channel, shape (3,), 1 where it was not measured.

    Parameters
    ----------
    measured : ndarray, shape (n, 3)
    """
    made = np.isfinite(measured).any(axis=0)
    std: Float = np.where(made, np.nanstd(np.where(made, measured, 0.0), axis=0), 1.0)
    return std
