"""Angles that count on beyond one turn: which of them continue a course, and which are nonsense.

A heading that an observer or an integrating gyro writes goes on past 360 deg. Such a reading is taken, on the circle,
where it is part of a run: each less than an eighth of a turn from the one before. A run counts that has a reading
within one turn, or that moves; a constant one is the mark of an instrument that has nothing to say, such as the 511 of
AIS and ECDIS.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from kempf.pipeline.ingest.decoded import Decoded, Flag, Float, Values
from kempf.pipeline.ingest.spans import Index
from kempf.schemas.channels import CHANNELS

_TURN = 2.0 * np.pi

#: Beyond so many turns an angle is nonsense, whatever stands beside it.
_MOST_TURNS = 100

#: A change of this size from one reading to the next ends a run. No ship turns so far between two readings of a zigzag,
#: and 511 deg, which says that there is no heading, is three times as far beyond one turn.
_LEAP = np.pi / 4.0

#: A run beyond one turn counts once it has so many readings, and so many different ones.
_FEWEST, _DIFFERENT = 5, 3

#: So many readings of a run that does not move are waited for.
_LONGEST = 1 << 16

#: So often it is looked at anew what can be decided without what is held back, before all of a part is.
_ROUNDS = 20


class Turns:
    """The circular channels of one log, which comes in parts; what is found does not depend on where it is cut."""

    def __init__(self) -> None:
        # last reading that counted, by source and channel
        self._last: dict[tuple[int, str], float] = {}
        self._wrapped: dict[str, int] = {}

    def undecided(self, work: Decoded, sources: Mapping[int, Index]) -> Flag:
        """Return which records have to wait for what follows, those of their source behind them too.

        Parameters
        ----------
        work : Decoded
            Shape (n,).
        sources : mapping of int to ndarray of int64
            Good records of each source, ascending.

        Returns
        -------
        ndarray of bool, shape (n,)
        """
        held = np.zeros(len(work), dtype=np.bool_)
        circular = [] if work.ends else _circular(work)
        for source, own in sources.items():
            decided = own
            # what is held of one channel, or for its instant, may be what decided a reading before it
            for _ in range(_ROUNDS):
                waits = decided.size
                for name, values in circular:
                    at, value = _offered(values, decided)
                    if _beyond(value).any():
                        _, first = _walk(self._last.get((source, name), np.nan), value, ends=False)
                        waits = min(waits, int(np.searchsorted(decided, at[first]))) if first < at.size else waits
                if waits == decided.size:
                    break
                # what shares an instant is checked together
                time = work.time_utc_ns[decided]
                decided = decided[: np.searchsorted(time, time[waits])]
            else:
                decided = decided[:0]
            held[own[decided.size :]] = True
        return held

    def wrapped(self, work: Decoded, sources: Mapping[int, Index]) -> dict[str, Values]:
        """Return the channels of records, the angles beyond one turn that count brought onto the circle.

        Parameters
        ----------
        work : Decoded
        sources : mapping of int to ndarray of int64
            Good records of each source, ascending, none of them `undecided`.
        """
        channels = dict(work.channels)
        for name, values in _circular(work):
            some = bool(_beyond(values.value).any())
            if work.ends and not some:
                continue
            on_circle = values.value.copy() if some else values.value
            for source, own in sources.items():
                at, value = _offered(values, own)
                if not at.size:
                    continue
                counts, _ = _walk(self._last.get((source, name), np.nan), value, ends=True)
                if counts.any():
                    self._last[source, name] = float(value[counts][-1])
                turned = at[counts & _beyond(value)]
                if turned.size:
                    on_circle[turned] = np.mod(on_circle[turned], _TURN)
                    self._wrapped[name] = self._wrapped.get(name, 0) + int(turned.size)
            channels[name] = Values(on_circle, values.present)
        return channels

    def notes(self) -> list[str]:
        """Say what was brought onto the circle."""
        return [
            f"{name}: {count} readings beyond one turn continue those before them and were brought onto the circle."
            for name, count in self._wrapped.items()
        ]


def _walk(last: float, value: Float, *, ends: bool) -> tuple[Flag, int]:
    """Return which readings count, and the first that what follows can still decide, their number where there is none.

    Parameters
    ----------
    last : float
        The last reading that counted, rad; NaN where there is none.
    value : ndarray, shape (n,)
        Finite readings of one source that follow, rad.
    ends : bool
        Whether nothing follows that could decide.
    """
    counts = ~_beyond(value)
    if counts.all():
        return counts, value.size
    at = np.flatnonzero(np.abs(value) <= _MOST_TURNS * _TURN)
    near = value[at]
    cuts = np.flatnonzero(np.abs(np.diff(near)) >= _LEAP) + 1
    for first, stop in pairwise([0, *cuts.tolist(), at.size]):
        run = near[first:stop]
        begin = 0
        while begin < run.size:
            part = run[begin : begin + _LONGEST]
            moves = part.size >= _FEWEST and np.unique(part).size >= _DIFFERENT
            if (begin == 0 and abs(run[0] - last) < _LEAP) or not _beyond(part).all() or moves:
                counts[at[first:stop][begin:]] = True
                last = float(run[-1])
                break
            if not ends and stop == at.size and part.size < _LONGEST:
                return counts, int(at[first + begin])
            begin += part.size
    return counts, value.size


def _circular(work: Decoded) -> list[tuple[str, Values]]:
    return [(name, values) for name, values in work.channels.items() if CHANNELS[name].wrap == "circle"]


def _offered(values: Values, own: Index) -> tuple[Index, Float]:
    """Return the records of one source that carry a number, and the numbers."""
    at = own[values.present[own] & np.isfinite(values.value[own])]
    return at, values.value[at]


def _beyond(value: Float) -> Flag:
    beyond: Flag = np.abs(value) > _TURN
    return beyond
