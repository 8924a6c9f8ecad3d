"""A vessel's runs as an MCAP file: measured and predicted beside each other on topics of their own, for log viewers.

JSON messages with a JSON Schema, times in UTC nanoseconds, chunks compressed with zstd (https://mcap.dev/spec). What is
not there is left out of a message: no viewer reads NaN.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from itertools import chain
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.compare.comparison import ComparedRun
from kempf.pipeline.compare.run_series import first_heading, instants_utc_ns
from kempf.pipeline.predict.prediction import Predicted
from kempf.schemas.confidence import NORMAL_95
from kempf.schemas.enumeration import as_words
from kempf.schemas.units import SECOND_NS

#: written into the header instead of the writer's version, so that an upgrade of it leaves the bytes alone
_LIBRARY = "kempf"
_CHUNK_BYTES = 262_144
_DEG = float(np.rad2deg(1.0))
#: column of the measurements, unit people use, and factor to it
_CHANNELS = {
    "lateral_speed": (0, "m_s", 1.0),
    "yaw_rate": (1, "deg_s", _DEG),
    "heading": (2, "deg", _DEG),
}
_WORDS = {
    "m_s": "m/s",
    "deg_s": "deg/s",
    "deg": "deg",
}
NOWHERE: Mapping[str, tuple[Series, Series]] = MappingProxyType({})


if TYPE_CHECKING:
    from kempf.flows.jobs.compare.compare_vessel import Comparison


@dataclass(frozen=True)
class _Topic:
    """One topic: its name, its schema's name and properties with their descriptions."""

    name: str
    schema: str
    properties: Mapping[str, str]


def to_mcap(
    runs: Sequence[ComparedRun], about: Mapping[str, str], positions: Mapping[str, tuple[Series, Series]] = NOWHERE
) -> bytes:
    """Return runs as an MCAP file.

    Parameters
    ----------
    runs : sequence of ComparedRun
        Compared one step ahead; each bears its free run as well.
    about : mapping of str to str
        What the file says of itself: vessel, ids, settings; a metadata record of it.
    positions : mapping of str to (Series, Series), optional
        Latitude and longitude, rad, by run.

    Returns
    -------
    bytes
        Topics ``/measured/X``, ``/predicted/one_step/X`` with ``low_95`` and ``high_95``, ``/predicted/free_run/X``,
        ``/residual/one_step/X`` and ``/residual/free_run/X`` (measured less predicted) for X in ``lateral_speed``,
        ``yaw_rate``, ``heading`` (true, 0 to 360 deg; the ends of its interval stay beside it); ``/input/rudder``,
        ``/input/speed``; ``/measured/position`` as log viewers' maps take it; ``/run`` names each manoeuvre where it
        begins and ends. Equal content gives equal bytes.
    """
    from mcap.writer import CompressionType, Writer

    out = BytesIO()
    writer = Writer(out, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD)
    writer.start(profile="", library=_LIBRARY)
    channels: dict[str, int] = {}
    messages = []
    for run in sorted(runs, key=lambda run: (run.residuals.filtered.run.start_utc_ns, run.name)):
        for topic, stamp, content in chain(_of_run(run), _of_position(*positions.get(run.name, ()))):
            if topic.name not in channels:
                schema = writer.register_schema(topic.schema, "jsonschema", _schema(topic))
                channels[topic.name] = writer.register_channel(topic.name, "json", schema)
            messages.append((stamp, channels[topic.name], content))
    writer.add_metadata("kempf", dict(about))
    # within one instant in the order of the topics
    messages.sort(key=lambda message: (message[0], message[1]))
    for sequence, (stamp, channel, content) in enumerate(messages):
        data = json.dumps(content, separators=(",", ":"), allow_nan=False).encode()
        writer.add_message(channel, stamp, data, stamp, sequence=sequence)
    writer.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()


def about(comparison: Comparison) -> dict[str, str]:
    """Return what a file says of where its predictions come from."""
    content = {
        "vessel": comparison.vessel,
        "parameter_set_id": comparison.parameter_set.parameter_set_id,
        "estimator": comparison.parameter_set.estimator,
        "effects": ", ".join(comparison.parameter_set.model_spec.get("effects", ())),
        "code_version": str(comparison.parameter_set.provenance.get("code_version", "")),
    }
    for run in comparison.runs:
        content[run.name] = f"{as_words(run.sample)}; noise levels {run.levels_from}"
    return content


