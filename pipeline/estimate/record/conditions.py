"""Wind, revolutions, depth and roll of a manoeuvre as its effects take them: without the noise of their instruments."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.channels.signal import signal
from kempf.pipeline.estimate.record.heel import rolling
from kempf.pipeline.estimate.record.record import Record
from kempf.schemas.symbols import CHANNEL_SYMBOLS, LOGGED_CHANNELS
from kempf.schemas.units import SECOND_NS

#: part of the manoeuvre that a channel must cover
_COVERED = 0.9


def conditions(instruments: Instruments, record: Record, fine_s: Float) -> tuple[dict[str, Float], frozenset[str]]:
    """Return the channels that effects may ask for.

    Parameters
    ----------
    instruments : Instruments
        Of the log.
    record : Record
        Of the manoeuvre.
    fine_s : ndarray, shape (n,)
        Instants, s after the record's start.

    Returns
    -------
    columns : dict of str to ndarray, shape (n,)
        By symbol, see `kempf.schemas.symbols.CHANNEL_SYMBOLS`, SI.
    channels : frozenset of str
        Those that the log has throughout, beyond those that every run has.
    """
    at_ns = record.start_utc_ns + np.round(fine_s * SECOND_NS).astype(np.int64)
    read = {name: s for name in LOGGED_CHANNELS if (s := instruments.get(name)) is not None and len(s) > 1}
    columns: dict[str, Float | None] = {}
    if "wind_speed" in read and "wind_angle" in read:
        columns |= _wind(read["wind_speed"], read["wind_angle"], record, at_ns)
    for symbol, name in CHANNEL_SYMBOLS.items():
        if name in read and symbol not in columns:
            without = partial(rolling, record=record) if name == "roll" else _wandering
            columns[symbol] = _laid(_within(read[name], at_ns, without), at_ns, gap_limit_s(read[name]))
    known = {symbol: column for symbol, column in columns.items() if column is not None}
    others = {
        name
        for name, s in read.items()
        if name not in CHANNEL_SYMBOLS.values() and _laid(s, at_ns, gap_limit_s(s)) is not None
    }
    return known, frozenset({CHANNEL_SYMBOLS[symbol] for symbol in known} | others)


def _wind(speed: Series, angle: Series, record: Record, at_ns: NDArray[np.int64]) -> dict[str, Float | None]:
    """Return the relative wind, from what the air does over the earth.

    A ship that turns and an anemometer that is read every second part the relative wind from its readings between
    them; gusts and noise are distinguished where the ship's own motion is taken out.
    """
    known = np.isfinite(record.heading_rad)
    origin, own = record.start_utc_ns, record.time_s

    def motion(instants: NDArray[np.int64]) -> tuple[Float, Float]:
        time_s = (instants - origin) / SECOND_NS
        return np.interp(time_s, own[known], record.heading_rad[known]), np.interp(time_s, own, record.speed_m_s)

    near = _near(speed, at_ns)
    direction = angle.at(near.time_utc_ns, gap_limit_s(angle))
    both = np.isfinite(direction)
    time_ns, speeds = near.time_utc_ns[both], near.value[both]
    if time_ns.size < 2 or not known.any():
        return {}
    heading, ahead = motion(time_ns)
    from_ = heading + direction[both]
    # along the mean wind and across it: gusts and the noises of speed and angle lie that way
    along = float(np.arctan2(np.mean(speeds * np.sin(from_)), np.mean(speeds * np.cos(from_))))
    from_, heading = from_ - along, heading - along
    # the air past the ship, turned round, less what her own way makes of it
    parts = (speeds * np.cos(from_) - ahead * np.cos(heading), speeds * np.sin(from_) - ahead * np.sin(heading))
    signals = [signal(Series(time_ns, part)).series for part in parts]
    x, y = (_laid(component, at_ns, gap_limit_s(component)) for component in signals)
    if x is None or y is None:
        return {"U": None, "gamma": None}
    heading, ahead = motion(at_ns)
    heading = heading - along
    x, y = x + ahead * np.cos(heading), y + ahead * np.sin(heading)
    gamma = np.unwrap(np.arctan2(y, x) - heading)
    turns = 2.0 * np.pi * np.round(gamma[0] / (2.0 * np.pi))
    return {"U": np.hypot(x, y), "gamma": gamma - turns}


def _near(series: Series, at_ns: NDArray[np.int64]) -> Series:
    """Return the readings of a manoeuvre and those beside it: its log may be a voyage's."""
    beyond = round(gap_limit_s(series) * SECOND_NS)
    return series.between(int(at_ns[0]) - beyond, int(at_ns[-1]) + beyond)


def _wandering(series: Series) -> Series:
    return signal(series).series


def _within(series: Series, at_ns: NDArray[np.int64], without_noise: Callable[[Series], Series]) -> Series:
    """Return the series with its noise taken out within the manoeuvre, and the readings beside it as they are."""
    near = _near(series, at_ns)
    inside = (near.time_utc_ns >= at_ns[0]) & (near.time_utc_ns <= at_ns[-1])
    value = near.value.copy()
    value[inside] = without_noise(Series(near.time_utc_ns[inside], near.value[inside])).value
    return Series(near.time_utc_ns, value)


def _laid(series: Series, at_ns: NDArray[np.int64], max_gap_s: float) -> Float | None:
    """Return a channel at the instants, or None where the log lacks it there."""
    value = series.at(at_ns, max_gap_s)
    good = np.isfinite(value)
    if np.count_nonzero(good) < _COVERED * value.size:
        return None
    filled: Float = np.interp(at_ns, at_ns[good], value[good])
    return filled
