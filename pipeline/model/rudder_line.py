"""The rudder's reading as a line with corners, on which effects act before it is laid on the grid of a filter.

Readings and executes have corners between the instants of a grid. An effect that is given the grid's values alone takes
a corner to be wherever the grid has an instant: a rudder of limited rate would begin to move before its reading does.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float


@dataclass(frozen=True, eq=False)
class RudderLine:
    """A rudder's reading, linear between its instants, among which are those of a grid."""

    #: time_s, angle_rad: Shape (m,). Increasing instants from the grid's first, before which they may begin, s; rad.
    time_s: Float
    angle_rad: Float
    #: Shape (n,), n odd. Which of the instants are the grid's.
    grid: NDArray[np.int64]

    @classmethod
    def through(cls, time_s: Float, angle_rad: Float, grid_s: Float) -> RudderLine:
        """Return the line through some readings, with the instants of a grid within them.

        Parameters
        ----------
        time_s, angle_rad : ndarray, shape (m,)
            Readings and corners, in s and rad.
        grid_s : ndarray, shape (n,)
            Evenly spaced, n odd.
        """
        time = np.union1d(time_s[time_s <= grid_s[-1]], grid_s)
        return cls(time, np.interp(time, time_s, angle_rad), np.searchsorted(time, grid_s))

    def laid(self, course_rad: Float) -> Float:
        """Return what a filter takes of a course along the line, rad, shape (n,).

        The values at the grid's instants; those in the middle of every two steps are changed so that Simpson's rule has
        the area of the course over these, whatever corners it has in between.

        Parameters
        ----------
        course_rad : ndarray, shape (m,)
            Of the rudder that the hull feels, linear between the instants of the line.
        """
        steps = np.diff(self.time_s)
        area = np.concatenate([[0.0], np.cumsum(0.5 * steps * (course_rad[1:] + course_rad[:-1]))])
        result: Float = course_rad[self.grid].copy()
        ends, time = self.grid[::2], self.time_s
        mean = np.diff(area[ends]) / np.diff(time[ends])
        result[1::2] = (6.0 * mean - result[:-1:2] - result[2::2]) / 4.0
        return result

    @cached_property
    def as_read(self) -> Float:
        """What a filter takes of the reading itself, rad, shape (n,)."""
        return self.laid(self.angle_rad)
