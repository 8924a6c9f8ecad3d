"""NMEA 0183 logs, with or without times in front of the lines, decoded in columns."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from kempf.pipeline.ingest.bursts import unsure_s
from kempf.pipeline.ingest.decoded import CODE, NO_TIME, Code, Decoded, Flag, Nanoseconds, Reason, Values
from kempf.pipeline.ingest.nmea.clock import clock_of
from kempf.pipeline.ingest.nmea.compass_and_rudder import both_rudders, make_true
from kempf.pipeline.ingest.nmea.fields import Said, read_type
from kempf.pipeline.ingest.nmea.frames import Frames, frames_of
from kempf.pipeline.ingest.nmea.unsummed import NAMED, unsummed_notes
from kempf.pipeline.ingest.spans import Bytes, Index, as_bytes
from kempf.schemas.enumeration import first_of
from kempf.schemas.nmea import SENTENCES

#: Channel -> address of the sentence -> factor on the value in SI, and offset in SI.
Corrections = Mapping[str, Mapping[str, tuple[float, float]]]
_NONE: Corrections = {}


def decode(data: bytes, corrections: Corrections = _NONE, variation_deg: float | None = None) -> Decoded:
    """Decode an NMEA 0183 log.

    A record is a line that is not blank. RMC, ZDA, GGA and GLL have their own time; any other sentence has that of its
    stamp, on the receiver's UTC (`kempf.pipeline.ingest.nmea.logger_clock`), or in a log without stamps the time of the
    latest of those four of one receiver before it (`kempf.pipeline.ingest.nmea.receiver`) - of the next one behind it,
    where VTG shows that the receiver sends its fix last. What comes several times between two fixes is spread evenly
    over the time between them.

    Parameters
    ----------
    data : bytes
        The whole file, decompressed.
    corrections : mapping, optional
        What the profile gives another unit, sign or offset, see `kempf.pipeline.ingest.mapping.nmea_corrections`.
    variation_deg : float, optional
        Of the magnetic headings, deg, east positive, where no sentence gives it.
    """
    frames = frames_of(as_bytes(data))
    n = len(frames.lines)
    reason = frames.reason.copy()
    kind = _kinds(frames)
    said: dict[str, Said] = {}
    read = np.flatnonzero((kind >= 0) & (reason == 0))
    # numbers of one byte are sorted by counting them
    read = read[np.argsort(kind[read].astype(np.int8), kind="stable")]
    bounds = np.searchsorted(kind[read], np.arange(len(SENTENCES) + 1))
    for letters, (first, last) in zip(SENTENCES, pairwise(bounds.tolist()), strict=True):
        if last > first:
            said[letters] = read_type(frames, read[first:last], letters)
    reason[(kind < 0) & (reason == 0)] = CODE[Reason.NO_CHANNEL]
    notes = [*both_rudders(frames, said), *make_true(frames, said, variation_deg)]
    channels: dict[str, Values] = {}
    for sentences in said.values():
        reason[sentences.record] = sentences.reason
        for channel, (read_value, there) in sentences.values.items():
            value = read_value
            put = there & (sentences.reason == 0)
            for address, (factor, offset) in corrections.get(channel, {}).items():
                if address in frames.names:
                    at_address = frames.address[sentences.record] == frames.names.index(address)
                    value = np.where(at_address, value * factor + offset, value)
            channels.setdefault(channel, Values.empty(n)).put(sentences.record[put], value[put])
    clock = clock_of(frames, said)
    unread = (frames.reason == CODE[Reason.CHECKSUM]) | (frames.reason == CODE[Reason.MALFORMED])
    time = np.where(unread, NO_TIME, clock.time_utc_ns)
    notes = [*clock.notes, *notes, *_notes(frames, kind, reason)]
    lines = np.arange(time.size, dtype=np.int64)
    return Decoded(
        *(lines, frames.lines, frames.body, time, frames.address, frames.names, reason, channels, notes),
        instant_std_s=_instant_std_s(frames, clock.share_ns, (reason == 0) & (time != NO_TIME)),
    )


def _instant_std_s(frames: Frames, share_ns: Nanoseconds, read: Flag) -> dict[str, float]:
    """Return the standard errors of the instants of sentences by address, s, where they are not known."""
    if not share_ns.any():
        return {}
    address, share_ns = frames.address[read], share_ns[read]
    found = {name: unsure_s(share_ns[address == code]) for code, name in enumerate(frames.names)}
    return {name: std_s for name, std_s in found.items() if std_s > 0.0}


def _kinds(frames: Frames) -> Index:
    """Return the place of each line's sentence type in `SENTENCES`; -1 for one without a channel."""
    place = {name: code for code, name in enumerate(SENTENCES)}
    # an address that begins with P is a maker's own, whatever its last letters are
    of_name = [place.get(a[2:], -1) if len(a) == 5 and not a.startswith("P") else -1 for a in frames.names]
    kind = np.array([*of_name, -1], dtype=np.int64)[frames.address]
    # "!" opens encapsulated sentences (AIS): their letters mean something else
    return np.where(_opening(frames) == ord("$"), kind, -1)


def _opening(frames: Frames) -> Bytes:
    """Return the byte that opens each sentence."""
    if len(frames.lines) == 0:
        return np.empty(0, dtype=np.uint8)
    return frames.lines.buffer[np.maximum(frames.body.start - 1, 0)]


def _notes(frames: Frames, kind: Index, reason: Code) -> list[str]:
    notes = []
    if frames.unread_front is not None:
        notes.append(
            f"Text in front of the sentences, such as {frames.unread_front!r}, is not read as a time: an ISO 8601 "
            "stamp such as 2025-05-03T07:47:01.147Z is, and the seconds or milliseconds since 1970 are."
        )
    notes += unsummed_notes(frames, kind >= 0)
    if not frames.zoned:
        notes.append("Stamps without a zone are taken as UTC.")
    if frames.broken_tags:
        notes.append(f"{frames.broken_tags} TAG blocks have a wrong checksum or no end: what they say was left out.")
    without = (frames.address >= 0) & (kind < 0) & (reason == CODE[Reason.NO_CHANNEL])
    if without.any():
        count = np.bincount(frames.address[without], minlength=len(frames.names))
        used = sorted(frames.names[code] for code in np.flatnonzero(count))
        own = int(sum(count[code] for code, name in enumerate(frames.names) if name.startswith("P")))
        encapsulated = int(np.sum(without & (_opening(frames) == ord("!"))))
        kinds = [f"{n} {label}" for n, label in ((own, "proprietary"), (encapsulated, "AIS or encapsulated")) if n]
        behind = f"; of them {', '.join(kinds)}" if kinds else ""
        notes.append(f"Sentences without a channel: {first_of(used, NAMED)}{behind}.")
    return notes
