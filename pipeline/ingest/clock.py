"""The clock of one source of a log: which records have a time that runs back, found as they come."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from kempf.schemas.units import SECOND_NS

#: A record this far ahead of both its neighbours has a damaged time, ns; without this rule it would make every record
#: behind it look late.
SPIKE_NS = 10 * SECOND_NS


class Clock:
    """Times of one source in the order of the log.

    Attributes
    ----------
    latest : int or None
        Latest time that was believed, ns.
    """

    def __init__(self) -> None:
        self.latest: int | None = None
        self._before: int | None = None

    def goes_back(self, time: NDArray[np.int64], *, ends: bool) -> NDArray[np.bool_]:
        """Return of times that follow on those before whether they are earlier than one before, or alone far ahead.

        Parameters
        ----------
        time : ndarray of int64, shape (n,)
            Nanoseconds.
        ends : bool
            Whether no other follows.

        Returns
        -------
        ndarray of bool, shape (m,)
            Of the first m; the others have to be given again, with what follows on them. m is n at the end.
        """
        settled = time.size if ends else max(time.size - 1, 0)
        if self._before is None and not ends and time.size < 3:
            settled = 0  # the first is judged by the two behind it
        back = self._spikes(time)[:settled]
        if settled == 0:
            return back
        true = time[:settled][~back]
        self._before = int(time[settled - 1])
        if true.size:
            believed = np.maximum.accumulate(true if self.latest is None else np.append(self.latest, true))
            back[~back] = true < believed[-true.size :]
            self.latest = int(believed[-1])
        return back

    def _spikes(self, time: NDArray[np.int64]) -> NDArray[np.bool_]:
        at = time if self._before is None else np.append(self._before, time)
        spike = np.zeros(at.size, dtype=np.bool_)
        spike[1:-1] = (at[1:-1] > at[2:] + SPIKE_NS) & (at[2:] >= at[:-2]) & (at[1:-1] > at[:-2] + SPIKE_NS)
        # the first record has no neighbour before it, but the two behind it may agree against it
        if self._before is None and at.size > 2:
            spike[0] = at[0] > at[1] + SPIKE_NS and at[2] >= at[1] and at[0] > at[2]
        return spike[at.size - time.size :]
