"""The speed that one log showed, and what cost it: drift, turn, rudder and wind, over the one that the shaft keeps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.means import mean_of_line
from kempf.pipeline.channels.recursion import filtered
from kempf.pipeline.channels.running_mean import running_mean
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.manoeuvre.surge.usual import KINDS, SETTLED_STD, UNSETTLED, UNSETTLED_STD
from kempf.schemas.symbols import CHANNEL_SYMBOLS


def _head_wind(run: GridRun) -> Float:
    """Return W at the instants, m^2/s^2; NaN where no wind is logged."""
    if not {"wind_speed", "wind_angle"} <= set(run.channels):
        return np.full(run.speed_m_s.size, np.nan)
    over_deck = _channel(run, "wind_speed")
    wind: Float = over_deck**2 * np.cos(_channel(run, "wind_angle")) - run.speed_m_s**2
    return wind


def _channel(run: GridRun, name: str) -> Float:
    column = 2 + list(CHANNEL_SYMBOLS.values()).index(name)
    values: Float = run.inputs[:: (run.inputs.shape[0] - 1) // (run.speed_m_s.size - 1), column]
    return values


#: with fewer readings a log shows no speed in turns
_FEWEST = 8


@dataclass(frozen=True, eq=False)
class LoggedSpeed:
    """One run: readings of the speed, what the shaft does, and what costs speed, all over the speed the shaft keeps."""

    #: Of the run's instants, lengths at the speed that the shaft keeps.
    step: float
    #: Shape (m,). As it was read: smoothed, its errors would go by what it was smoothed with.
    speed: Float
    #: Shape (m,). When each was read, in steps from the first instant.
    at: Float
    #: How many steps each is a mean over, about that; 0 where it is of an instant.
    over: float
    #: Shape (n,). At the run's instants.
    shaft: Float
    #: Shape (n, 4). By kind of loss; NaN where it is not known.
    costs: Float
    settled_m_s: float
    #: Prior standard deviation of V_0 / V_s.
    settled_std: float

    @classmethod
    def of(cls, run: GridRun, length_m: float, exponent: float) -> LoggedSpeed | None:
        """Return what a run's log showed; None where it has no yaw rate, or stands still, or is too short."""
        speed, settled = run.speed_m_s, run.settled_m_s
        rate = _yaw_rate(run, length_m)
        if rate is None or not settled > 0.0 or not np.all(np.isfinite(speed)) or speed.size < 20:
            return None
        at, over = run.speed_readings.time_s / run.step_s, run.speed_readings.mean_s / run.step_s
        inside = (at >= 0.5 * over) & (at <= speed.size - 1 - 0.5 * over)
        if np.count_nonzero(inside) < _FEWEST:
            return None
        shaft = np.ones(speed.size)
        if run.shaft_per_s is not None:
            shaft = _channel(run, "shaft_speed") / run.shaft_per_s
        lateral, unit = _lateral(run, length_m), length_m / settled
        drift = np.full(speed.size, np.nan) if lateral is None else -lateral * rate * unit / settled
        rudder = run.rudder_rad**2 * np.maximum(speed / settled, 0.0) ** exponent
        costs = np.column_stack([drift, (unit * rate) ** 2, rudder, _head_wind(run) / settled**2])
        gathers_way = abs(speed[0] / settled - 1.0) > UNSETTLED
        std = UNSETTLED_STD if gathers_way else SETTLED_STD
        read = run.speed_readings.speed_m_s[inside] / settled
        return cls(run.step_s * settled / length_m, read, at[inside], over, shaft, costs, settled, std)

    def columns(self, tau: float, reference_m_s: float | None = None) -> tuple[Float, Float]:
        """Return the columns of V_0, of the first speed and of the losses, through the lag of tau, at the readings.

        It is in lengths at the speed of this log, or of ``reference_m_s``.
        """
        step = self.step if reference_m_s is None else self.step * reference_m_s / self.settled_m_s
        decay = np.exp(-step / tau)

        def lagged(course: Float) -> Float:
            mean = 0.5 * (course[1:] + course[:-1])
            response: Float = np.concatenate([[0.0], filtered([1.0 - decay], [1.0, -decay], mean)])
            return response

        own = np.column_stack([lagged(self.shaft), decay ** np.arange(self.shaft.size)])
        lost = np.column_stack([-lagged(self.costs[:, j]) for j in KINDS])
        return self._read(own), self._read(lost)

    def _read(self, course: Float) -> Float:
        """Return what readings show of courses at the run's instants, shape (m, k) of (n, k)."""
        steps = np.arange(len(course), dtype=np.float64)
        return np.column_stack([mean_of_line(steps, column, self.at, self.over) for column in course.T])


def _yaw_rate(run: GridRun, length_m: float) -> Float | None:
    """Return the yaw rate at the instants, rad/s, without the noise that its square would be larger by."""
    rate, heading = run.measured[:, 1], run.measured[:, 2]
    known = np.isfinite(rate)
    time = run.time_s
    if known.mean() < 0.3:
        there = np.isfinite(heading)
        if there.mean() < 0.3:
            return None
        rate = np.gradient(np.interp(time, time[there], heading[there]), run.step_s)
        known = np.isfinite(rate)
    laid = np.interp(time, time[known], rate[known])
    return _smooth(run, laid, length_m)


def _lateral(run: GridRun, length_m: float) -> Float | None:
    """Return the lateral speed at the instants, m/s, counted from that of the approach; None where not measured."""
    known = np.isfinite(run.measured[:, 0])
    if known.mean() < 0.3:
        return None
    smooth = _smooth(run, np.interp(run.time_s, run.time_s[known], run.measured[known, 0]), length_m)
    # what a stream or a wind gives her before she turns costs nothing
    first = max(1, round(0.5 * length_m / max(run.approach_m_s, 0.05) / run.step_s))
    return smooth - float(np.median(smooth[:first]))


def _smooth(run: GridRun, laid: Float, length_m: float) -> Float:
    """Return a course without its noise: a ship's motion does not change within a quarter of her length."""
    width = max(1, round(0.25 * length_m / max(run.approach_m_s, 0.05) / run.step_s))
    return running_mean(laid, width)
