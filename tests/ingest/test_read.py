"""The way in: formats recognised by content, compression, refusals of whole files."""

import gzip

import pytest
import zstandard

from kempf.pipeline.ingest import unpack
from kempf.schemas.errors import DataRejected
from kempf.schemas.profile import VesselProfile
from tests.reading import read_log

NMEA = b"2025-05-03T07:47:01.148Z $HEHDT,11.37,T*2B\n2025-05-03T07:47:02.148Z $SDDPT,53.7,0.0*66\n"
NOBODY = VesselProfile()


def test_the_content_decides_the_format_and_not_the_name():
    readings = read_log("strange.dat", NMEA, NOBODY)
    assert (readings.format, readings.frame.height) == ("nmea", 2)


@pytest.mark.parametrize("pack", [gzip.compress, lambda b: gzip.compress(b[:50]) + gzip.compress(b[50:])])
def test_gzip_with_one_or_more_members(pack):
    assert read_log("a.nmea.gz", pack(NMEA), NOBODY).frame.height == 2


def test_zstd():
    packed = zstandard.ZstdCompressor().compress(NMEA)
    assert read_log("a.nmea.zst", packed + packed, NOBODY).tally.records_read == 4


def _noise(n):
    state, lines = 1, []
    for k in range(n):
        state = state * 1103515245 % 2**31
        body = f"HEHDT,{state % 36000 / 100},T"
        total = 0
        for char in body.encode():
            total ^= char
        lines.append(f"2025-05-03T{k // 3600:02d}:{k // 60 % 60:02d}:{k % 60:02d}.000Z ${body}*{total:02X}\n")
    return "".join(lines).encode()


@pytest.mark.parametrize("pack", [gzip.compress, zstandard.ZstdCompressor().compress])
def test_a_cut_file_keeps_what_unpacks_and_says_so(pack):
    packed = pack(_noise(20_000))
    readings = read_log("a.gz", packed[: len(packed) // 2], NOBODY)
    assert readings.tally.records_read > 100
    assert "cut short" in readings.notes[0]


@pytest.mark.parametrize("kind", ["gzip", "zstd"])
def test_damage_inside_the_compression_is_refused(kind):
    whole = _noise(2000)
    packed = bytearray(
        gzip.compress(whole) if kind == "gzip" else zstandard.ZstdCompressor(write_checksum=True).compress(whole)
    )
    packed[len(packed) // 2] ^= 0xFF
    with pytest.raises(DataRejected) as error:
        read_log("a.gz", bytes(packed), NOBODY)
    assert error.value.code == f"damaged_{kind}"


@pytest.mark.parametrize("pack", [gzip.compress, zstandard.ZstdCompressor().compress])
def test_a_small_file_that_holds_a_huge_one_is_refused(pack):
    with pytest.raises(DataRejected) as error:
        unpack.unpack("bomb.gz", pack(bytes(10_000_000)), limit=1_000_000)
    assert error.value.code == "log_too_large"


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"", "empty_log"),
        (b"\x7fELF" + bytes(range(256)) * 8, "unknown_format"),
        (b"   \n \n", "unknown_format"),
        (NMEA.replace(b"2025", b"1980"), "no_valid_reading"),
        (NMEA.replace(b"*", b"+"), "no_valid_reading"),
        (
            NMEA.replace(b"2025-05-03T07:47:01.148Z ", b"").replace(b"2025-05-03T07:47:02.148Z ", b""),
            "no_valid_reading",
        ),
    ],
)
def test_files_that_give_nothing_are_refused_with_a_code(data, code):
    with pytest.raises(DataRejected) as error:
        read_log("a.log", data, NOBODY)
    assert error.value.code == code
    assert error.value.next_step


def test_a_log_without_a_clock_gives_the_year():
    with pytest.raises(DataRejected, match=r"2 clock_unset\. Its times lie in 1980\.") as error:
        read_log("a.log", NMEA.replace(b"2025", b"1980"), NOBODY)
    assert error.value.details["by_reason"] == {"clock_unset": 2}


def test_the_profile_may_overrule_the_content():
    profile = VesselProfile.model_validate({"sources": [{"match": "*.x", "format": "mcap"}]})
    with pytest.raises(Exception, match="MCAP file, for which the profile maps no topic"):
        read_log("a.x", NMEA, profile)
