"""Speed through the water against speed over ground: what they differ by is a stream, and streams are slow."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.doctor.faults import Fault, unit_faults
from kempf.pipeline.channels.doctor.log import Complex, Log, Velocity
from kempf.pipeline.channels.doctor.motion import STREAM_STD_M_S, makes_way, moves
from kempf.pipeline.channels.doctor.outcome import STILL, CheckFigure, Outcome, untestable
from kempf.pipeline.channels.doctor.robust_regression import posterior, quantile
from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.series import Float, Series

#: Ratios of the two that are no fault: a log is out by a tenth, and reads low in a turn.
_RATIOS = (0.8, 1.25)
_FEWEST = 12
#: Sectors of course that readings are averaged by, and the error that an average keeps, as a share of the speed.
_SECTORS, _SECTOR_STD = 36, 0.05
#: A log's error at rest, m/s.
_ZERO_M_S = 0.1


def examine(log: Log, *, thorough: bool = True) -> list[Outcome]:
    """Compare the log with every velocity over ground, a constant stream taken out as far as the headings determine it.

    Returns
    -------
    list of Outcome
        ``water_speed_KIND`` for each kind of velocity, see `VELOCITIES`.
    """
    water, heading = log.series.get("speed_through_water"), log.series.get("heading")
    if water is None:
        return []
    return [
        _compare(log, kind, water, velocity)
        for kind, velocity in log.velocities(track=thorough)
        if not (velocity.over_s and (heading is None or velocity.blurred(heading)))
    ]


def _compare(log: Log, kind: str, water: Series, velocity: Velocity) -> Outcome:
    speed_channels = velocity.channels[:1] if kind == "course" else velocity.channels
    name, channels = f"water_speed_{kind}", ("speed_through_water", *speed_channels)
    if not moves(velocity, log):
        return untestable(name, channels, STILL)
    if not makes_way(water, log):
        return untestable(name, channels, "the log shows no way through the water")
    way = velocity.under_way
    own = water.at(velocity.time_utc_ns, gap_limit_s(water))
    fast = quantile(np.abs(water.value), 0.98)
    good = way & np.isfinite(own) & (np.abs(np.nan_to_num(own)) > 0.4 * fast)
    if np.count_nonzero(good) < _FEWEST or not float(np.median(np.abs(own[good]))) > 0.0:
        return untestable(name, channels, "speed too low, or the two hardly overlap in time")
    own, over, direction = _by_sector(own[good], velocity.value[good])
    # U = k w + the stream along the way; on several courses the stream can be separated from k
    columns = np.column_stack([own, np.cos(direction), np.sin(direction)])
    speed = quantile(np.abs(over), 0.5)
    prior = np.array([np.inf, *[STREAM_STD_M_S] * 2])
    fitted = posterior(columns, over, np.full(over.shape, _SECTOR_STD * speed), prior)
    if fitted.value[0] == 0.0:
        return untestable(name, channels, "one of the two speeds is zero")
    slope = float(fitted.value[0])
    ratio = 1.0 / slope
    std = abs(ratio) * float(np.hypot(fitted.std[0] / slope, _ZERO_M_S / speed))
    figure = CheckFigure("speed through the water over speed over ground, current removed", ratio, std, *_RATIOS)
    words = f"speed through the water is {ratio:.2f} ± {std:.2g} (1 s.e.) times the speed over ground, current removed"
    suspects = [
        Fault("sign", ("speed_through_water",)),
        *unit_faults(("speed_through_water",), "m/s"),
        Fault("scale", ("speed_through_water",), slope, "scale", float(fitted.std[0]), simplicity=3),
    ]
    if kind != "track":
        suspects += unit_faults(speed_channels, "m/s")
    else:
        suspects += unit_faults(speed_channels, "rad")
        suspects += [Fault("swap", speed_channels)]
    return Outcome(
        name,
        channels,
        figure.state,
        words,
        (figure,),
        min(fitted.left_over + abs(float(np.log(abs(ratio)))), 1.0),
        tuple(suspects),
    )


def _by_sector(own: Float, value: Complex) -> tuple[Float, Float, Float]:
    """Return means by sector of course: the log, the speed over ground, the direction of the way."""
    sector = np.floor(np.mod(np.angle(value), 2 * np.pi) / (2 * np.pi / _SECTORS)).astype(np.int64)
    order = np.argsort(sector, kind="stable")
    starts = np.flatnonzero(np.concatenate([[True], np.diff(sector[order]) > 0]))
    count = np.diff(np.append(starts, sector.size))
    along = np.add.reduceat(value[order], starts)
    mean = [np.add.reduceat(each[order], starts) / count for each in (own, np.abs(value))]
    return mean[0], mean[1], np.angle(along)
