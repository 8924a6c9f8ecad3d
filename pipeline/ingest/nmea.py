"""NMEA 0183 logs, with or without ISO 8601 stamps in front of the lines, decoded in columns."""

from __future__ import annotations

import numpy as np

from pipeline.ingest.decoded import CODE, NO_TIME, Code, Decoded, Values
from pipeline.ingest.nmea_clock import Clock, clock_of
from pipeline.ingest.nmea_fields import Said, read_type
from pipeline.ingest.nmea_frames import Frames, frames_of
from pipeline.ingest.readings import Reason
from pipeline.ingest.spans import Bytes, Spans, as_bytes
from schemas.channels import CHANNELS
from schemas.errors import UsageError
from schemas.nmea import SENTENCES, SPECIAL, XDR_ANGLES
from schemas.profile import Source
from schemas.units import factor_to_si

#: A logger's clock that leads or lags the receiver's by more than this is worth a note, s.
_LEAD_S = 1.0

#: Every byte as it is split into fields: ``?`` for what is not printable.
_PRINTABLE = bytes(byte if 32 <= byte <= 126 else ord("?") for byte in range(256))


def decode(data: bytes, name: str = "log", source: Source | None = None) -> Decoded:
    """Decode an NMEA 0183 log.

    A record is a line that is not blank. RMC, ZDA, GGA and GLL tell their own time; any other sentence has that of its
    stamp, or in a log without stamps the time of the latest of those four before it - of the next one behind
    it, where VTG shows that the receiver sends its fix last.

    Parameters
    ----------
    data : bytes
        The whole file, decompressed.
    name : str
        Name of the file, for messages.
    source : Source, optional
        What the profile says of the log: a key such as ``AGRSA.rudder_angle`` gives that sentence's value another unit,
        sign or offset.

    Returns
    -------
    Decoded

    Raises
    ------
    UsageError
        A key of the source is not of that form, or maps to another channel.
    """
    frames = frames_of(as_bytes(data))
    mended = _mended(name, source, frames)
    n = len(frames.lines)
    separated = Spans(_separated(frames), frames.body.start, frames.body.stop)
    reason = frames.reason.copy()
    channels: dict[str, Values] = {}
    said: dict[str, Said] = {}
    kind = _kinds(frames)
    for code, letters in enumerate(SENTENCES):
        record = np.flatnonzero((kind == code) & (reason == 0))
        if record.size:
            said[letters] = read_type(frames, separated, record, letters)
    reason[(kind < 0) & (reason == 0)] = CODE[Reason.NO_CHANNEL]
    for what in said.values():
        reason[what.record] = what.reason
        for channel, (read, there) in what.values.items():
            value = read
            put = there & (what.reason == 0)
            for code, (factor, offset) in mended.get(channel, {}).items():
                mine = frames.address[what.record] == code
                value = np.where(mine, value * factor + offset, value)
            channels.setdefault(channel, Values.empty(n)).put(what.record[put], value[put])
    clock = clock_of(frames, said)
    time = np.where(np.isin(frames.reason, (CODE[Reason.CHECKSUM], CODE[Reason.MALFORMED])), NO_TIME, clock.time_utc_ns)
    notes = _notes(frames, clock, kind, reason)
    return Decoded(frames.lines, frames.body, time, frames.address, frames.names, reason, channels, notes)


def _mended(name: str, source: Source | None, frames: Frames) -> dict[str, dict[int, tuple[float, float]]]:
    """Return what the profile corrects: channel -> address -> factor on the value in SI and offset in SI."""
    mended: dict[str, dict[int, tuple[float, float]]] = {}
    if source is None or source.time is not None:
        # a source with a time column describes delimited text that happens to share the pattern
        return mended
    for key, mapped in source.channels.items():
        address, _, channel = key.partition(".")
        units = {f.channel: f.unit for f in SENTENCES[address[2:]].fields} if address[2:] in SENTENCES else {}
        if address[2:] in SPECIAL:
            units = {"heading": "deg"} if address[2:] == "HDG" else dict.fromkeys(XDR_ANGLES.values(), "deg")
        if channel not in units or mapped.channel != channel:
            raise UsageError(
                "nmea_key_unknown",
                f"{name} is an NMEA log, whose sentences fix channel and unit; the profile's key {key!r} for "
                f"{mapped.channel} fits none of them.",
                "Leave the channels of the source out, or write '<talker and sentence>.<channel>' such as "
                "'AGRSA.rudder_angle', with that same channel, to correct its sign, unit or offset.",
                {"name": name, "key": key},
            )
        if address in frames.names:
            factor = mapped.factor / factor_to_si(units[channel], CHANNELS[channel].unit, key)
            mended.setdefault(channel, {})[frames.names.index(address)] = (factor, mapped.offset_si)
    return mended


def _kinds(frames: Frames) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return the place of each line's sentence type in `SENTENCES`; -1 for one without a channel."""
    place = {name: code for code, name in enumerate(SENTENCES)}
    # an address that begins with P is a maker's own, whatever its last letters are
    of_name = [place.get(a[2:], -1) if len(a) == 5 and not a.startswith("P") else -1 for a in frames.names]
    kind = np.array([*of_name, -1], dtype=np.int64)[frames.address]
    # "!" opens encapsulated sentences (AIS): their letters mean something else
    opening = frames.lines.buffer[np.maximum(frames.body.start - 1, 0)] if len(frames.lines) else kind
    return np.where(opening == ord("$"), kind, -1)


def _separated(frames: Frames) -> Bytes:
    """Copy the buffer with a line feed behind each sentence and ``?`` for every byte that is not printable."""
    text = bytearray(frames.lines.buffer.size + 1)
    text[:-1] = frames.lines.buffer.tobytes().translate(_PRINTABLE)
    copy = np.frombuffer(text, dtype=np.uint8)
    copy[frames.body.stop] = 10
    return copy


def _notes(frames: Frames, clock: Clock, kind: np.ndarray[tuple[int], np.dtype[np.int64]], reason: Code) -> list[str]:
    notes = []
    if clock.follows:
        notes.append("VTG repeats the fix behind it: sentences without a time are given that of the next fix.")
    if abs(clock.stamp_lead_s) > _LEAD_S:
        ahead = "ahead of" if clock.stamp_lead_s > 0 else "behind"
        notes.append(f"The logger's stamps are {abs(clock.stamp_lead_s):.3f} s {ahead} the receiver's UTC (median).")
    if not frames.zoned:
        notes.append("Stamps without a zone are taken as UTC.")
    if bool(np.any((frames.address >= 0) & (kind < 0) & (reason == CODE[Reason.NO_CHANNEL]))):
        used = {int(code) for code in frames.address[(reason == CODE[Reason.NO_CHANNEL])] if code >= 0}
        names = sorted({frames.names[code] for code in used})
        shown = ", ".join(names[:12]) + (" ..." if len(names) > 12 else "")
        notes.append(f"Sentences without a channel: {shown}.")
    return notes
