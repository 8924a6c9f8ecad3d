"""The job that drafts a profile for a log that needs one."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

from kempf.flows.jobs.ingest.files import opened_log
from kempf.pipeline.ingest import delimited, draft_profile
from kempf.pipeline.ingest.encoding import advice_on, as_utf8, utf16_of
from kempf.pipeline.ingest.foreign_files import foreign_file
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.topics.fields import fields_of, obstacles
from kempf.pipeline.ingest.sniff import MCAP_MAGIC, SAMPLE, is_json, sniff
from kempf.pipeline.ingest.unpack import unpack
from kempf.schemas.errors import DataRejected, UsageError


def draft(path: Path) -> str:
    """Return the draft of a profile for a delimited log or an MCAP one.

    Raises
    ------
    DataRejected
        ``empty_log``.
    UsageError
        ``no_draft``: the log describes itself, or holds neither columns nor topics with numbers.
    """
    with opened_log(path) as log:
        if log.read(0, len(MCAP_MAGIC)) == MCAP_MAGIC:
            return _of_topics(path, log)
        data, _ = unpack(path.name, log.whole())
    if not data:
        raise DataRejected("empty_log", f"{path.name} is empty.", "Copy the file again from the logger.")
    wide = utf16_of(data[:SAMPLE])
    data = as_utf8(data, wide) if wide else data
    if (foreign := foreign_file(data)) is not None:
        raise _no_draft(path, f"{foreign.description}, which is no log", foreign.next_step, None)
    log_format = sniff(data)
    if log_format == "mcap":
        return _of_topics(path, LogFile(data))
    if log_format == "nmea":
        raise _no_draft(path, "an NMEA 0183 log", "Ingest it as it is: NMEA logs describe themselves.", log_format)
    columns = delimited.columns_found(data, None, most=None) if log_format and not is_json(data) else []
    if not columns:
        description = "of no known format" if log_format is None else "text without columns"
        next_step = "Export the log as delimited text with a line of column names, or as NMEA 0183 or MCAP."
        raise _no_draft(path, "JSON text" if is_json(data) else description, next_step, log_format)
    encoding = "latin-1" if advice_on(columns, "utf-8") else None
    if encoding:
        data = as_utf8(data, encoding)
        columns = delimited.columns_found(data, None, most=None)
    return draft_profile.draft_profile(path.name, columns, delimited.titled(data), encoding)


def _of_topics(path: Path, log: LogFile) -> str:
    topics = fields_of(path.name, log)
    if not any(topics.values()):
        listed = ", ".join(topics) or "none"
        next_step = f"Look which of its topics carries the measurements; they are {listed}."
        for reason, step in islice(obstacles(path.name, log).items(), 1):
            next_step = f"{reason} {step or next_step}"
        raise _no_draft(path, "an MCAP log of which no topic holds a number that can be read", next_step, "mcap")
    return draft_profile.draft_topics(path.name, topics)


def _no_draft(path: Path, description: str, next_step: str, log_format: str | None) -> UsageError:
    rule = "a profile is drafted from the columns of delimited text or the topics of MCAP"
    return UsageError(
        "no_draft", f"{path.name} is {description}; {rule}.", next_step, {"path": str(path), "format": log_format}
    )
