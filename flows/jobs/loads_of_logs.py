"""The logs of named stretches in the order of time, and how the ship was laden in each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeVar

from kempf.pipeline.estimate.record.loads import loads
from kempf.warehouse.notes import Sailed

S = TypeVar("S", bound=Sailed)


def in_order(named: Iterable[tuple[str, S]]) -> list[tuple[str, S]]:
    """Return named stretches in the order of time."""
    return sorted(named, key=lambda entry: (entry[1].start_utc_ns, entry[0]))


def logs_in_order(named: Iterable[tuple[str, S]]) -> list[str]:
    """Return the logs of named stretches in the order of time."""
    return list(dict.fromkeys(one.log_id for _, one in in_order(named)))


def loads_of_logs(named: Iterable[tuple[str, S]], draughts_m: Mapping[str, float]) -> dict[str, float]:
    """Return the load of every log, see `pipeline.estimate.record.loads`, in the order of time.

    Parameters
    ----------
    draughts_m : mapping of str to float
        By log, m, of those whose draught is known.
    """
    return loads(logs_in_order(named), draughts_m)
