"""A long log goes through files beside; what comes of it is what comes of a short one."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from kempf.flows.jobs.ingest import spool
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap import decode
from kempf.schemas.errors import DataRejected
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from tests.conftest import Ship
from tests.flows.content import seen


@pytest.fixture
def beside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which temporary files are made, empty."""
    folder = tmp_path / "beside"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def cut(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of a thousand messages."""
    monkeypatch.setattr(decode, "_TOGETHER", 1_000)
    monkeypatch.setattr("kempf.pipeline.ingest.mcap.container.stream.WINDOW", 20_000)


def taken(ferry: Ship, folder: Path) -> tuple[Warehouse, Any]:
    ferry.write(folder)
    warehouse = Warehouse(str(folder / "w"))
    (outcome,) = ingest(warehouse, [folder / "ferry.mcap"], given=VesselProfile.model_validate(ferry.profile))
    assert outcome.error is None and len(outcome.segments) == 1
    return warehouse, outcome


def test_a_long_log_leaves_what_a_short_one_leaves(
    ferry: Ship, tmp_path: Path, beside: Path, request: pytest.FixtureRequest
) -> None:
    short, one = taken(ferry, tmp_path / "short")
    wanted = channels_of(short, one.ingest_id)
    request.getfixturevalue("cut")
    long, other = taken(ferry, tmp_path / "long")
    assert seen(long) == seen(short)
    assert other.as_json() | {"path": ""} == one.as_json() | {"path": ""}
    found = channels_of(long, other.ingest_id)
    assert found.notes == wanted.notes
    for name, series in wanted.series.items():
        assert series.time_utc_ns.tolist() == found.series[name].time_utc_ns.tolist()
        assert series.value.tolist() == found.series[name].value.tolist()
    assert list(beside.iterdir()) == []


@pytest.mark.usefixtures("cut")
def test_parts_lie_in_files_and_are_gone_after(ferry: Ship, beside: Path) -> None:
    profile = VesselProfile.model_validate(ferry.profile)
    with spool.spooled("ferry.mcap", LogFile(ferry.mcap), profile) as found:
        frames, lazy = list(found.frames()), found.lazy().collect()
        assert len(frames) > 1 and pl.concat(frames).equals(lazy)
        assert lazy.height == found.tally.records_kept
        assert sum(one.height for one in found.rejections()) == found.tally.records_rejected
        assert len(list(next(beside.iterdir()).iterdir())) == 2 * len(frames)
    assert list(beside.iterdir()) == []


@pytest.mark.usefixtures("cut")
def test_a_log_that_proves_unreadable_late_leaves_nothing(
    ferry: Ship, tmp_path: Path, beside: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*arguments: object) -> None:
        raise DataRejected("late", "Found at the end.", "Nothing.")

    monkeypatch.setattr(decode._DecodeJob, "require_something", refuse)
    ferry.write(tmp_path)
    warehouse = Warehouse(str(tmp_path / "w"))
    (outcome,) = ingest(warehouse, [tmp_path / "ferry.mcap"], given=VesselProfile.model_validate(ferry.profile))
    assert outcome.error is not None and outcome.error.code == "late"
    assert list(beside.iterdir()) == [] and not warehouse.exists()


@pytest.mark.usefixtures("cut")
def test_no_room_for_the_parts_is_reported(ferry: Ship, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*arguments: object, **named: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(pl.DataFrame, "write_parquet", full)
    ferry.write(tmp_path)
    warehouse = Warehouse(str(tmp_path / "w"))
    (outcome,) = ingest(warehouse, [tmp_path / "ferry.mcap"], given=VesselProfile.model_validate(ferry.profile))
    assert outcome.error is not None and outcome.error.code == "disk_full"
    assert "kempf-log-" in outcome.error.message
