"""Stretches in which a log holds nothing, or nothing of some channels: a logger restarted, a receiver without a fix."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from kempf.pipeline.channels.series import Nanoseconds, Series
from kempf.schemas.enumeration import listed
from kempf.schemas.instants import written
from kempf.schemas.units import SECOND_NS

#: Shortest gap that is named, s, and in periods of the channel.
_LEAST_S, _PERIODS = 10.0, 10.0


def named_gaps(series: Mapping[str, Series]) -> list[str]:
    """Return a sentence for the gaps that all channels of a log share, and one for those of some alone.

    Parameters
    ----------
    series : mapping of str to Series
        Channels by name.

    Examples
    --------
    >>> time = np.r_[0:60, 120:180] * SECOND_NS
    >>> named_gaps({"heading": Series(time, np.zeros(120))})
    ['nothing is recorded for 61 s from 1970-01-01 00:00:59 UTC on']
    """
    sampled = {name: one for name, one in series.items() if len(one) > 1}
    if not sampled:
        return []
    # channels of one instrument share their instants
    instants = {id(one.time_utc_ns): one.time_utc_ns for one in sampled.values()}
    together = np.sort(np.concatenate(list(instants.values())), kind="stable")
    silent = _gaps(together, min(one.period_s for one in sampled.values()))
    alone: dict[bytes, list[str]] = {}
    for name, one in sampled.items():
        own = _gaps(one.time_utc_ns, one.period_s)
        own = own[[_longer(gap, silent, one.period_s) for gap in own]]
        if own.size:
            alone.setdefault(own.tobytes(), []).append(name)
    said = [f"nothing is recorded {_where(silent)}"] if silent.size else []
    return said + [
        f"{listed(names)}: not recorded {_where(np.frombuffer(own, dtype=np.int64).reshape(-1, 2))}"
        for own, names in alone.items()
    ]


def _limit_ns(period_s: float) -> float:
    return max(_LEAST_S, _PERIODS * period_s) * SECOND_NS


def _gaps(time_utc_ns: Nanoseconds, period_s: float) -> Nanoseconds:
    """Return first and last instant of every gap, UTC ns, shape (n, 2)."""
    (before,) = np.nonzero(np.diff(time_utc_ns) > _limit_ns(period_s))
    return np.stack([time_utc_ns[before], time_utc_ns[before + 1]], axis=1)


def _longer(gap: Nanoseconds, silent: Nanoseconds, period_s: float) -> bool:
    """Whether a gap goes on for long where others have readings."""
    shared = np.minimum(silent[:, 1], gap[1]) - np.maximum(silent[:, 0], gap[0])
    return bool(gap[1] - gap[0] - np.sum(np.maximum(shared, 0)) > _limit_ns(period_s))


def _where(gaps: Nanoseconds) -> str:
    lasting = (gaps[:, 1] - gaps[:, 0]) / SECOND_NS
    longest = int(np.argmax(lasting))
    since = written(gaps[longest, 0])
    if len(gaps) == 1:
        return f"for {lasting[0]:.0f} s from {since} on"
    return (
        f"in {len(gaps)} gaps of {lasting.sum():.0f} s together, the longest of {lasting[longest]:.0f} s "
        f"from {since} on"
    )
