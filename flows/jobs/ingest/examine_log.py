"""The job of the channel doctor: one log read with a profile, examined, its verdict with the profile lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kempf.flows.jobs.ingest.files import opened_log
from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.flows.jobs.ingest.spool import spooled
from kempf.pipeline.channels.doctor.corrections import entries
from kempf.pipeline.channels.doctor.examine import Examination, examine
from kempf.pipeline.channels.doctor.log import Log
from kempf.pipeline.channels.doctor.refused import by_channel, count
from kempf.pipeline.channels.doctor.verdict import as_json
from kempf.pipeline.channels.instruments import Instruments, from_readings
from kempf.pipeline.channels.there_and_back import counted
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, readings, vessels


@dataclass(frozen=True, eq=False)
class ExaminedLog:
    """One log and what the doctor found."""

    file_name: str
    format: str
    #: The channels as they came.
    log: Log
    examination: Examination
    #: The same as JSON content, with the profile lines and, as ``left_out``, what it did not look at, in words.
    content: dict[str, Any]


def examine_instruments(
    instruments: Instruments,
    profile: VesselProfile,
    file_name: str,
    log_format: str,
    refused: Mapping[tuple[str, str | None], int],
) -> ExaminedLog:
    """Examine the channels of one log; nothing is stored.

    Parameters
    ----------
    profile : VesselProfile
        With which they were read.
    log_format : {"delimited", "mcap", "nmea"}
    refused : mapping of (str, str or None) to int
        Values beyond their physical range, `kempf.pipeline.channels.doctor.refused.count`.
    """
    known = entries(profile.source_for(file_name), log_format, instruments.sources)
    units = {channel: mapped.unit for channel, (_, mapped) in known.items()}
    beyond = by_channel(refused, instruments.sources)
    log = Log.of(instruments, profile.length_m, profile.trial_speed_m_s, units, beyond)
    examination = examine(log)
    left_out = [counted(name, at.size) for name, at in instruments.left_out.items()]
    content = {**as_json(examination, known, log_format), "left_out": left_out}
    return ExaminedLog(file_name, log_format, log, examination, content)


def examine_file(path: Path, profile: VesselProfile) -> ExaminedLog:
    """Read and examine a raw log that no warehouse knows.

    Raises
    ------
    KempfError
        The log cannot be read.
    """
    with opened_log(path) as log, spooled(path.name, log, profile) as read:
        refused = count(read.rejections())
        return examine_instruments(from_readings(read.lazy()), profile, path.name, read.format, refused)


def examine_held(warehouse: Warehouse, name: str) -> ExaminedLog:
    """Examine a log of the warehouse, by a beginning of its id or by its file name.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_log``.
    UsageError
        ``ambiguous_log``.
    """
    row = logs.by_prefix(warehouse, name)
    profile = vessels.get(warehouse, row.profile_sha256)
    channels = channels_of(warehouse, row.ingest_id)
    refused = count([readings.read_rejected(warehouse, row.ingest_id)])
    return examine_instruments(channels, profile, row.file_name, row.format, refused)
