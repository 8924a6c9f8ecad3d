"""The one way in: a log's bytes and its vessel's profile, out come its readings, part by part."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import polars as pl

from kempf.pipeline.ingest import sniff
from kempf.pipeline.ingest.clock_corrections import OwnClocks
from kempf.pipeline.ingest.decoded import Decoded, MalformedRows
from kempf.pipeline.ingest.encoding import advice_on, as_utf8, utf16_of
from kempf.pipeline.ingest.foreign_files import foreign_file
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.readings import Readings, Tally
from kempf.pipeline.ingest.screen import Screen
from kempf.pipeline.ingest.unpack import unpack
from kempf.pipeline.ingest.unset_clock import dated_parts
from kempf.schemas.channels import CHANNELS
from kempf.schemas.errors import DataRejected, UsageError
from kempf.schemas.profile import Source, VesselProfile

#: Longest log that is read whole, bytes; MCAP is read by the chunk and may be longer.
MOST_TEXT_BYTES = 2 << 30

#: Notes that a refusal repeats, at most.
_NOTES = 3
#: Reasons of which a sound log may have many, and share of refused records from which a note says so.
_ORDINARY, _MANY = ("no_channel", "duplicate", "void"), 0.1
#: What else to look for where many records are refused for a reason.
_LOOK_FOR = {
    "clock_back": " Do its records run backwards in time, or stand in another order than that of their times?",
    "same_instant": " Records of one source share an instant and differ: the times are coarser than the readings.",
}
#: What to do about times that are coarser than the readings, by format; a sentence of NMEA has no other time.
_FINER_TIMES = {
    "delimited": " Where the log has a column of finer ones, name it as the column of `time`.",
    "mcap": " Where the log has finer ones, such as the `publish_time` or a field of MCAP messages, name them as the "
    "column of `time`.",
}
#: Characters of a record that it shows.
_CUT = 160

_SEE_PROFILE = "See docs/profile.md for how to describe a log."


def read_parts(name: str, log: bytes | LogFile, profile: VesselProfile) -> Iterator[Readings]:
    """Read one log, some ten thousand messages at a time where the format allows it (MCAP), else in one part.

    Parameters
    ----------
    name : str
        Name of the file without its folder: chooses the profile's source and stands in messages.
    log : bytes or LogFile
        The file as delivered, perhaps compressed with gzip or zstd; an MCAP log is read a few megabytes at a time, any
        other one whole.

    Yields
    ------
    Readings
        In the order of the log, but that of each source some records may come with the part behind their own; notes and
        what is lost with the last part.

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
    source = profile.source_for(name)
    if file.read(0, len(sniff.MCAP_MAGIC)) != sniff.MCAP_MAGIC:
        data = _whole(name, file)
        content, notes = unpack(name, data)
        packed = content is not data
        wide = utf16_of(content[: sniff.SAMPLE])
        if wide is not None:
            content = as_utf8(content, wide)
            notes = [*notes, "The file is encoded as UTF-16, and was read so."]
            source = source and source.model_copy(update={"encoding": "utf-8"})
        file = LogFile(content)
    log_format: str | None = (source.format if source else None) or sniff.sniff(file.read(0, sniff.SAMPLE))
    foreign = foreign_file(file.read(0, sniff.SAMPLE))
    if foreign is not None:
        raise DataRejected(
            "unknown_format",
            f"{name} is {foreign.description}, which is no log; expected MCAP, NMEA 0183 or delimited text.",
            f"{foreign.next_step} {_SEE_PROFILE}",
            {"name": name},
        )
    if log_format is None:
        raise DataRejected(
            "unknown_format",
            f"{name} is neither MCAP, nor NMEA 0183, nor delimited text{' once unpacked' if packed else ''}.",
            "Export the log as one of these. " + _SEE_PROFILE,
            {"name": name},
        )
    if log_format == "mcap" and source and source.time and (source.time.date or source.time.interval_s):
        raise UsageError(
            "time_not_of_this_format",
            f"{name} is an MCAP file; the source for it has date and time, or interval_s, which are of delimited text.",
            "Name log_time, publish_time or a field of the messages as the column of 'time', or leave 'time' out.",
            {"name": name},
        )

    def decoding() -> Iterator[Decoded]:
        return _decode(log_format, name, file, profile, source)

    dated = dated_parts(decoding, source.time if source else None)
    screen, clocks, summary = Screen(log_format, dated.first_ns), OwnClocks(source), _Summary(log_format)
    for decoded in dated.parts:
        checked = screen.part(decoded)
        summary.add(checked)
        if not decoded.ends:
            yield clocks.set_right(checked)
            continue
        if summary.tally.records_kept == 0:
            raise _nothing(name, checked, summary, decoded)
        own = (*summary.notes(decoded.malformed), *notes, *dated.notes, *checked.notes, *clocks.notes())
        yield replace(clocks.set_right(checked), notes=own)


