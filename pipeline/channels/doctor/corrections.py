"""The lines of the vessel profile that correct a fault."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi

import numpy as np

from kempf.pipeline.channels.doctor.faults import Fault
from kempf.pipeline.channels.doctor.log import VELOCITIES
from kempf.schemas.channels import CHANNELS
from kempf.schemas.profile import ChannelMap, Source
from kempf.schemas.units import TO_SI

#: Channels with a side: their sign is turned by ``positive``, that of others by ``scale``.
_SIDED = ("heading", "course_over_ground", "yaw_rate", "rudder_angle", "rudder_order", "wind_angle", "roll")
#: Decimals that a proposal is written with: offset in degrees, delay in seconds, rate of a clock.
_OFFSET, _DELAY, _RATE = 1, 2, 6


@dataclass(frozen=True)
class ProfileCorrection:
    """One entry of ``channels`` in a source of the profile, as it should be."""

    #: Column, field of a topic, or sentence and channel.
    key: str
    #: What it should say.
    mapped: ChannelMap

    @property
    def line(self) -> str:
        """The entry as a line of YAML, what is as usual left out."""
        fields = self.mapped.model_dump(exclude_defaults=True)
        inner = ", ".join(f"{name}: {value}" for name, value in fields.items())
        return f"{self.key}: {{{inner}}}"


def entries(
    source: Source | None, log_format: str, instruments: Mapping[str, str]
) -> dict[str, tuple[str, ChannelMap]]:
    """Return the entry of the profile behind each channel; the usual one where it says nothing of an NMEA log.

    Parameters
    ----------
    source : Source or None
        How the log is read.
    log_format : {"delimited", "mcap", "nmea"}
    instruments : mapping of str to str
        The log's source that serves each channel, `Instruments.sources`.

    Returns
    -------
    dict of str to (str, ChannelMap)
        Key and entry by channel.
    """
    entry: dict[str, tuple[str, ChannelMap]] = {}
    channels = source.channels if source is not None else {}
    for channel, instrument in instruments.items():
        for key, mapped in channels.items():
            whose = log_format == "delimited" or key.startswith(instrument + ".")
            if mapped.channel == channel and whose:
                entry[channel] = (key, mapped)
        if log_format == "nmea" and channel not in entry:
            entry[channel] = (f"{instrument}.{channel}", ChannelMap(channel=channel, unit=_usual(channel)))
    return entry


def _usual(channel: str) -> str:
    """Return the unit that NMEA 0183 writes a channel in; where sentences differ, the commonest."""
    unit = {"rad": "deg", "rad/s": "deg/min", "m/s": "kn"}.get(CHANNELS[channel].unit, CHANNELS[channel].unit)
    return "rpm" if channel == "shaft_speed" else unit


def propose(
    fault: Fault, known: Mapping[str, tuple[str, ChannelMap]], log_format: str
) -> tuple[ProfileCorrection, ...]:
    """Return the entries that correct a fault; none where the profile cannot.

    Parameters
    ----------
    known : mapping of str to (str, ChannelMap)
        From `entries`.
    log_format : {"delimited", "mcap", "nmea"}
    """
    if fault.kind in ("stuck", "leap") or any(channel not in known for channel in fault.channels):
        return ()
    if fault.kind in ("swap", "frame"):
        if log_format == "nmea":
            return ()  # a sentence fixes which channel it carries
        return tuple(
            ProfileCorrection(known[old][0], known[old][1].model_copy(update={"channel": new}))
            for old, new in _exchanged(fault)
        )
    if fault.kind == "axes":
        return tuple(ProfileCorrection(known[c][0], _in_other_axes(fault, c, known[c][1])) for c in fault.channels)
    return tuple(ProfileCorrection(known[c][0], _corrected(fault, c, known[c][1])) for c in fault.channels)


def _in_other_axes(fault: Fault, channel: str, mapped: ChannelMap) -> ChannelMap:
    """Return an entry with east and north exchanged, and up and down."""
    if channel in VELOCITIES["earth"]:
        (other,) = (name for name in VELOCITIES["earth"] if name != channel)
        return mapped.model_copy(update={"channel": other})
    turned = _turned(channel, mapped)
    if channel != "heading":
        return turned
    return turned.model_copy(update={"offset": _offset(channel, turned, fault.value)})


def _exchanged(fault: Fault) -> list[tuple[str, str]]:
    if fault.kind == "swap":
        return [fault.channels[:2], fault.channels[1::-1]]  # type: ignore[list-item]
    other = VELOCITIES["body" if fault.channels == VELOCITIES["earth"] else "earth"]
    return list(zip(fault.channels, other, strict=True))


def _corrected(fault: Fault, channel: str, mapped: ChannelMap) -> ChannelMap:
    if fault.kind == "latency":
        return mapped.model_copy(update={"delay_s": round(mapped.delay_s + fault.value, _DELAY)})
    if fault.kind == "clock_scale":
        return mapped.model_copy(update={"clock_rate": round(mapped.clock_rate * (1.0 + fault.value), _RATE)})
    if fault.kind == "sign":
        return _turned(channel, mapped)
    if fault.kind == "offset":
        turned = _turned(channel, mapped) if fault.name.startswith("counted anticlockwise") else mapped
        return turned.model_copy(update={"offset": _offset(channel, turned, fault.value)})
    return _rescaled(fault, channel, mapped)


def _offset(channel: str, mapped: ChannelMap, added: float) -> float:
    """Return the offset with an angle (SI) added, in the entry's unit; that of a direction within half a turn."""
    factor = TO_SI[mapped.unit][1]
    angle = mapped.offset + added / factor
    if channel in ("heading", "course_over_ground"):
        turn = 2.0 * pi / factor
        angle = (angle + 0.5 * turn) % turn - 0.5 * turn
    return round(angle, _OFFSET if mapped.unit == "deg" else _OFFSET + 3)


