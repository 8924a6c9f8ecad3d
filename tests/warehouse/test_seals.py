"""Every file of a table is sealed once it is written: what is not as it was written is never read as other data."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from kempf.schemas.errors import KempfError
from kempf.warehouse.storage import delta, seals, table_cache
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import runs
from kempf.warehouse.upkeep import compaction
from kempf.warehouse.upkeep.verify import damages, verify


@pytest.fixture
def warehouse(tmp_path: Path) -> Warehouse:
    """A table of three commits beside its creation."""
    place = Warehouse(str(tmp_path / "kempf data ø"))
    for k in range(3):
        runs.record_all(place, [runs.FlowRun(f"run-{k}", "ingest", f"vessel {k}", "completed", {"logs": k})])
    return place


def folder(warehouse: Warehouse) -> Path:
    assert warehouse.folder is not None
    return warehouse.folder / "runs"


def commit(warehouse: Warehouse, version: int) -> Path:
    return folder(warehouse) / "_delta_log" / f"{version:020d}.json"


def test_every_commit_and_file_is_sealed(warehouse: Warehouse) -> None:
    place = folder(warehouse)
    assert seals.sealed_versions(place) == [0, 1, 2, 3]
    for version in range(4):
        assert seals.copy_of_commit(place, version) == commit(warehouse, version).read_bytes()
    files = sorted(path.name for path in place.glob("*.parquet"))
    assert [path.name for path in sorted((place / "_seals" / "data").iterdir())] == [f"{one}.sha256" for one in files]
    assert verify(warehouse) == []


@pytest.mark.parametrize("pattern", ["*.parquet", "_delta_log/*.json"])
def test_a_flipped_bit_is_never_read_as_other_data(warehouse: Warehouse, pattern: str) -> None:
    random = np.random.default_rng(5)
    wanted = runs.all_runs(warehouse)
    for path in sorted(folder(warehouse).glob(pattern)):
        whole = path.read_bytes()
        for _ in range(6):
            data = bytearray(whole)
            data[int(random.integers(len(data)))] ^= 1 << int(random.integers(8))
            path.unlink()  # another file, as the one of a copied folder is
            path.write_bytes(bytes(data))
            table_cache._kept.clear()  # another process: one that has read the commit before still knows it
            with pytest.raises(KempfError) as caught:
                runs.all_runs(warehouse)
            assert caught.value.code == "table_damaged" and path.name in caught.value.message
            (found,) = damages(warehouse, "runs")
            assert path.name in found.where and not found.past
        path.write_bytes(whole)
        assert runs.all_runs(warehouse) == wanted


def emptied(path: Path) -> None:
    path.write_bytes(b"")


@pytest.mark.parametrize("harm", [Path.unlink, emptied])
def test_a_last_commit_that_is_lost_or_emptied_is_noticed(warehouse: Warehouse, harm: Callable[[Path], None]) -> None:
    wanted = runs.all_runs(warehouse)
    harm(commit(warehouse, 3))
    for _ in range(2):
        with pytest.raises(KempfError) as caught:
            runs.all_runs(warehouse)
        assert caught.value.code == "table_damaged"
    with pytest.raises(KempfError):
        runs.record_all(warehouse, [runs.FlowRun("run-9", "ingest", None, "completed")])
    assert [one.where for one in damages(warehouse, "runs")] == ["runs/_delta_log/00000000000000000003.json"]
    assert seals.repair_log(folder(warehouse), "runs") == [
        "The commit runs/_delta_log/00000000000000000003.json was put back from its sealed copy."
    ]
    assert runs.all_runs(warehouse) == wanted and verify(warehouse) == []


def test_a_table_of_an_earlier_version_is_read_and_sealed_by_the_next_writer(warehouse: Warehouse) -> None:
    from shutil import rmtree

    wanted = runs.all_runs(warehouse)
    rmtree(folder(warehouse) / "_seals")
    assert runs.all_runs(warehouse) == wanted and verify(warehouse) == []
    with delta.ensured(warehouse, "runs") as table:
        vars(table).pop("kempf_sealed", None)  # a handle of another process
    runs.record_all(warehouse, [runs.FlowRun("run-3", "ingest", None, "completed")])
    assert seals.sealed_versions(folder(warehouse)) == [0, 1, 2, 3, 4]


def test_a_damaged_seal_stops_nobody_and_is_found(warehouse: Warehouse) -> None:
    wanted = runs.all_runs(warehouse)
    of_commit = folder(warehouse) / "_seals" / "log" / f"{2:020d}.json"
    of_commit.write_text(of_commit.read_text(encoding="utf-8").replace("completed", "c0mpleted", 1)[:-5], "utf-8")
    of_file = next((folder(warehouse) / "_seals" / "data").iterdir())
    of_file.write_text("ff" + of_file.read_text()[2:])
    assert runs.all_runs(warehouse) == wanted
    assert len(damages(warehouse, "runs")) == 2
    place = folder(warehouse)
    done = seals.repair_log(place, "runs") + seals.repair_seals(place, "runs", sorted(place.glob("*.parquet")))
    assert len(done) == 2 and seals.copy_of_commit(place, 2) == commit(warehouse, 2).read_bytes()
    with delta.reading(warehouse, "runs") as table:
        assert table is not None
        vars(table).pop("kempf_sealed", None)
        seals.seal(table)
    assert verify(warehouse) == [] and runs.all_runs(warehouse) == wanted


def test_a_commit_that_was_cut_off_before_it_was_sealed_is_found(warehouse: Warehouse) -> None:
    wanted = runs.all_runs(warehouse)
    whole = commit(warehouse, 3).read_bytes()
    for data in (whole[:-40], whole.splitlines()[0], whole[: whole.index(b"\n") + 1], b""):
        torn = commit(warehouse, 4)
        torn.write_bytes(data)
        assert [one.where for one in damages(warehouse, "runs")] == ["runs/_delta_log/00000000000000000004.json"]
        assert len(seals.repair_log(folder(warehouse), "runs")) == 1 and not torn.exists()
        assert runs.all_runs(warehouse) == wanted


def test_compacting_keeps_all_sealed(warehouse: Warehouse) -> None:
    wanted = runs.all_runs(warehouse)
    assert compaction.compact(warehouse, more_files_than=1) == ("runs",)
    assert verify(warehouse) == [] and runs.all_runs(warehouse) == wanted
    checkpoint = next((folder(warehouse) / "_delta_log").glob("*.checkpoint.parquet"))
    data = bytearray(checkpoint.read_bytes())
    data[len(data) // 2] ^= 4
    checkpoint.write_bytes(bytes(data))
    assert any("checkpoint" in one.where for one in damages(warehouse, "runs"))
    assert "the commits say the same" in seals.repair_log(folder(warehouse), "runs")[0]
    assert runs.all_runs(warehouse) == wanted and damages(warehouse, "runs") == []
    compaction.vacuum(warehouse, 0.0)
    assert seals.sealed_versions(folder(warehouse)) and verify(warehouse) == []
    assert runs.all_runs(warehouse) == wanted


def test_the_seals_of_deleted_files_are_deleted(warehouse: Warehouse) -> None:
    def sealed() -> set[str]:
        return {path.name.removesuffix(".sha256") for path in (folder(warehouse) / "_seals" / "data").iterdir()}

    before = {path.name for path in folder(warehouse).glob("*.parquet")}
    compaction.compact(warehouse, 1)
    held = sealed()
    assert before < held
    compaction.vacuum(warehouse, 0.0, dry_run=True)
    assert sealed() == held
    # as a call leaves them that was cut off between the files and their seals
    left = folder(warehouse) / "_seals" / "data" / "part-gone.parquet.sha256"
    left.write_bytes(b"0")
    compaction.vacuum(warehouse, 0.0)
    assert sealed() == {path.name for path in folder(warehouse).rglob("*.parquet")}
    assert not before & sealed() and verify(warehouse) == []


def test_a_seal_holds_the_commit_as_it_was(warehouse: Warehouse) -> None:
    content = json.loads((folder(warehouse) / "_seals" / "log" / f"{1:020d}.json").read_text(encoding="utf-8"))
    assert content["commit"].encode() == commit(warehouse, 1).read_bytes()
