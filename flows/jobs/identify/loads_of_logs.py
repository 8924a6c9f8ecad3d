"""The logs of named stretches in the order of time, and how the ship was laden in each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeVar

from kempf.pipeline.estimate.record.loads import loads
from kempf.warehouse.tables.notes import LogStretch

S = TypeVar("S", bound=LogStretch)
T = TypeVar("T", bound=LogStretch)


def in_order(named: Iterable[tuple[str, S]]) -> list[tuple[str, S]]:
    """Return named stretches in the order of time."""
    return sorted(named, key=lambda entry: (entry[1].start_utc_ns, entry[0]))


def logs_in_order(named: Iterable[tuple[str, S]]) -> list[str]:
    """Return the logs of named stretches in the order of time."""
    return list(dict.fromkeys(stretch.log_id for _, stretch in in_order(named)))


def loads_of_logs(named: Iterable[tuple[str, S]], draughts_m: Mapping[str, float]) -> dict[str, float]:
    """Return the load of every log, see `pipeline.estimate.record.loads`, in the order of time.

    Parameters
    ----------
    draughts_m : mapping of str to float
        By log, m, of those whose draught is known.
    """
    return loads(logs_in_order(named), draughts_m)


def loads_beside(
    own: Iterable[tuple[str, S]],
    own_draughts_m: Mapping[str, float],
    others: Iterable[tuple[str, T]],
    other_draughts_m: Mapping[str, float],
) -> dict[str, float]:
    """Return the load of every log of a set and of logs beside it, all on the scale of the set.

    A log beside the set counts as laden as the last log of the set before it, or the first one, where the set does not
    go by draughts or that of the log is not known.

    Parameters
    ----------
    own, others : iterable of (str, LogStretch)
        Stretches of the logs of the set, and of others.
    own_draughts_m, other_draughts_m : mapping of str to float
        By log, m, of those whose draught is known.
    """
    began: dict[str, int] = {}
    for _, stretch in in_order(own):
        began.setdefault(stretch.log_id, stretch.start_utc_ns)
    own_loads = loads(list(began), own_draughts_m)
    load, first = dict(own_loads), next(iter(began))
    by_draughts = all(log_id in own_draughts_m for log_id in began)
    for _, other in in_order(others):
        if other.log_id in load:
            continue
        if by_draughts and other.log_id in other_draughts_m:
            both = {first: own_draughts_m[first], other.log_id: other_draughts_m[other.log_id]}
            load[other.log_id] = loads([first, other.log_id], both)[other.log_id]
        else:
            before = [log_id for log_id, start in began.items() if start <= other.start_utc_ns]
            load[other.log_id] = own_loads[before[-1] if before else first]
    return load