class _Summary:
    """What all parts of a log together say, for the message where it is nothing."""

    def __init__(self, log_format: str) -> None:
        self.tally = Tally()
        self.unset: tuple[int, int] | None = None
        self._format = log_format
        #: Records that are refused, by reason; values of other records that are, by channel and reason.
        self._records: Counter[str] = Counter()
        self._values: Counter[tuple[str, str]] = Counter()
        #: Values that are kept, by channel.
        self._kept: Counter[str] = Counter()

    def add(self, part: Readings) -> None:
        """Take note of one part."""
        self.tally += part.tally
        for channel, reason, n in part.rejected.group_by("channel", "reason").len().iter_rows():
            if channel is None:
                self._records[reason] += n
            else:
                self._values[channel, reason] += n
        for known in CHANNELS.values():
            self._kept[known.name] += part.frame[known.column].count()
        if "clock_unset" in part.tally.by_reason:
            unset = part.rejected.filter(pl.col("reason") == "clock_unset")["time_utc_ns"].to_list()
            times = [*(self.unset or ()), *unset]
            self.unset = min(times), max(times)

    def notes(self, malformed: tuple[MalformedRows, ...]) -> list[str]:
        """Return what a log is to be doubted for of which much was refused, other than for what it is no log of."""
        doubts = [f"{cause.found} {cause.next_step}" for cause in malformed]
        doubts += self._mostly_refused()
        refused = {reason: n for reason, n in self._records.items() if reason not in _ORDINARY}
        most = max(sorted(refused), key=lambda reason: refused[reason], default="")
        share = refused[most] / self.tally.records_read if most else 0.0
        if share <= _MANY or (most == "malformed" and malformed):
            return doubts
        finer = _FINER_TIMES.get(self._format, "") if most == "same_instant" else ""
        much = "most" if share > 0.5 else f"{100.0 * share:.0f} %"
        return [
            f"{refused[most]} of {self.tally.records_read} records, {much} of the log, are refused as {most}: see "
            f"whether the profile fits it, and `kempf logs rejected`.{_LOOK_FOR.get(most, '')}{finer}",
            *doubts,
        ]

    def _mostly_refused(self) -> list[str]:
        """Return which channels lost most of their values for one reason, in records of which others are kept."""
        offered = Counter(self._kept)
        for (channel, _), n in self._values.items():
            offered[channel] += n
        return [
            f"Of {offered[channel]} values of {channel} in records of which something is kept, "
            f"{'all' if n == offered[channel] else n} are refused as {reason}: see whether the profile has the right "
            "column and unit for it, whether its instrument was off, and `kempf logs rejected`."
            for (channel, reason), n in sorted(self._values.items())
            if n > 0.5 * offered[channel]
        ]


