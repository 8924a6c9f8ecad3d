"""One channel over time: the values of one instrument at the instants they were measured."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from kempf.schemas.units import SECOND_NS

Float = NDArray[np.float64]
Nanoseconds = NDArray[np.int64]
Mask = NDArray[np.bool_]


def wrapped(angle: Float | float) -> Float:
    """Return angles, rad, brought into [-pi, pi) by whole turns; of the shape given.

    Examples
    --------
    >>> wrapped(np.array([0.0, 1.5, -1.5]) * np.pi).tolist() == (np.array([0.0, -0.5, 0.5]) * np.pi).tolist()
    True
    """
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Series:
    """Values of one channel at their instants of measurement."""

    #: Shape (n,). Strictly increasing UTC nanoseconds.
    time_utc_ns: Nanoseconds
    #: Shape (n,). Finite values in SI; angles on the circle are unwrapped, so differences and means may be taken.
    value: Float

    def __post_init__(self) -> None:
        if self.time_utc_ns.shape != self.value.shape or self.value.ndim != 1:
            raise ValueError(f"time has shape {self.time_utc_ns.shape}, value {self.value.shape}: expected (n,) twice")
        if self.time_utc_ns.size > 1 and not bool(np.all(self.time_utc_ns[1:] > self.time_utc_ns[:-1])):
            raise ValueError("the instants of a series must increase strictly")

    def __len__(self) -> int:
        return int(self.value.size)

    @cached_property
    def period_s(self) -> float:
        """Median time between values, s; NaN for fewer than two values."""
        if len(self) < 2:
            return float("nan")
        return float(np.median(np.diff(self.time_utc_ns), overwrite_input=True)) / SECOND_NS

    def between(self, start_ns: int, end_ns: int) -> Series:
        """Return the values with ``start_ns <= time <= end_ns``."""
        first, last = np.searchsorted(self.time_utc_ns, [start_ns, end_ns + 1])
        return Series(self.time_utc_ns[first:last], self.value[first:last])

    def earlier(self, by_ns: int) -> Series:
        """Return the values so much earlier; the very same by nothing."""
        return Series(self.time_utc_ns - by_ns, self.value) if by_ns else self

    def with_points(self, time_utc_ns: Nanoseconds, value: Float) -> Series:
        """Return the series with more values, but for those at instants that it has.

        Parameters
        ----------
        time_utc_ns, value : ndarray, shape (m,)
            Increasing instants, UTC ns, and what is there.
        """
        new = ~np.isin(time_utc_ns, self.time_utc_ns)
        time = np.concatenate([self.time_utc_ns, time_utc_ns[new]])
        order = np.argsort(time, kind="stable")
        return Series(time[order], np.concatenate([self.value, value[new]])[order])

    def seconds_since(self, origin_ns: int) -> Float:
        """Return the instants as seconds after ``origin_ns``, shape (n,)."""
        return _seconds(self.time_utc_ns, origin_ns)

    def at(self, time_utc_ns: Nanoseconds, max_gap_s: float) -> Float:
        """Interpolate linearly; NaN outside the series and across gaps.

        Parameters
        ----------
        time_utc_ns : ndarray, shape (m,)
            Instants asked for.
        max_gap_s : float
            Where two neighbours lie farther apart than this, nothing is invented between them.

        Returns
        -------
        ndarray, shape (m,)
        """
        if len(self) == 0 or time_utc_ns.size == 0:
            return np.full(time_utc_ns.shape, np.nan)
        # what lies about the question: a manoeuvre asks a voyage for a minute at a time
        first = max(int(np.searchsorted(self.time_utc_ns, time_utc_ns.min(), side="left")) - 1, 0)
        near = slice(first, int(np.searchsorted(self.time_utc_ns, time_utc_ns.max(), side="right")) + 1)
        origin, instant = int(self.time_utc_ns[0]), self.time_utc_ns[near]
        own, asked = _seconds(instant, origin), _seconds(time_utc_ns, origin)
        result = np.interp(asked, own, self.value[near], left=np.nan, right=np.nan)
        if own.size > 1:
            after = np.clip(np.searchsorted(instant, time_utc_ns, side="left"), 1, own.size - 1)
            in_gap = (own[after] - own[after - 1] > max_gap_s) & (asked > own[after - 1]) & (asked < own[after])
            result[in_gap] = np.nan
        return result


def _seconds(time_utc_ns: Nanoseconds, origin_ns: int) -> Float:
    return (time_utc_ns - origin_ns).astype(np.float64) / SECOND_NS
