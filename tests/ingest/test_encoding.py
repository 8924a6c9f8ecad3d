"""Text in other encodings than UTF-8: UTF-16 is read, others are named."""

from __future__ import annotations

import codecs
import gzip
import math
from pathlib import Path

import pytest

from kempf.flows.jobs.ingest.draft_profile import draft
from kempf.pipeline.ingest.encoding import utf16_of
from kempf.schemas.errors import DataRejected, UsageError
from kempf.schemas.profile import VesselProfile
from tests.ingest.test_delimited import T, profile
from tests.ingest.test_nmea import stamped
from tests.reading import read_log

TEXT = f"utc,sog,hdg\r\n{T}1Z,10,90\r\n{T}2Z,11,91\r\n"
NOTE = "The file is encoded as UTF-16, and was read so."


def wide(text: str) -> list[bytes]:
    little, big = text.encode("utf-16-le"), text.encode("utf-16-be")
    return [codecs.BOM_UTF16_LE + little, codecs.BOM_UTF16_BE + big, little, big]


@pytest.mark.parametrize("stated", ["utf-8", "utf-16"])
@pytest.mark.parametrize("data", wide(TEXT))
@pytest.mark.parametrize("pack", [bytes, gzip.compress])
def test_delimited_text_in_utf_16_is_read_as_in_utf_8(pack, data: bytes, stated: str) -> None:
    readings = read_log("log.csv", pack(data), profile(encoding=stated))
    assert readings.frame["heading_rad"].to_list() == [math.radians(90), math.radians(91)]
    assert readings.tally.records_rejected == 0 and NOTE in readings.notes


@pytest.mark.parametrize("data", wide("".join(stamped(f"HEHDT,{k}.0,T") for k in range(1, 3))))
def test_nmea_in_utf_16_is_read(data: bytes) -> None:
    readings = read_log("log.nmea", data, VesselProfile())
    assert readings.format == "nmea" and readings.tally.records_kept > 0 and NOTE in readings.notes


def test_a_file_cut_within_a_character_costs_its_last_row_alone() -> None:
    readings = read_log("log.csv", (TEXT + f"{T}3Z,1,").encode("utf-16") + b"1", profile())
    assert readings.tally.records_kept == 3 and readings.tally.by_reason == {"not_a_number": 1}


@pytest.mark.parametrize(
    "data",
    [b"", b"a\0", TEXT.encode(), TEXT.encode("utf-32"), bytes(99), b"\x01\0" * 8, b"t,h\n1,2\n" + bytes(4096)],
)
def test_other_bytes_are_no_utf_16(data: bytes) -> None:
    assert utf16_of(data) is None


def test_names_that_are_not_in_utf_8_are_reported_with_the_encoding_to_write() -> None:
    data = f"utc,sog,Kurs [°]\n{T}1Z,10,90\n".encode("latin-1")
    channels = {"Kurs [°]": {"channel": "heading", "unit": "deg"}}
    with pytest.raises(DataRejected) as missing:
        read_log("log.csv", data, profile(channels))
    with pytest.raises(UsageError) as unknown:
        read_log("log.csv", data, VesselProfile())
    for error, code in ((missing.value, "columns_missing"), (unknown.value, "no_source_for_log")):
        assert error.code == code and "`encoding: latin-1`" in error.next_step
    assert read_log("log.csv", data, profile(channels, encoding="latin-1")).tally.records_kept == 1
    with pytest.raises(DataRejected) as error:
        read_log("log.csv", TEXT.encode(), profile(channels))
    assert "encoding" not in error.value.next_step


def test_a_draft_names_the_encoding_by_which_it_shows_the_names(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    text = f"utc,sog,Kurs [°]\n{T}1Z,10,90\n"
    log.write_bytes(text.encode("latin-1"))
    assert 'encoding: "latin-1?"' in draft(log) and '"Kurs [°]"' in draft(log)
    for data in (text.encode(), *wide(text)):
        log.write_bytes(data)
        assert "encoding" not in draft(log) and '"Kurs [°]"' in draft(log)


def test_names_that_are_not_in_the_encoding_of_the_profile_are_reported_with_it() -> None:
    data = f"utc,sog,Kurs [°]\n{T}1Z,10,90\n".encode()
    channels = {"Kurs [°]": {"channel": "heading", "unit": "deg"}}
    with pytest.raises(DataRejected) as error:
        read_log("log.csv", data, profile(channels, encoding="ascii"))
    assert error.value.next_step.startswith("The names are not in ascii: correct `encoding`")
