"""A delimited log: one row at every tick of the logger's clock, each column holding the last value that had arrived."""

from __future__ import annotations

import gzip

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.simulate.logger_fields import LOGGER_FIELDS
from kempf.pipeline.simulate.trial import Trial
from kempf.schemas.errors import UsageError
from kempf.schemas.units import MILLISECOND_NS, SECOND_NS

Nanoseconds = NDArray[np.int64]


def to_csv(trial: Trial, rate_hz: float = 10.0) -> bytes:
    """Return the trial as gzipped comma-separated text.

    Parameters
    ----------
    trial : Trial
        See `kempf.pipeline.simulate.trial`.
    rate_hz : float
        Rows per second.

    Returns
    -------
    bytes
        The first column is UTC, ISO 8601 to the millisecond; the others are `LOGGER_FIELDS`. The first row stands where
        every instrument has been heard, the last before any of them has fallen silent.

    Raises
    ------
    UsageError
        The trial has no instrument, or is too short for all of them to be heard.
    """
    fields = [f for f in LOGGER_FIELDS if any(r.instrument.name == f.instrument for r in trial.instruments)]
    arrivals = [r.arrival_utc_ns for r in trial.instruments]
    if not fields or any(a.size == 0 for a in arrivals):
        raise UsageError(
            "trial_without_readings",
            "The trial has no instrument, or one that never spoke: there is no row to write.",
            "Add instruments, or make the programme longer.",
        )
    period_ns = round(SECOND_NS / rate_hz)
    first = -(-max(int(a[0]) for a in arrivals) // MILLISECOND_NS) * MILLISECOND_NS
    last = max(first, min(int(a[-1]) for a in arrivals))
    rows: Nanoseconds = np.arange(first, last + 1, period_ns, dtype=np.int64)
    columns = [_stamps(rows)]
    for field in fields:
        record = trial.record(field.instrument)
        held = np.searchsorted(record.arrival_utc_ns, rows, side="right") - 1
        texts = np.array([f"{v:.{field.decimals}f}" for v in field.written(record.values[field.column])], dtype=object)
        columns.append(list(texts[held]))
    lines = [",".join(["utc", *(f.name for f in fields)]), *map(",".join, zip(*columns, strict=True)), ""]
    return gzip.compress("\n".join(lines).encode("ascii"), compresslevel=6, mtime=0)


def _stamps(utc_ns: Nanoseconds) -> list[str]:
    milliseconds = (utc_ns // MILLISECOND_NS).astype("datetime64[ms]")
    return [f"{text}Z" for text in np.datetime_as_string(milliseconds, unit="ms")]