def _decode(
    log_format: str, name: str, log: LogFile, profile: VesselProfile, source: Source | None
) -> Iterator[Decoded]:
    """Call the reader of the format; each is imported where it is used, `kempf --help` pays for none."""
    if log_format == "nmea":
        from kempf.pipeline.ingest.mapping import nmea_corrections
        from kempf.pipeline.ingest.nmea.decode import decode as nmea

        yield nmea(_whole(name, log), nmea_corrections(name, source), profile.variation_deg)
    elif log_format == "mcap":
        from kempf.pipeline.ingest.mcap.decode import decode as mcap

        yield from mcap(name, log, source, [s.match for s in profile.sources])
    else:
        yield _delimited(name, log, profile, source)


def _delimited(name: str, log: LogFile, profile: VesselProfile, source: Source | None) -> Decoded:
    from kempf.pipeline.ingest import delimited

    data = _whole(name, log)
    if source is None or source.time is None or not source.channels:
        if source is None and sniff.is_json(data):
            raise DataRejected(
                "unknown_format",
                f"{name} is JSON text, which is no log; expected MCAP, NMEA 0183 or delimited text.",
                "Give the log that the logger wrote, or export it as one of these. " + _SEE_PROFILE,
                {"name": name},
            )
        columns = delimited.columns_found(data, source)
        lacks = "no source" if source is None else "a source without time or channels"
        raise UsageError(
            "no_source_for_log",
            f"{name} is delimited text, for which the profile has {lacks}; "
            f"the columns found in it are {', '.join(repr(c) for c in columns) or 'none'}.",
            f"{advice_on(columns, source.encoding if source else 'utf-8')}"
            f"`kempf profile draft {name}` writes a profile to complete: the time column and the channels. "
            + _SEE_PROFILE,
            {"name": name, "columns": columns, "patterns": [s.match for s in profile.sources]},
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


def _nothing(name: str, last: Readings, summary: _Summary, decoded: Decoded) -> DataRejected:
    """Return the error of a log that holds nothing; ``last`` and ``decoded`` are its last part, checked and before."""
    malformed = decoded.malformed
    counts = summary.tally.by_reason
    listed = ", ".join(f"{count} {reason}" for reason, count in sorted(counts.items(), key=lambda c: (-c[1], c[0])))
    years = ""
    if summary.unset:
        since, until = map(_year, summary.unset)
        years = f" Its times lie in {since}." if since == until else f" Its times lie between {since} and {until}."
    step = {
        "clock_unset": "The logger's clock was not set, or the unit of the time column is another: correct the unit in "
        "the profile or the times in a copy of the log, or ingest another log.",
        "malformed": malformed[0].next_step
        if malformed
        else "See whether the profile says how time and columns are written. " + _SEE_PROFILE,
        "no_time": "No sentence gives the time: log RMC or ZDA too, or let the logger stamp the lines.",
        "checksum": "The lines are damaged, or their checksums were cut off: export the log again.",
        "no_channel": decoded.next_step
        or "The log holds none of the canonical channels: check that it is the right file.",
    }
    most = max(sorted(counts), key=lambda reason: counts[reason]) if counts else ""
    return DataRejected(
        "no_valid_reading",
        f"{name} holds no valid reading: {summary.tally.records_read} records, "
        f"of them {listed or 'none usable'}.{years}{_sample(last, most)}"
        f"{''.join(f' {note}' for note in (*(cause.found for cause in malformed), *last.notes)[:_NOTES])}",
        step.get(most, "Look at the reasons; most often the profile does not fit the log."),
        {
            "name": name,
            "records_read": summary.tally.records_read,
            "by_reason": counts,
            "notes": list(last.notes),
        },
    )


def _sample(last: Readings, reason: str) -> str:
    """Return the first record that was refused for a reason, cut."""
    raw = last.rejected.filter(pl.col("reason") == reason)["raw"].drop_nulls() if last.rejected.height else None
    if raw is None or not len(raw):
        return ""
    text = str(raw[0])
    return f" The first that is {reason}: {text[:_CUT] + ('...' if len(text) > _CUT else '')!r}."


def _year(time_utc_ns: int) -> int:
    """Return the calendar year of an instant (Gregorian, mean year length is enough for a message)."""
    return 1970 + int(time_utc_ns // 31_556_952_000_000_000)
