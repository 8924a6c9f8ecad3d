"""An MCAP log: JSON messages with JSON schemas, one topic an instrument, zstd chunks, stamped with their arrival."""

from __future__ import annotations

import json
from io import BytesIO
from itertools import groupby

import numpy as np
from mcap.writer import CompressionType, Writer

from kempf.pipeline.simulate.logger_fields import LOGGER_FIELDS, LoggerField
from kempf.pipeline.simulate.trial import Trial

#: Written into the header instead of the writer's version, so that an upgrade of it leaves the bytes alone.
_LIBRARY = "kempf simulator"


def to_mcap(trial: Trial, chunk_bytes: int = 1_048_576) -> bytes:
    """Return the trial as an MCAP file.

    Parameters
    ----------
    trial : Trial
        See `kempf.pipeline.simulate.trial`.
    chunk_bytes : int
        Uncompressed size at which a chunk is closed.

    Returns
    -------
    bytes
        Messages in the order of their arrival, log time and publish time the arrival; topics and fields as in
        `LOGGER_FIELDS`.
    """
    present = {r.instrument.name for r in trial.instruments}
    fields = [f for f in LOGGER_FIELDS if f.instrument in present]
    out = BytesIO()
    writer = Writer(out, chunk_size=chunk_bytes, compression=CompressionType.ZSTD)
    writer.start(profile="", library=_LIBRARY)
    times, channels, payloads = [], [], []
    for topic, group in groupby(fields, key=lambda f: f.topic):
        own = list(group)
        schema = writer.register_schema(own[0].schema, "jsonschema", _json_schema(own))
        channel = writer.register_channel(topic, "json", schema)
        arrival = trial.record(own[0].instrument).arrival_utc_ns
        times.append(arrival)
        channels.append(np.full(arrival.size, channel))
        payloads += _messages(trial, own)
    if times:
        log_time, channel_id = np.concatenate(times), np.concatenate(channels)
        for k in np.argsort(log_time, kind="stable"):
            stamp = int(log_time[k])
            writer.add_message(int(channel_id[k]), stamp, payloads[k], stamp)
    writer.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()


def _json_schema(fields: list[LoggerField]) -> bytes:
    return json.dumps({"type": "object", "properties": {f.name: {"type": "number"} for f in fields}}).encode()


def _messages(trial: Trial, fields: list[LoggerField]) -> list[bytes]:
    values = trial.record(fields[0].instrument).values
    names = [f.name for f in fields]
    columns = [f.written(values[f.column]).tolist() for f in fields]
    return [json.dumps(dict(zip(names, row, strict=True))).encode() for row in zip(*columns, strict=True)]
