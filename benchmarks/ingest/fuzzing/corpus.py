"""Small valid inputs of every reader."""

from __future__ import annotations

import gzip
import io
import json
from typing import Literal

import zstandard
from mcap.writer import CompressionType, Writer

from benchmarks.ingest.mixed_nmea import DRESSES, mixed_log

Reader = Literal["nmea", "mcap", "delimited", "profile"]
READERS: tuple[Reader, ...] = ("nmea", "mcap", "delimited", "profile")

#: Start of the MCAP logs, UTC nanoseconds.
START_NS = 1_746_255_600_000_000_000

PROFILE = b"""# a vessel
vessel: aurora
length_m: 58.0
beam_m: 11.4
antenna: {forward_m: 4.0, up_m: 12.0}
sources:
  - match: "*.iso.csv*"
    time: {column: utc}
    channels: &some
      sog: {channel: speed_over_ground, unit: m/s}
      delta: {channel: rudder_angle, unit: deg, positive: port, offset: 0.5}
  - match: "*.ms.csv*"
    format: delimited
    encoding: cp1252
    separator: ";"
    time: {column: t, unit: ms}
    channels: {h: {channel: heading, unit: deg}, r: {channel: roll, unit: deg}}
  - match: "*.blank.csv*"
    separator: whitespace
    header_lines: 2
    columns: [t, h, r]
    time: {column: t, unit: s, start: 2025-05-03T06:00:00Z}
    channels: {h: {channel: heading, unit: deg}, r: {channel: yaw_rate, unit: deg/min}}
  - match: "*.wide.csv*"
    encoding: utf-16
    time: {column: utc}
    channels: *some
  - match: "*.mcap*"
    channels:
      /gyro.heading: {channel: heading, unit: deg}
      /nav.pose.speed: {channel: speed_over_ground, unit: m/s}
  - match: "*.nmea*"
    channels:
      AGRSA.rudder_angle: {channel: rudder_angle, unit: deg, positive: port}
"""


def inputs(reader: Reader) -> list[tuple[str, bytes]]:
    """Return valid inputs, each with the file name that it goes by."""
    return {"nmea": _nmea, "mcap": _mcap, "delimited": _delimited, "profile": _profile}[reader]()


def packed(name: str, data: bytes) -> list[tuple[str, bytes]]:
    """Return the same input compressed in both ways, each with a checksum of its own."""
    zstd = zstandard.ZstdCompressor(write_checksum=True).compress(data)
    return [(f"{name}.gz", gzip.compress(data, mtime=0)), (f"{name}.zst", zstd)]


def _nmea() -> list[tuple[str, bytes]]:
    logs = [(f"{dress}.nmea", mixed_log(60, dress, 2)[0]) for dress in DRESSES]
    midnight = mixed_log(80, "plain", 0, seed=7)[0]
    return [
        *logs,
        ("cr.nmea", logs[0][1].replace(b"\r\n", b"\r")),
        ("rollover.nmea", midnight.replace(b"030525", b"170905")),
    ]


def _delimited() -> list[tuple[str, bytes]]:
    iso = "".join(f"2025-05-03T06:00:{k:02d}.{k:03d}Z,{k / 7:.3f},{-k % 30}\n" for k in range(40))
    ms = "".join(f'{1746255600000 + 50 * k};"{k * 3.5}";{k / 9:.2f};5\r\n' for k in range(40))
    blank = "".join(f"  {k * 0.05:.3f}   {k * 1.5}\t{-k}\n" for k in range(40))
    return [
        ("a.iso.csv", b"utc,sog,delta\n" + iso.encode()),
        ("a.ms.csv", "t;h;r;Größe\r\n".encode("cp1252") + ms.encode()),
        ("a.blank.csv", b"header one\nt [s] h [deg] r\n" + blank.encode()),
        ("a.wide.csv", ("utc,sog,delta\n" + iso).encode("utf-16")),
    ]


def _mcap() -> list[tuple[str, bytes]]:
    options: list[dict[str, object]] = [
        {"compression": CompressionType.NONE},
        {"compression": CompressionType.ZSTD},
        {"compression": CompressionType.LZ4},
        {"compression": CompressionType.NONE, "enable_crcs": False},
        {"use_chunking": False},
    ]
    return [(f"{k}.mcap", mcap_log(**given)) for k, given in enumerate(options)]


def mcap_log(**options: object) -> bytes:
    """Return a log of two JSON topics in several chunks."""
    out = io.BytesIO()
    writer = Writer(out, **{"chunk_size": 400, **options})  # type: ignore[arg-type]
    writer.start()
    schema = writer.register_schema("any", "jsonschema", b"{}")
    gyro, nav = (writer.register_channel(topic, "json", schema) for topic in ("/gyro", "/nav"))
    for k in range(40):
        at = START_NS + k * 100_000_000
        writer.add_message(gyro, at, json.dumps({"heading": k * 9}).encode(), at)
        writer.add_message(nav, at + 1, json.dumps({"pose": {"speed": k / 10}, "x": [1]}).encode(), at + 1)
    writer.add_attachment(START_NS, START_NS, "notes.txt", "text/plain", b"x" * 50)
    writer.add_metadata("about", {"a": "b"})
    writer.finish()
    return out.getvalue()


def _profile() -> list[tuple[str, bytes]]:
    as_json = json.dumps(
        {"vessel": "b", "sources": [{"match": "*", "time": {"column": "utc"}, "channels": {}}]}
    ).encode()
    return [("profile.yaml", PROFILE), ("small.yaml", b"vessel: a\nlength_m: 5\n"), ("profile.json", as_json)]
