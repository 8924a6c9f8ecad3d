"""How deeply a ship is laden in each of her logs: what an effect of her load goes by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

#: the load counts in tenths of the first draught: a change of the size that one log differs from the next by
_TENTHS = 10.0


def loads(logs: Sequence[str], draughts_m: Mapping[str, float]) -> dict[str, float]:
    """Return the load of every log, 0 in the first.

    Parameters
    ----------
    logs : sequence of str
        Ids in the order of time.
    draughts_m : mapping of str to float
        Mean draught by log, m, of those whose draught is known.

    Returns
    -------
    dict of str to float
        By how many tenths of the first log's draught she lies deeper, where the draught of every log is known; else
        the number of the log, which takes every log to differ from the one before by the same.

    Examples
    --------
    >>> loads(["a", "b", "c"], {"a": 7.0, "b": 7.7})
    {'a': 0.0, 'b': 1.0, 'c': 2.0}
    >>> loads(["a", "b"], {"a": 8.0, "b": 10.0})
    {'a': 0.0, 'b': 2.5}
    """
    if not logs or any(log not in draughts_m for log in logs):
        return {log: float(number) for number, log in enumerate(logs)}
    first = draughts_m[logs[0]]
    return {log: _TENTHS * (draughts_m[log] - first) / first for log in logs}
