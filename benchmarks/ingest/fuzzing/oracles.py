"""What must hold for any input: an error that a person can read or ledgers that close, and no failed checksum accepted.

The checksums are computed anew here, byte by byte, without any code of the readers.
"""

from __future__ import annotations

import gzip
import re
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

from benchmarks.ingest.fuzzing.corpus import PROFILE, Reader, inputs
from benchmarks.ingest.fuzzing.whole_chunks import vouched_times
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.pipeline.ingest.readings import READING_SCHEMA, REJECTED_SCHEMA, Readings
from kempf.schemas.channels import CHANNEL_COLUMNS
from kempf.schemas.errors import KempfError
from kempf.schemas.profile import VesselProfile
from tests.reading import read_log

#: What came of one input, in few words: equal words mean that the reader did the same.
Outcome = tuple[str, ...]

#: What stands in front of a sentence, with the sign that opens it: a stamp, a TAG block, one that lost a backslash.
_FRONT = re.compile(rb"^[^$!\\]*(?:\\[^\\]*\\[^$!]*|\\[^\\$!]*)?[$!]")
_BLANKS = b" \t\r\v\f\n"


class Oracle:
    """Runs one reader and judges what it does.

    Parameters
    ----------
    reader : Reader
    folder : Path
        Where it may write its files.

    Attributes
    ----------
    took : float
        How long the reader itself took over the latest input, s: of the processor or on the wall, whichever is less,
        for on a machine that others use, too, the clock on the wall says little.
    """

    def __init__(self, reader: Reader, folder: Path) -> None:
        self.folder = folder
        self.took = 0.0
        self._judge: Callable[[str, bytes], Outcome] = {
            "nmea": self._log,
            "delimited": self._log,
            "mcap": self._log,
            "profile": self._profile,
        }[reader]
        self._given = folder / "given.yaml"
        self._given.write_bytes(PROFILE)
        self._known = read_profiles([self._given])
        self._logs = [inputs(other)[0] for other in ("nmea", "delimited", "mcap")]

    def __call__(self, name: str, data: bytes) -> Outcome:
        """Judge one input.

        Raises
        ------
        AssertionError
            Something does not hold; any other exception is a crash of the reader.
        """
        self.took = 0.0
        try:
            return self._judge(name, data)
        except KempfError as error:
            assert error.code and error.message and error.next_step, "an error that says too little"
            return ("refused", error.code)

    @contextmanager
    def _timed(self) -> Iterator[None]:
        begin, worked = perf_counter(), process_time()
        try:
            yield
        finally:
            self.took += min(perf_counter() - begin, process_time() - worked)

    def _log(self, name: str, data: bytes, profile: VesselProfile | None = None) -> Outcome:
        with self._timed():
            readings = read_log(name, data, profile or self._known)
        check_ledgers(readings)
        content = data
        if data.startswith(b"\x1f\x8b"):
            content = _gunzipped(data, readings)
        elif data.startswith(b"\x28\xb5\x2f\xfd"):
            return ("zstd", *readings.tally.by_reason)
        if readings.format == "nmea":
            check_sentences(content, readings)
        if readings.format == "mcap":
            unvouched = set(readings.frame["time_utc_ns"].to_list()) - vouched_times(content)
            assert not unvouched, f"messages of chunks that fail their checksum were kept: {sorted(unvouched)[:5]}"
        kept = str(min(readings.tally.records_kept, 3))
        return (readings.format, kept, *readings.tally.by_reason, *(note.split()[0] for note in readings.notes))

    def _profile(self, name: str, data: bytes) -> Outcome:
        path = self.folder / name
        path.write_bytes(data)
        with self._timed():
            profile = read_profiles([path])
        assert profile == VesselProfile.model_validate_json(profile.canonical_json()), (
            "a profile that does not come back"
        )
        outcomes = []
        for log_name, log in self._logs:
            try:
                outcomes.append(self._log(log_name, log, profile)[0])
            except KempfError as error:
                outcomes.append(error.code)
        return ("profile", *outcomes)


def check_ledgers(readings: Readings) -> None:
    """Assert that every record is kept or refused with a reason, once, and that what is kept is finite."""
    tally, frame, rejected = readings.tally, readings.frame, readings.rejected
    assert dict(frame.schema) == READING_SCHEMA and dict(rejected.schema) == REJECTED_SCHEMA
    whole = rejected.filter(rejected["channel"].is_null())
    assert tally.records_kept == frame.height > 0
    assert tally.records_rejected == whole.height
    assert tally.records_read == tally.records_kept + tally.records_rejected
    assert tally.values_rejected == rejected.height - whole.height
    assert tally.values_read == tally.values_kept + tally.values_rejected
    assert tally.values_kept == sum(frame.height - frame[c].null_count() for c in CHANNEL_COLUMNS)
    assert sum(tally.by_reason.values()) == rejected.height
    assert sorted([*frame["record"], *whole["record"]]) == list(range(tally.records_read))
    assert not any(frame[c].is_nan().any() or frame[c].is_infinite().any() for c in CHANNEL_COLUMNS)
    for _, own in frame.group_by("source"):
        assert own["time_utc_ns"].is_sorted()


def check_sentences(content: bytes, readings: Readings) -> None:
    """Assert that every kept line of an NMEA log ends in the checksum of its sentence, and every line is counted."""
    lines = [line.strip(_BLANKS) for line in re.split(rb"[\r\n]", content)]
    lines = [line for line in lines if line]
    assert len(lines) == readings.tally.records_read, "lines that are not counted"
    for record in readings.frame["record"]:
        line = lines[record]
        body, star, given = _FRONT.sub(b"", line, count=1).rpartition(b"*")
        assert star and len(given) == 2, f"kept without a checksum: {line!r}"
        total = 0
        for byte in body:
            total ^= byte
        assert given.upper() == b"%02X" % total, f"kept under a wrong checksum: {line!r}"


def _gunzipped(data: bytes, readings: Readings) -> bytes:
    """Unpack as the standard library does; a file that it refuses must have been reported as cut or padded."""
    try:
        return gzip.decompress(data)
    except (OSError, EOFError, zlib.error):
        assert readings.notes and ("cut short" in readings.notes[0] or "behind the end" in readings.notes[0]), (
            "a gzip file that fails its checksum was read without a word"
        )
        parts = zlib.decompressobj(wbits=31)
        content = parts.decompress(data)
        while parts.eof and parts.unused_data.lstrip(b"\0").startswith(b"\x1f\x8b"):
            rest = parts.unused_data.lstrip(b"\0")
            parts = zlib.decompressobj(wbits=31)
            content += parts.decompress(rest)
        return content


def oracle_of(reader: Reader) -> tuple[Oracle, TemporaryDirectory[str]]:
    """Return the oracle of a reader, and the folder that it writes to, which the caller closes."""
    folder = TemporaryDirectory()
    return Oracle(reader, Path(folder.name)), folder
