"""MCAP logs of any size for the measurements: messages made in columns, written record by record.

Times and values change from message to message, so that a chunk packs as a measured one does and not as a constant.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

MAGIC = b"\x89MCAP0\r\n"
START_NS = 1_755_497_274_000_000_000
STEP_NS = 2_000_000

_SEPARATOR = "\n" + "=" * 80 + "\n"
IMU = _SEPARATOR.join(
    (
        "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
        "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
        "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance",
        "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id",
        "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec",
        "MSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1",
        "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z",
    )
)

#: Topic, message encoding, schema name, schema encoding, schema.
Topic = tuple[str, str, str, str, bytes]
JSON_TOPICS: tuple[Topic, ...] = tuple(
    (f"/json/{name}", "json", name, "jsonschema", b'{"type": "object"}')
    for name in ("heading", "rudder", "speed", "rate", "roll")
)
IMU_TOPIC: Topic = ("/imu", "cdr", "sensor_msgs/msg/Imu", "ros2msg", IMU.encode())
#: What the profile of these logs maps: the field of every JSON topic, and the rate of the IMU.
CHANNELS = {
    "/json/heading.value": {"channel": "heading", "unit": "deg"},
    "/json/rudder.value": {"channel": "rudder_angle", "unit": "deg"},
    "/json/speed.value": {"channel": "speed_through_water", "unit": "m/s"},
    "/json/rate.value": {"channel": "yaw_rate", "unit": "deg/min"},
    "/json/roll.value": {"channel": "roll", "unit": "deg"},
    "/imu.angular_velocity.z": {"channel": "yaw_rate", "unit": "rad/s", "positive": "port"},
}
Bytes = NDArray[np.uint8]


def json_payloads(rng: np.random.Generator, time_ns: NDArray[np.int64]) -> Bytes:
    """Return one JSON message a row: its time, a number of all the digits of a double, a truth and a word."""
    template = b'{"stamp": 0000000000.000000, "value": 00.00000000000000, "valid": true, "unit": "deg"}'
    rows = np.tile(np.frombuffer(template, dtype=np.uint8), (time_ns.size, 1))
    stamp_json(rows, time_ns)
    _digits(rows, 38, rng.integers(10, 40, time_ns.size), 2)
    _digits(rows, 41, rng.integers(0, 10**14, time_ns.size), 14)
    return rows


def stamp_json(rows: Bytes, time_ns: NDArray[np.int64]) -> None:
    """Write the times into JSON messages."""
    _digits(rows, 10, time_ns // 1_000_000_000, 10)
    _digits(rows, 21, time_ns % 1_000_000_000 // 1_000, 6)


def stamp_imu(rows: Bytes, time_ns: NDArray[np.int64]) -> None:
    """Write the times into IMU messages."""
    rows[:, 4:8] = (time_ns // 1_000_000_000).astype("<i4")[:, None].view(np.uint8)
    rows[:, 8:12] = (time_ns % 1_000_000_000).astype("<u4")[:, None].view(np.uint8)


def _digits(rows: Bytes, at: int, number: NDArray[np.int64], width: int) -> None:
    for k in range(width):
        rows[:, at + width - 1 - k] = 48 + number // 10**k % 10


def imu_payloads(rng: np.random.Generator, time_ns: NDArray[np.int64]) -> Bytes:
    """Return one sensor_msgs/Imu in little-endian CDR a row, covariances zero as most drivers have them."""
    head = b"\x00\x01\x00\x00" + bytes(8) + struct.pack("<I", 9) + b"imu_link\0" + bytes(3)
    rows = np.zeros((time_ns.size, len(head) + 37 * 8), dtype=np.uint8)
    rows[:, : len(head)] = np.frombuffer(head, dtype=np.uint8)
    stamp_imu(rows, time_ns)
    numbers = np.zeros((time_ns.size, 37))
    for first, last in ((0, 4), (13, 16), (25, 28)):
        numbers[:, first:last] = rng.uniform(-0.5, 0.5, (time_ns.size, last - first))
    rows[:, len(head) :] = numbers.astype("<f8").view(np.uint8)
    return rows


#: Chunks whose values differ; behind them they come again, with their own times.
_POOL = 6


def chunks(topics: tuple[Topic, ...], ticks: int, ticks_a_chunk: int) -> Iterator[tuple[bytes, int, int, int]]:
    """Yield the records of every chunk with its messages and its first and last log time; each topic once a tick."""
    made: dict[tuple[int, int], Bytes] = {}
    for turn, first in enumerate(range(0, ticks, ticks_a_chunk)):
        n = min(ticks_a_chunk, ticks - first)
        rng = np.random.default_rng((7, turn))
        tick = START_NS + STEP_NS * np.arange(first, first + n, dtype=np.int64)
        parts = []
        for number, topic in enumerate(topics, start=1):
            time_ns = tick + 1_000 * number + rng.integers(0, 1_000, n)
            key = (turn % _POOL, number)
            if key not in made or made[key].shape[0] != n:
                made[key] = (json_payloads if topic[1] == "json" else imu_payloads)(rng, time_ns)
            payloads = made[key]
            (stamp_json if topic[1] == "json" else stamp_imu)(payloads, time_ns)
            head = struct.pack("<BQHI", 5, 22 + payloads.shape[1], number, 0) + bytes(16)
            rows = np.empty((n, len(head) + payloads.shape[1]), dtype=np.uint8)
            rows[:, : len(head)] = np.frombuffer(head, dtype=np.uint8)
            rows[:, 15:23] = rows[:, 23:31] = time_ns.astype("<u8")[:, None].view(np.uint8)
            rows[:, len(head) :] = payloads
            parts.append(rows)
        described = b"".join(_described(topics)) if first == 0 else b""
        yield described + np.hstack(parts).tobytes(), n * len(topics), int(tick[0]), int(tick[-1]) + STEP_NS


def write_log(path: Path, topics: tuple[Topic, ...], ticks: int, *, ticks_a_chunk: int = 1500) -> int:
    """Write a log with zstd chunks, CRCs and a summary with a chunk index; return the number of its messages."""
    import zstandard

    packer = zstandard.ZstdCompressor()
    places: list[bytes] = []
    count = 0
    with path.open("wb") as out:
        out.write(MAGIC + _record(1, _text(b"") + _text(b"")))
        for records, messages, since, until in chunks(topics, ticks, ticks_a_chunk):
            packed = packer.compress(records)
            head = struct.pack("<QQQI", since, until, len(records), zlib.crc32(records))
            chunk = _record(6, head + _text(b"zstd") + struct.pack("<Q", len(packed)) + packed)
            index = struct.pack("<QQQQ", since, until, out.tell(), len(chunk)) + _text(b"") + struct.pack("<Q", 0)
            places.append(_record(8, index + _text(b"zstd") + struct.pack("<QQ", len(packed), len(records))))
            out.write(chunk)
            count += messages
        out.write(_record(15, struct.pack("<I", 0)))
        start = out.tell()
        each = [struct.pack("<HQ", number, count // len(topics)) for number in range(1, len(topics) + 1)]
        statistics = struct.pack("<QHIIII", count, len(topics), len(topics), 0, 0, len(places))
        statistics += struct.pack("<QQ", START_NS, START_NS + STEP_NS * (ticks + 1)) + _text(b"".join(each))
        summary = b"".join([*_described(topics), *places, _record(11, statistics)])
        footer = struct.pack("<BQQQ", 2, 20, start, 0)
        out.write(summary + footer + struct.pack("<I", zlib.crc32(summary + footer)) + MAGIC)
    return count


def _described(topics: tuple[Topic, ...]) -> list[bytes]:
    """Records of all schemas and channels."""
    found = []
    for number, (topic, encoding, name, kind, schema) in enumerate(topics, start=1):
        found.append(
            _record(3, struct.pack("<H", number) + _text(name.encode()) + _text(kind.encode()) + _text(schema))
        )
        content = struct.pack("<HH", number, number) + _text(topic.encode()) + _text(encoding.encode()) + _text(b"")
        found.append(_record(4, content))
    return found


def _record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def _text(value: bytes) -> bytes:
    return struct.pack("<I", len(value)) + value
