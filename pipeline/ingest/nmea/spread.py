"""Sentences without a time that come several times between two fixes of a log without stamps."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.ingest.decoded import Nanoseconds
from kempf.pipeline.ingest.spans import Index

#: Sentences are spread over so many usual distances of the fixes at most: a longer one is a pause of the log.
_PAUSE = 3


def spread(
    fix_ns: Nanoseconds, fix: Index, record: Index, source: Index, *, follows: bool
) -> tuple[Nanoseconds, Index]:
    """Return how far behind their fix sentences were said.

    A receiver tells its fix once a second, a compass its heading ten times: the ten would all have the time of the fix.
    Those of one source that come between two fixes are taken for evenly spaced.

    Parameters
    ----------
    fix_ns, fix : ndarray of int64, shape (m,)
        Instants of the fixes and their records, ascending; several may tell one instant.
    record, source : ndarray of int64, shape (n,)
        Records, ascending, of the sentences that were given the time of a fix, and which source they come from.
    follows : bool
        Whether they were given that of the fix behind them.

    Returns
    -------
    delay_ns : ndarray of int64, shape (n,)
        To be added to the time of the fix; below zero where ``follows``.
    shared : ndarray of int64, shape (n,)
        How many sentences of its source share its fix, itself among them.
    """
    none = np.zeros(record.size, dtype=np.int64), np.ones(record.size, dtype=np.int64)
    if fix.size == 0 or record.size == 0:
        return none
    opens = np.concatenate(([True], fix_ns[1:] != fix_ns[:-1]))
    epoch_of_fix = np.cumsum(opens) - 1
    instant = fix_ns[opens]
    distance = np.diff(instant)
    if not bool(np.any(distance > 0)):
        return none
    usual = int(np.median(distance[distance > 0]))
    # what comes before the first fix or behind the last is taken to be as long as usual
    distance = np.append(usual, distance) if follows else np.append(distance, usual)
    distance = np.clip(distance, 0, _PAUSE * usual)
    at = np.searchsorted(fix, record) if follows else np.searchsorted(fix, record) - 1
    epoch = epoch_of_fix[np.clip(at, 0, fix.size - 1)]
    order = np.argsort(source, kind="stable")
    heads = np.flatnonzero(np.concatenate(([True], (np.diff(source[order]) != 0) | (np.diff(epoch[order]) != 0))))
    count = np.diff(heads, append=record.size)
    shared, place = np.repeat(count, count), np.arange(record.size) - np.repeat(heads, count)
    step = distance[epoch[order]] // shared
    result = np.empty((2, record.size), dtype=np.int64)
    result[0, order] = (place - (shared - 1)) * step if follows else place * step
    result[1, order] = shared
    return result[0], result[1]
