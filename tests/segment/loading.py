"""Small readers of the measured logs for the tests of `pipeline.segment`; they share no code with `pipeline.ingest`.

Every reader returns heading (rad, unwrapped), rudder (rad, positive to starboard) and speed (m/s) as `Series`.
"""

from __future__ import annotations

import gzip
import io
import json
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from mcap.reader import make_reader

from kempf.pipeline.channels.series import Float, Nanoseconds, Series

SHARED = Path(__file__).parents[2].parent / "shared"
KNOT = 1852.0 / 3600.0


@dataclass(frozen=True)
class Log:
    heading: Series
    rudder: Series
    speed: Series


def require(relative: str) -> Path:
    """Return the path of measured data, or skip the test where they are absent."""
    path = SHARED / relative
    if not path.exists():
        pytest.skip(f"the measured data {path} are not here")
    return path


def available(pattern: str) -> list[str]:
    """Return the files that match, relative to the shared folder; one placeholder that skips where there are none."""
    found = sorted(str(p.relative_to(SHARED)) for p in SHARED.glob(pattern))
    return found or [pattern]


@cache
def load(relative: str) -> Log:
    """Read one measured log by its name."""
    path = require(relative)
    if path.suffix == ".mcap":
        return _mcap(path)
    if path.suffix == ".dat":
        return _tank(path)
    if path.name.endswith(".nmea.gz"):
        return _nmea(path)
    if path.name.endswith(".csv.gz"):
        return _held_csv(path)
    return _open_water(path)


def circle(time_utc_ns: Nanoseconds, degrees: Float) -> Series:
    return Series(time_utc_ns, np.unwrap(np.deg2rad(degrees)))


def _nanoseconds(seconds: Float) -> Nanoseconds:
    return np.round(seconds * 1e9).astype(np.int64)


def _tank(path: Path) -> Log:
    table = np.loadtxt(path, skiprows=4, encoding="cp1252")
    time = _nanoseconds(table[:, 0])
    speed = np.hypot(table[:, 4], table[:, 5])
    return Log(circle(time, table[:, 3]), Series(time, -np.deg2rad(table[:, 8])), Series(time, speed))


def _open_water(path: Path) -> Log:
    frame = pl.read_csv(path)
    time = _nanoseconds(frame["time"].to_numpy())
    return Log(
        circle(time, frame["heading"].to_numpy()),
        Series(time, np.deg2rad(frame["rudder"].to_numpy())),
        Series(time, frame["speed"].to_numpy() * KNOT),
    )


def _held_csv(path: Path) -> Log:
    """Read the 10 Hz logger: the previous value is held, so only the instants of change are measurements."""
    frame = pl.read_csv(io.BytesIO(gzip.decompress(path.read_bytes())))
    time = frame["utc"].str.to_datetime(time_unit="ns").dt.timestamp("ns").to_numpy()

    def changes(name: str) -> tuple[Nanoseconds, Float]:
        value = frame[name].to_numpy()
        fresh = np.flatnonzero(np.diff(value, prepend=np.inf) != 0)
        return time[fresh], value[fresh]

    rudder_time, rudder = changes("rudder")
    return Log(
        circle(*changes("heading")),
        Series(rudder_time, np.deg2rad(rudder)),
        Series(*changes("stw")),
    )


def _pairs(pairs: Iterable[tuple[int, float]]) -> tuple[Nanoseconds, Float]:
    ordered = dict(sorted(pairs))
    return np.array(list(ordered), dtype=np.int64), np.array(list(ordered.values()))


def _mcap(path: Path) -> Log:
    values: dict[str, list[tuple[int, float]]] = {"heading": [], "rudder": [], "stw": []}
    topics = ["/gyro/heading", "/steering/rudder", "/log/speed"]
    with path.open("rb") as stream:
        for _, _, message in make_reader(stream).iter_messages(topics=topics):
            for name, value in json.loads(message.data).items():
                values[name].append((message.log_time, value))
    time, rudder = _pairs(values["rudder"])
    return Log(circle(*_pairs(values["heading"])), Series(time, np.deg2rad(rudder)), Series(*_pairs(values["stw"])))


def _nmea(path: Path) -> Log:
    values: dict[str, list[tuple[int, float]]] = {"HDT": [], "RSA": [], "VHW": []}
    for line in gzip.decompress(path.read_bytes()).decode("latin-1").splitlines():
        stamp, _, sentence = line.partition(" $")
        body, _, checksum = sentence.partition("*")
        if body[2:5] not in values:
            continue
        found = 0
        for character in body.encode("latin-1"):
            found ^= character
        if checksum != f"{found:02X}":
            continue
        kind, fields = body[2:5], body.split(",")
        arrival = round(datetime.fromisoformat(stamp).timestamp() * 1000) * 1_000_000
        values[kind].append((arrival, float(fields[5 if kind == "VHW" else 1])))
    time, rudder = _pairs(values["RSA"])
    speed_time, speed = _pairs(values["VHW"])
    return Log(circle(*_pairs(values["HDT"])), Series(time, np.deg2rad(rudder)), Series(speed_time, speed * KNOT))
