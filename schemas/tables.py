"""Every table of the warehouse: its columns, units and plain words, and the Arrow schema made of them.

The unit stands in the metadata of each Parquet field, so that a file read without this project still says what it
holds. Times are UTC nanoseconds as integers, because the timestamps of Delta Lake have only microseconds. A vessel's
name never becomes a path: tables are partitioned by ``vessel_key``, made of its letters and a hash.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from kempf.schemas.channels import CHANNELS

if TYPE_CHECKING:
    import pyarrow as pa

Kind = Literal["text", "texts", "integer", "integers", "real", "reals", "matrix", "estimates", "counts"]


@dataclass(frozen=True)
class Column:
    """One column: name, kind of content, what it means, unit ("" where it has none)."""

    name: str
    kind: Kind
    words: str
    unit: str = ""


@dataclass(frozen=True)
class Table:
    """One table: name, what one row is, columns in order, and the columns it is partitioned by."""

    name: str
    words: str
    columns: tuple[Column, ...]
    partition_by: tuple[str, ...] = ()


_VESSEL = (
    Column("vessel_key", "text", "letters and digits of the vessel's name and 8 hex digits of its SHA-256; partition"),
    Column("vessel", "text", "name of the vessel"),
)
_INGEST = Column("ingest_id", "text", "one log read with one profile by one version of the code")
_MONTH = Column("month", "text", "UTC month of the log's first reading, such as 2025-05; partition")
_LOG = Column("log_id", "text", "SHA-256 of the log as delivered")
_CODE = Column("code_version", "text", "hash of the source of the stage that made the row")
_START = Column("start_utc_ns", "integer", "first instant", "ns")
_END = Column("end_utc_ns", "integer", "last instant", "ns")
_PROFILE = Column("profile_sha256", "text", "hash of the vessel profile")
_SET = Column("parameter_set_id", "text", "hash of what produced the parameter set")

_TALLY = tuple(
    Column(f"{noun}_{outcome}", "integer", f"{noun} {outcome}", "1")
    for noun in ("records", "values")
    for outcome in ("read", "kept", "rejected")
)

_ALL = (
    Table(
        "vessels",
        "one version of a vessel's profile; the highest revision is the current one",
        (
            *_VESSEL,
            Column("revision", "integer", "1 for the first profile of the vessel, then 2, 3, ..."),
            _PROFILE,
            Column("profile_json", "text", "the profile as sorted JSON"),
            Column("removed", "text", "why she counts no longer, from this revision on; null where she counts"),
        ),
    ),
    Table(
        "logs",
        "one ingest of a log; the highest revision of a log is the current one",
        (
            _LOG,
            Column("revision", "integer", "1 for the first ingest of the log, then 2, 3, ..."),
            _INGEST,
            *_VESSEL,
            Column("file_name", "text", "name of the file as delivered, without its folder"),
            Column("format", "text", "how the log was read: nmea, delimited, mcap"),
            Column("size_bytes", "integer", "size as delivered", "B"),
            _PROFILE,
            _CODE,
            _START,
            _END,
            *_TALLY,
            Column("rejected_by_reason", "counts", "rejected records and values by reason", "1"),
            Column("notes", "texts", "how the file was read, a sentence each"),
            Column("removed", "text", "why the log counts no longer, from this revision on; null where it counts"),
        ),
    ),
    Table(
        "readings",
        "one record of a log at its native rate; a channel is null where the record does not carry it",
        (
            *_VESSEL,
            _INGEST,
            _MONTH,
            Column("record", "integer", "number of the line, row or message in the log"),
            Column("time_utc_ns", "integer", "instant of measurement", "ns"),
            Column(
                "instant_std_s",
                "real",
                "standard error of that instant beside those of the other instruments, null where the log shows it",
                "s",
            ),
            Column("source", "text", "instrument: sentence, topic or row"),
            *(Column(channel.column, "real", channel.words, channel.unit) for channel in CHANNELS.values()),
        ),
        partition_by=("vessel_key", "month"),
    ),
    Table(
        "rejected",
        "one refused record, or one refused value of a kept record, with its reason",
        (
            *_VESSEL,
            _INGEST,
            _MONTH,
            Column("record", "integer", "number of the line, row or message in the log"),
            Column("time_utc_ns", "integer", "instant of measurement, null where unknown", "ns"),
            Column("source", "text", "instrument: sentence, topic or row"),
            Column("channel", "text", "refused channel; null where the whole record is refused"),
            Column("reason", "text", "why it is refused"),
            Column("raw", "text", "the line, row or message as it came"),
        ),
        partition_by=("vessel_key", "month"),
    ),
    Table(
        "lost",
        "one stretch of a damaged log that could not be read",
        (
            *_VESSEL,
            _INGEST,
            Column("number", "integer", "place among the stretches of the log, in the order of the file"),
            Column("since_utc_ns", "integer", "by the logger's clock, null where unknown", "ns"),
            Column("until_utc_ns", "integer", "by the logger's clock, null where unknown", "ns"),
            Column("messages", "integer", "how many records are lost, null where unknown", "1"),
            Column("why", "text", "what is damaged"),
        ),
    ),
    Table(
        "examinations",
        "what the channel doctor found in one ingest",
        (
            *_VESSEL,
            _INGEST,
            _LOG,
            Column("verdict", "text", "clean, faults, untested; failed where the doctor himself did"),
            Column("findings", "texts", "what is wrong, a sentence each"),
            Column("content_json", "text", "findings with evidence and profile lines, every check with its figures"),
            _CODE,
        ),
        partition_by=("vessel_key",),
    ),
    Table(
        "segments",
        "one manoeuvre found in one ingest",
        (
            *_VESSEL,
            _INGEST,
            Column("segment_id", "text", "hash of the log and the bounds"),
            _LOG,
            Column("kind", "text", "zigzag, zigzag_broken_off, random_manoeuvre, turning_circle, pull_out, spiral"),
            Column(
                "psi0_deg", "real", "nominal heading deviation at which the rudder is reversed; NaN: no zigzag", "deg"
            ),
            Column("delta0_deg", "real", "nominal rudder angle", "deg"),
            Column("first_side", "text", "side of the first execute: starboard or port"),
            Column("base_heading_deg", "real", "heading before the first execute", "deg"),
            _START,
            _END,
            Column("executes_utc_ns", "integers", "instants at which the rudder is ordered over", "ns"),
            Column("overshoots_deg", "reals", "overshoot angles beyond the nominal heading deviation", "deg"),
            Column("imo_json", "text", "criteria of IMO MSC.137(76): value, limit, passed"),
            Column("quality_json", "text", "how well the manoeuvre was carried out"),
            Column("detail_json", "text", "phases and measured values; figures of what is no zigzag"),
            _CODE,
            Column("excluded", "text", "why a person excluded it; null where it counts"),
        ),
        partition_by=("vessel_key",),
    ),
    Table(
        "parameter_sets",
        "one identified model; never changed once written",
        (
            *_VESSEL,
            _SET,
            _START,
            Column("model_name", "text", "name of the model"),
            Column("estimator", "text", "how the parameters were estimated"),
            Column("parameters", "estimates", "parameters in continuous time, each with its unit"),
            Column("model_json", "text", "model specification as sorted JSON"),
            Column("model_sha256", "text", "hash of the model specification"),
            Column("settings_json", "text", "settings of the estimator"),
            Column("segment_ids", "texts", "segments it was identified from"),
            Column("log_ids", "texts", "logs it was identified from, SHA-256"),
            Column("discrete", "estimates", "parameters of the discrete model, eq. (17)"),
            Column("noise", "estimates", "noise levels, each with its unit"),
            Column("covariance_names", "texts", "what the rows and columns of the covariance are"),
            Column("covariance", "matrix", "covariance of the estimates, in products of their units"),
            Column("fit_json", "text", "fit and residual statistics"),
            Column("iterations_json", "text", "every iteration of the estimator"),
            Column("convergence_json", "text", "whether and how it converged"),
            Column("warnings", "texts", "what a person should know, a sentence each"),
            Column("parent", "text", "parameter set this one grew from; null for none"),
            Column("provenance_json", "text", "what produced it"),
        ),
        partition_by=("vessel_key",),
    ),
    Table(
        "diagnoses",
        "what a vessel's model lacks, as found once; never changed once written",
        (
            *_VESSEL,
            Column("diagnosis_id", "text", "hash of what produced the diagnosis"),
            _SET,
            _START,
            Column(
                "verdict",
                "text",
                "adequate, explained, ambiguous, partly_explained, unexplained, insufficient_data",
            ),
            Column("effects", "texts", "effects found, those of the sets"),
            Column("content_json", "text", "the diagnosis under the command line's keys"),
            Column("inputs_json", "text", "all that it is a function of"),
            _CODE,
        ),
        partition_by=("vessel_key",),
    ),
    Table(
        "diagnosis_evidence",
        "what a report shows of a diagnosis beyond its verdict: curves, means and parameters",
        (
            *_VESSEL,
            Column("diagnosis_id", "text", "hash of what produced the diagnosis"),
            Column("evidence_json", "text", "as kempf.schemas.diagnosis_evidence has it"),
        ),
        partition_by=("vessel_key",),
    ),
    Table(
        "aliases",
        "a name, such as current, that points to a parameter set of a vessel",
        (*_VESSEL, Column("alias", "text", "the name"), _SET),
    ),
    Table(
        "inbox",
        "one file of an inbox as it was last looked at, and what became of it",
        (
            Column("address", "text", "address of the file: a path, or s3://bucket/key"),
            Column("size_bytes", "integer", "size when it was looked at", "B"),
            Column("modified_utc_ns", "integer", "when it was last written, by its storage", "ns"),
            Column("outcome", "text", "ingested, quarantined, dismissed, gone, removed"),
            Column("vessel", "text", "vessel it was placed with, null where none"),
            Column("log_id", "text", "SHA-256 of the log as delivered, null where it is no log"),
            Column("code", "text", "code of the error that quarantined it, null where none"),
            Column("message", "text", "why it is not ingested, for a person"),
            Column("next_step", "text", "what a person should do, null where nothing"),
            Column("basis", "text", "hash of vessel, profile and code that it was tried with"),
        ),
    ),
    Table(
        "corrections",
        "what a person said of one manoeuvre; only ever added, its time is that of the commit",
        (
            Column("number", "integer", "place among the corrections, from 1"),
            _LOG,
            Column("segment_id", "text", "segment that it was said of, null where one was added"),
            Column("action", "text", "correct, exclude, accept, add"),
            Column("subject_start_utc_ns", "integer", "start of the manoeuvre as it was found or added", "ns"),
            Column("subject_end_utc_ns", "integer", "end of the manoeuvre as it was found or added", "ns"),
            Column("start_utc_ns", "integer", "start that it is given, null where none", "ns"),
            Column("end_utc_ns", "integer", "end that it is given, null where none", "ns"),
            Column("reason", "text", "why"),
        ),
    ),
    Table(
        "notes",
        "a note of a person on a vessel, log, segment or set; only ever added, its time is that of the commit",
        (
            Column("number", "integer", "place among the notes, from 1"),
            *_VESSEL,
            Column("subject", "text", "what it is on: vessel, log, segment, set"),
            Column("subject_id", "text", "name of the vessel, or id of the log, segment or set"),
            Column("event_utc_ns", "integer", "when what it is about happened, null where nobody said", "ns"),
            Column("draught_m", "real", "draught that it states, null where none", "m"),
            Column("text", "text", "the note"),
        ),
    ),
    Table(
        "purges",
        "a log that was deleted for good, the receipt; only ever added, its time is that of the commit",
        (
            Column("number", "integer", "place among the purges, from 1"),
            *_VESSEL,
            _LOG,
            Column("file_name", "text", "name of its file"),
            Column("size_bytes", "integer", "size of the log as delivered", "B"),
            Column("readings", "integer", "rows of readings that were deleted, of every ingest", "1"),
            Column("rejected", "integer", "rows of what was refused that were deleted, of every ingest", "1"),
            Column("evidence", "integer", "diagnoses whose reports lost the measurements that they showed", "1"),
            Column("reason", "text", "why"),
        ),
    ),
    Table(
        "equivalents",
        "one version of the code that counts as another one; only ever added, its time is that of the commit",
        (
            Column("number", "integer", "place of the commit among those of the table, from 1"),
            Column("stage", "text", "ingest, segment, estimate"),
            Column("code", "text", "fingerprint of the code"),
            Column("stands_for", "text", "fingerprint under which it goes on"),
            Column("sets", "integer", "parameter sets that were compared and were the same, bit for bit", "1"),
            Column("vessels", "texts", "of which vessels these were"),
            Column("git_commit", "text", "commit of the code, null where it is not known"),
        ),
    ),
    Table(
        "run_history",
        "one vessel that a run worked on; only ever added, its time is that of the commit",
        (
            Column("number", "integer", "place of the commit among those of the table, from 1"),
            Column("flow", "text", "name of the flow"),
            Column("flow_run", "text", "id of the run on the server, null where there was none"),
            Column("vessel", "text", "name of the vessel"),
            Column("status", "text", "changed, unchanged, failed"),
            Column("new_sets", "integer", "parameter sets made", "1"),
            Column("kept_sets", "integer", "parameter sets kept", "1"),
            Column("reread", "integer", "logs read anew", "1"),
            Column("failures", "integer", "what failed", "1"),
            Column("findings", "integer", "what is wrong with her logs and models", "1"),
            Column("first_failure", "text", "what failed first, null where nothing did"),
        ),
    ),
    Table(
        "runs",
        "one run of a flow; its time is the time of the commit",
        (
            Column("run_id", "text", "hash of the flow and its inputs"),
            Column("flow", "text", "name of the flow"),
            Column("vessel", "text", "vessel, null for a whole fleet"),
            Column("status", "text", "running, completed, failed, ..."),
            Column("counts_json", "text", "how many of what"),
            Column("message_json", "text", "what happened, for a person"),
        ),
    ),
)

#: Every table by name.
TABLES: dict[str, Table] = {table.name: table for table in _ALL}


def arrow_schema(table: Table) -> pa.Schema:
    """Return the Arrow schema of a table, each field with its unit and description as metadata.

    Parameters
    ----------
    table : Table
        One of `TABLES`.

    Examples
    --------
    >>> arrow_schema(TABLES["readings"]).field("yaw_rate_rad_s").metadata[b"unit"]
    b'rad/s'
    """
    import pyarrow as pa

    real, integer, text = pa.float64(), pa.int64(), pa.string()
    estimate = [("name", text), ("value", real), ("std", real), ("unit", text)]
    kinds: dict[Kind, Any] = {
        "text": text,
        "texts": pa.list_(text),
        "integer": integer,
        "integers": pa.list_(integer),
        "real": real,
        "reals": pa.list_(real),
        "matrix": pa.list_(pa.list_(real)),
        "estimates": pa.list_(pa.struct(estimate)),
        "counts": pa.list_(pa.struct([("reason", text), ("count", integer)])),
    }
    return pa.schema(
        [
            pa.field(
                c.name,
                kinds[c.kind],
                metadata={"unit": c.unit, "description": c.words} if c.unit else {"description": c.words},
            )
            for c in table.columns
        ]
    )
