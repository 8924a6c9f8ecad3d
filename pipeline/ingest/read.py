"""The one way in: a log's bytes and its vessel's profile, out come its readings."""

from __future__ import annotations

from dataclasses import replace

from pipeline.ingest import sniff
from pipeline.ingest.decoded import Decoded
from pipeline.ingest.log_file import LogFile
from pipeline.ingest.own_clocks import set_right
from pipeline.ingest.readings import Readings
from pipeline.ingest.screen import screen
from pipeline.ingest.unpack import unpack
from schemas.errors import DataRejected, UsageError
from schemas.profile import Source, VesselProfile

#: Longest log that is read whole, bytes; MCAP is read by the chunk and may be longer.
MOST_TEXT_BYTES = 2 << 30

#: Notes that a refusal repeats, at most.
_NOTES = 3

_TOLD = "See docs/profile.md for how to describe a log."


def read_log(name: str, log: bytes | LogFile, profile: VesselProfile) -> Readings:
    """Read one log.

    Parameters
    ----------
    name : str
        Name of the file without its folder: chooses the profile's source and stands in messages.
    log : bytes or LogFile
        The file as delivered, perhaps compressed with gzip or zstd; an MCAP log is read a few megabytes at a time, any
        other one whole.
    profile : VesselProfile

    Returns
    -------
    Readings
        In canonical channels, SI and UTC, with everything that was refused and why.

    Raises
    ------
    DataRejected
        The file is empty, damaged, of no known format, lacks what the profile maps, or holds no valid reading.
    UsageError
        The profile does not say how the file is to be read.
    """
    file = log if isinstance(log, LogFile) else LogFile(log)
    if file.size == 0:
        raise DataRejected("empty_log", f"{name} is empty.", "Copy the file again from the logger.", {"name": name})
    notes: list[str] = []
    packed = False
    if file.read(0, len(sniff.MCAP_MAGIC)) != sniff.MCAP_MAGIC:
        data = _whole(name, file)
        content, notes = unpack(name, data)
        packed = content is not data
        file = LogFile(content)
    source = profile.source_for(name)
    log_format: str | None = (source.format if source else None) or sniff.sniff(file.read(0, sniff.SAMPLE))
    if log_format is None:
        raise DataRejected(
            "unknown_format",
            f"{name} is neither MCAP, nor NMEA 0183, nor delimited text{' once unpacked' if packed else ''}.",
            "Export the log as one of these; " + _TOLD,
            {"name": name},
        )
    decoded = _decode(log_format, name, file, profile, source)
    readings = set_right(screen(decoded, log_format), source)
    if readings.frame.height == 0:
        raise _nothing(name, readings)
    if notes:
        readings = replace(readings, notes=(*notes, *readings.notes))
    return readings


def _decode(log_format: str, name: str, log: LogFile, profile: VesselProfile, source: Source | None) -> Decoded:
    """Call the reader of the format; each is imported where it is used, `kempf --help` pays for none."""
    if log_format == "nmea":
        from pipeline.ingest.nmea.decode import decode as nmea

        return nmea(_whole(name, log), name, source)
    if log_format == "mcap":
        from pipeline.ingest.mcap.decode import decode as mcap

        return mcap(name, log, source, [s.match for s in profile.sources])
    from pipeline.ingest import delimited

    data = _whole(name, log)
    if source is None or source.time is None or not source.channels:
        found = delimited.columns_found(data, source)
        lacks = "no source" if source is None else "a source without time or channels"
        raise UsageError(
            "no_source_for_log",
            f"{name} is delimited text, for which the profile has {lacks}; "
            f"the columns found in it are {', '.join(repr(c) for c in found) or 'none'}.",
            "Add a source to the profile with the time column and the channels. " + _TOLD,
            {"name": name, "columns": found, "patterns": [s.match for s in profile.sources]},
        )
    return delimited.decode(name, data, source)


def _whole(name: str, log: LogFile) -> bytes:
    if log.size > MOST_TEXT_BYTES:
        raise DataRejected(
            "file_too_large",
            f"{name} has {log.size} bytes; text, or a packed log, of more than {MOST_TEXT_BYTES} is not read.",
            "Split the log into shorter ones, a day each for example.",
            {"name": name, "bytes": log.size},
        )
    return log.whole()


def _nothing(name: str, readings: Readings) -> DataRejected:
    counts = readings.tally.by_reason
    listed = ", ".join(f"{count} {reason}" for reason, count in sorted(counts.items(), key=lambda c: (-c[1], c[0])))
    years = ""
    if "clock_unset" in counts:
        unset = readings.rejected.filter(readings.rejected["reason"] == "clock_unset")["time_utc_ns"].to_list()
        if unset:
            first, last = _year(min(unset)), _year(max(unset))
            years = f" Its times lie in {first}." if first == last else f" Its times lie between {first} and {last}."
    step = {
        "clock_unset": "The logger's clock was not set: correct the times in a copy of the log, or ingest another log.",
        "no_time": "No sentence tells the time: log RMC or ZDA too, or let the logger stamp the lines.",
        "checksum": "The lines are damaged, or their checksums were cut off: export the log again.",
        "no_channel": "The log holds none of the canonical channels: check that it is the right file.",
    }
    most = max(sorted(counts), key=lambda reason: counts[reason]) if counts else ""
    return DataRejected(
        "no_valid_reading",
        f"{name} holds no valid reading: {readings.tally.records_read} records, "
        f"of them {listed or 'none usable'}.{years}{''.join(f' {note}' for note in readings.notes[:_NOTES])}",
        step.get(most, "Look at the reasons; most often the profile does not fit the log."),
        {
            "name": name,
            "records_read": readings.tally.records_read,
            "by_reason": counts,
            "notes": list(readings.notes),
        },
    )


def _year(time_utc_ns: int) -> int:
    """Return the calendar year of an instant (Gregorian, mean year length is enough for a message)."""
    return 1970 + int(time_utc_ns // 31_556_952_000_000_000)
