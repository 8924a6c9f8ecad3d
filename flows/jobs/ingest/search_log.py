"""The job that looks through the readings of a log: its manoeuvres, and what the doctor says of its channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from kempf.flows.jobs.ingest.examine_log import examine_instruments
from kempf.flows.jobs.ingest.find_segments import Ingest, find_segments
from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.flows.process.release_memory import give_back
from kempf.flows.process.wrap_error import wrapped
from kempf.pipeline.channels.doctor.refused import count
from kempf.pipeline.channels.instruments import Instruments
from kempf.schemas.correction import Correction
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import corrections, examinations, readings, segments, vessels
from kempf.warehouse.tables.equivalents import code_of
from kempf.warehouse.tables.examinations import StoredExamination
from kempf.warehouse.tables.logs import LogRow
from kempf.warehouse.tables.segments import Segment


@dataclass(frozen=True, eq=False)
class SearchedLog:
    """What was found in the readings of a log; nothing of it is stored yet."""

    segments: tuple[Segment, ...]
    examination: StoredExamination


def search(
    log: Ingest,
    profile: VesselProfile,
    file_name: str,
    log_format: str,
    instruments: Instruments,
    refused: Mapping[tuple[str, str | None], int],
    records: int,
    log_corrections: Sequence[Correction] = (),
) -> SearchedLog:
    """Find the manoeuvres in the channels of a log, and examine the channels.

    Should the doctor fail, that is the verdict, and the manoeuvres count all the same.

    Parameters
    ----------
    profile : VesselProfile
        With which it was read.
    log_format : {"delimited", "mcap", "nmea"}
    refused : mapping of (str, str or None) to int
        Values beyond their physical range, `kempf.pipeline.channels.doctor.refused.count`.
    records : int
        Of the log.
    log_corrections : sequence of Correction, optional
        What a person said of its manoeuvres.
    """
    manoeuvres, notes = find_segments(log, profile, instruments, log_corrections)
    give_back(records)
    try:
        content = examine_instruments(instruments, profile, file_name, log_format, refused).content
    except Exception as error:  # noqa: BLE001 - a log is not lost because its channels could not be compared
        content = {"verdict": "failed", "findings": [], "checks": [], "untested": [], "why": str(wrapped(error))}
    examination = StoredExamination(
        log.vessel,
        log.ingest_id,
        log.log_id,
        corrections.basis(log.code_version, log_corrections),
        content["verdict"],
        tuple(finding["words"] for finding in content["findings"]),
        {**content, "notes": list(notes)},
    )
    return SearchedLog(tuple(manoeuvres), examination)


def search_again(warehouse: Warehouse, row: LogRow, log_corrections: Sequence[Correction]) -> SearchedLog:
    """Look through the stored readings of a log; nothing is stored.

    Parameters
    ----------
    log_corrections : sequence of Correction
        What a person said of its manoeuvres.

    Raises
    ------
    NotFound
        ``no_profile``: the profile that it was read with is lost.
    """
    profile = vessels.get(warehouse, row.profile_sha256)
    log = Ingest(row.vessel, row.log_id, row.ingest_id, row.file_name, code_of(warehouse, "segment"))
    instruments = channels_of(warehouse, row.ingest_id)
    refused = count([readings.read_rejected(warehouse, row.ingest_id)])
    return search(
        log, profile, row.file_name, row.format, instruments, refused, row.tally.records_read, log_corrections
    )


def store(warehouse: Warehouse, searched: Sequence[SearchedLog]) -> None:
    """Put what was found in some logs in place of what is stored of them, in one commit a table."""
    segments.replace(warehouse, {(f.examination.vessel, f.examination.ingest_id): f.segments for f in searched})
    # behind the manoeuvres: from the examination on the log counts as looked through
    examinations.replace(warehouse, [f.examination for f in searched])
