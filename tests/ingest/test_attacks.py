"""What an attack on the readers found: each once, in its smallest form."""

from __future__ import annotations

import gzip
import os
import time
from collections.abc import Callable
from pathlib import Path

import polars as pl
import pytest
import zstandard

from kempf.flows.jobs.ingest.files import opened_log, read_bytes, read_profiles
from kempf.pipeline.ingest.text.times import decimal_times
from kempf.pipeline.ingest.unpack import unpack
from kempf.schemas.errors import DataRejected, UsageError
from kempf.schemas.profile import VesselProfile, parse
from tests.reading import read_log

HALF = b"2025-05-03T07:47:01.147Z $HEHDT,11.37,T*2B\n"


def test_digits_of_other_scripts_are_no_time() -> None:
    ns, good = decimal_times(pl.Series(["٣٠", "40"]), "s")
    assert good.tolist() == [False, True]
    assert ns[1] == 40_000_000_000


def test_a_skippable_frame_hides_nothing() -> None:
    squeeze = zstandard.ZstdCompressor().compress
    skip = b"\x50\x2a\x4d\x18\x04\x00\x00\x00abcd"
    for data in (squeeze(HALF) + skip + squeeze(HALF), skip + squeeze(HALF) + squeeze(HALF)):
        assert unpack("log.zst", data) == (HALF * 2, [])
    content, notes = unpack("log.zst", squeeze(HALF) + b"junk")
    assert content == HALF and "4 bytes behind the end" in notes[0]


def test_zeros_between_gzip_members_hide_nothing() -> None:
    assert unpack("log.gz", gzip.compress(HALF) + b"\0" * 512 + gzip.compress(HALF)) == (HALF * 2, [])


def open_log(path: Path) -> None:
    with opened_log(path):
        pass


@pytest.mark.parametrize("take", [open_log, lambda path: read_bytes(path, "vessel profile")])
def test_a_pipe_and_a_device_are_no_files(tmp_path: Path, take: Callable[[Path], object]) -> None:
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    for path in (pipe, Path("/dev/zero")):
        with pytest.raises(UsageError) as caught:
            take(path)
        assert caught.value.code == "not_a_file"


def test_a_huge_file_is_not_read(tmp_path: Path) -> None:
    huge = tmp_path / "huge.log"
    with huge.open("wb") as stream:
        stream.truncate(1 << 40)
    with pytest.raises(DataRejected) as caught:
        read_bytes(huge, "vessel profile")
    assert caught.value.code == "file_too_large"
    with opened_log(huge) as log, pytest.raises(DataRejected) as caught:
        read_log("huge.log", log, VesselProfile())
    assert caught.value.code == "file_too_large"


@pytest.mark.parametrize("text", ["{" * 9_000, "[{" * 20_000, "sources: " + "[" * 40 + "]" * 40])
def test_deep_nesting_is_refused_where_it_begins(tmp_path: Path, text: str) -> None:
    profile = tmp_path / "profile.yaml"
    profile.write_text(text)
    with pytest.raises(UsageError, match=r"nested deeper than 32 brackets.* line 1, column") as caught:
        read_profiles([profile])
    assert caught.value.code == "not_yaml"


@pytest.mark.parametrize(
    "text", ["length_m: !!float ''", "length_m: !!int _", "vessel: !!bool x", r'vessel: "\UFFFFFFFF"']
)
def test_broken_yaml_is_reported_as_such(tmp_path: Path, text: str) -> None:
    profile = tmp_path / "profile.yaml"
    profile.write_text(text)
    with pytest.raises(UsageError) as caught:
        read_profiles([profile])
    assert caught.value.code == "not_yaml"


@pytest.mark.parametrize(
    "source",
    [
        {"separator": "é"},
        {"separator": "\r"},
        {"header_lines": 10**5000},
        {"time": {"column": "t", "unit": "s", "start": "9999-01-01T00:00:00Z"}},
        {"time": {"column": "t", "unit": "s", "start": "0001-01-01T00:00:00Z"}},
    ],
)
def test_impossible_settings_are_refused_where_they_stand(source: dict[str, object]) -> None:
    with pytest.raises(UsageError) as caught:
        parse({"vessel": "a", "sources": [{"match": "*", **source}]}, "profile.yaml")
    assert caught.value.code == "profile_invalid"


@pytest.mark.parametrize("squeeze", [gzip.compress, zstandard.ZstdCompressor().compress])
def test_a_small_file_that_unpacks_to_far_more_than_a_log_is_refused(squeeze) -> None:
    for content, code in ((bytes(80 << 20), "log_too_large"), (b"\n" * 2_000_000, "too_many_records")):
        with pytest.raises(DataRejected) as caught:
            unpack("log.gz", squeeze(content))
        assert caught.value.code == code


@pytest.mark.parametrize("squeeze", [gzip.compress, zstandard.ZstdCompressor().compress])
def test_very_many_small_members_take_a_time_that_grows_with_their_number(squeeze) -> None:
    one = squeeze(b"a\n")
    seconds = []
    for n in (2_000, 40_000):
        begin = time.perf_counter()
        assert unpack("log.gz", one * n) == (b"a\n" * n, [])
        seconds.append(time.perf_counter() - begin)
    assert seconds[1] < 100 * seconds[0]