def _schema(topic: _Topic) -> bytes:
    kinds = {"held_out": "boolean", "segment_id": "string", "event": "string"}
    properties = {
        name: {"type": kinds.get(name, "number"), "description": words} for name, words in topic.properties.items()
    }
    return json.dumps({"type": "object", "title": topic.schema, "properties": properties}).encode()


def _of_run(run: ComparedRun) -> Iterator[tuple[_Topic, int, dict[str, Any]]]:
    record = run.residuals.filtered.run
    instant = instants_utc_ns(record)
    begins = _Topic(
        "/run",
        "kempf.run",
        {"event": "begin or end", "segment_id": "manoeuvre", "held_out": "whether the parameters have not seen it"},
    )
    for event, at in (("begin", instant[0]), ("end", instant[-1])):
        yield begins, int(at), {"event": event, "segment_id": run.name, "held_out": run.held_out}
    for name, (column, unit, factor) in _CHANNELS.items():
        first = first_heading(record) if name == "heading" else None
        # a prediction is made for the moment of its measurement, a little off the grid's instant
        late = instant + np.round(record.offset_s[:, column] * SECOND_NS).astype(np.int64)
        words = f"{as_words(name)}, {_WORDS[unit]}"
        field = f"{name}_{unit}"
        shown = {field: _shown(factor * record.measured[:, column], first)}
        yield from _series(_topic(f"/measured/{name}", f"measured {words}", field), late, shown)
        for horizon, prediction in (("one_step", run.predicted), ("free_run", run.free)):
            yield from _predicted(prediction, horizon, name, words, late, first)
            topic = _topic(
                f"/residual/{horizon}/{name}", f"measured less predicted {words}, {as_words(horizon)}", field
            )
            yield from _series(topic, late, {field: factor * prediction.error[:, column]})
    yield from _series(
        _topic("/input/rudder", "rudder angle, deg, starboard positive", "rudder_angle_deg"),
        instant,
        {"rudder_angle_deg": _DEG * record.rudder_rad},
    )
    yield from _series(
        _topic("/input/speed", "speed through the water, m/s", "speed_through_water_m_s"),
        instant,
        {"speed_through_water_m_s": record.speed_m_s},
    )


def _of_position(*position: Series) -> Iterator[tuple[_Topic, int, dict[str, Any]]]:
    """Yield the fixes of a run as Foxglove's schema of a place has them, whose name its map knows."""
    if not position:
        return
    latitude, longitude = position
    words = {"latitude": "degrees, north positive", "longitude": "degrees, east positive"}
    columns = {"latitude": _DEG * latitude.value, "longitude": np.mod(_DEG * longitude.value + 180.0, 360.0) - 180.0}
    yield from _series(_Topic("/measured/position", "foxglove.LocationFix", words), latitude.time_utc_ns, columns)


def _shown(value: Float, first_rad: float | None) -> Float:
    """Return values as they are, or headings counted from a first one as true ones of 0 to 360 deg."""
    return value if first_rad is None else np.mod(value + _DEG * first_rad, 360.0)


def _predicted(
    prediction: Predicted, horizon: str, name: str, words: str, instant: Any, first_rad: float | None
) -> Iterator[tuple[_Topic, int, dict[str, Any]]]:
    column, unit, factor = _CHANNELS[name]
    field = f"{name}_{unit}"
    columns = {field: _shown(factor * prediction.predicted[:, column], first_rad)}
    properties = {field: f"predicted {words}, {as_words(horizon)}"}
    if np.isfinite(prediction.std[:, column]).any():
        half = NORMAL_95 * factor * prediction.std[:, column]
        columns |= {"low_95": columns[field] - half, "high_95": columns[field] + half}
        properties |= {"low_95": "lower end of the 95 % interval", "high_95": "upper end of the 95 % interval"}
    topic = _Topic(f"/predicted/{horizon}/{name}", f"kempf.{horizon}.{name}", properties)
    yield from _series(topic, instant, columns)


def _topic(name: str, words: str, field: str) -> _Topic:
    return _Topic(name, f"kempf.{name.strip('/').replace('/', '.')}", {field: words})


def _series(topic: _Topic, instant: Any, columns: Mapping[str, Float]) -> Iterator[tuple[_Topic, int, dict[str, Any]]]:
    names = list(columns)
    table = np.column_stack([columns[name] for name in names])
    for stamp, row in zip(instant.tolist(), table.tolist(), strict=True):
        content = {name: value for name, value in zip(names, row, strict=True) if np.isfinite(value)}
        if names[0] in content:
            yield topic, stamp, content