def _rescaled(fault: Fault, channel: str, mapped: ChannelMap) -> ChannelMap:
    unit, _, taken_for = fault.name.partition(",")[0].partition(" taken for ")
    if mapped.unit == taken_for:
        entry = mapped.model_copy(update={"unit": unit})
        return _turned(channel, entry) if fault.value < 0.0 else entry
    scale, offset = mapped.scale * fault.value, mapped.offset * fault.value
    return mapped.model_copy(update={"scale": float(f"{scale:.4g}"), "offset": float(f"{offset:.6g}")})


def _turned(channel: str, mapped: ChannelMap) -> ChannelMap:
    # 0 - x, because a minus before nought would show
    offset = 0.0 - mapped.offset
    if channel in _SIDED:
        side = "starboard" if mapped.positive == "port" else "port"
        return mapped.model_copy(update={"positive": side, "offset": offset})
    return mapped.model_copy(update={"scale": -mapped.scale, "offset": offset})


def setting(fault: Fault) -> str:
    """Return what corrects a fault in the entry of its channel, whatever else that says; empty where nothing does.

    Examples
    --------
    >>> setting(Fault("unit", ("yaw_rate",), -1 / 60, "deg/min taken for deg/s, with the wrong sign"))
    'unit: deg/min`, and `positive: port'
    >>> setting(Fault("offset", ("heading",), 0.5, "turned", 0.01))
    'offset: 28.6'
    """
    channel, degrees = fault.channels[0], f"{np.rad2deg(fault.value):.{_OFFSET}f}"
    turned = "positive: port" if channel in _SIDED else "scale: -1"
    if fault.kind == "unit":
        unit = f"unit: {fault.name.partition(' taken for ')[0]}"
        return f"{unit}`, and `{turned}" if fault.value < 0.0 else unit
    if fault.kind == "offset":
        return (
            f"{turned}, offset: {degrees}" if fault.name.startswith("counted anticlockwise") else f"offset: {degrees}"
        )
    if fault.kind in ("swap", "frame"):
        return "channel: " + " and ".join(new for _, new in _exchanged(fault))
    return {
        "sign": turned,
        "scale": f"scale: {fault.value:.4g}",
        "latency": f"delay_s: {fault.value:.{_DELAY}f}",
        "clock_scale": f"clock_rate: {1.0 + fault.value:.{_RATE}f}",
    }.get(fault.kind, "")


def put_into(source: Source | None, corrections: tuple[ProfileCorrection, ...], match: str) -> Source:
    """Return a source with some entries as they should be.

    Parameters
    ----------
    source : Source or None
        As it is; None for an NMEA log that needed none.
    match : str
        File pattern where there is no source yet.
    """
    held = source if source is not None else Source(match=match)
    return held.model_copy(
        update={"channels": {**held.channels, **{correction.key: correction.mapped for correction in corrections}}}
    )
