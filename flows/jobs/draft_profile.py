"""The job that drafts a profile for a log that needs one."""

from __future__ import annotations

from pathlib import Path

from kempf.flows.jobs.files import opened_log
from kempf.pipeline.ingest import delimited, draft_profile
from kempf.pipeline.ingest.sniff import sniff
from kempf.pipeline.ingest.unpack import unpack
from kempf.schemas.errors import DataRejected, UsageError


def draft(path: Path) -> str:
    """Return the draft of a profile for a delimited log.

    Raises
    ------
    DataRejected
        ``empty_log``.
    UsageError
        ``no_draft``: the log describes itself, or is no text with columns.
    """
    with opened_log(path) as log:
        data, _ = unpack(path.name, log.whole())
    if not data:
        raise DataRejected("empty_log", f"{path.name} is empty.", "Copy the file again from the logger.")
    found = sniff(data)
    columns = delimited.columns_found(data, None, most=None) if found == "delimited" else []
    if not columns:
        raise UsageError(
            "no_draft",
            f"{path.name} is {found or 'of no known format'}; a profile is drafted from the columns of delimited text.",
            "Ingest it as it is: NMEA and MCAP logs describe themselves; `kempf ingest` says what a profile must add."
            if found
            else "Export the log as delimited text with a line of column names, or as NMEA 0183 or MCAP.",
            {"path": str(path), "format": found},
        )
    return draft_profile.draft_profile(path.name, columns)
