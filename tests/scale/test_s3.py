"""A warehouse in a bucket, on a real S3 server: the same content as in a folder, by the same commands."""

from __future__ import annotations

import json
import tarfile
import time
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import polars as pl
import pytest
import yaml

from kempf.flows.jobs.corrections.purge_logs import purge
from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
from kempf.flows.jobs.inbox.release_log import release
from kempf.flows.jobs.inbox.take_inbox import take_inbox
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.repair.repair_warehouse import repair
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.rerun_set import rerun
from kempf.pipeline.ingest.log_file import LogFile
from kempf.schemas.errors import KempfError, NotFound
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.sources.source_folder import SourceFolder
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.keys import vessel_key
from kempf.warehouse.storage.marker import LAYOUT, Marker
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, logs, parameter_sets, purges, raw, readings, runs, segments, vessels
from kempf.warehouse.upkeep import compaction
from kempf.warehouse.upkeep.migrations import by_month, chain, commits
from kempf.warehouse.upkeep.verify import verify
from tests.conftest import Ship
from tests.flows.content import seen
from tests.scale.conftest import Bucket
from tests.warehouse.samples import START_NS, inputs, parameter_set, raw_bytes
from tests.workbench.driving import kempf

ROOT = Path(__file__).parents[2]
QUICK = Request(estimator="least-squares")


def taken_in(warehouse: Warehouse, ferry: Ship, folder: Path) -> Warehouse:
    profile = VesselProfile.model_validate(ferry.profile)
    (folder / "ferry.csv.gz").write_bytes(ferry.csv)
    (outcome,) = ingest(warehouse, [folder / "ferry.csv.gz"], given=profile)
    assert (outcome.outcome, outcome.error) == ("new", None)
    assert all(o.parameter_set for o in identify_vessel(warehouse, "ferry", QUICK))
    return warehouse


@pytest.fixture(scope="module")
def stored(bucket: Bucket, ferry: Ship, tmp_path_factory: pytest.TempPathFactory) -> Warehouse:
    folder = tmp_path_factory.mktemp("logs")
    return taken_in(Warehouse(f"{bucket.uri}/stored", bucket.settings), ferry, folder)


def test_a_bucket_says_what_a_folder_says(stored: Warehouse, ferry: Ship, tmp_path: Path) -> None:
    local = taken_in(Warehouse(str(tmp_path / "w")), ferry, tmp_path)
    there, here = seen(stored), seen(local)
    assert {name: len(rows) for name, rows in there.items()} == {name: len(rows) for name, rows in here.items()}
    assert there == here and len(there["readings"]) > 1000
    (row,) = logs.current(stored)
    assert raw_bytes(stored, row.log_id) == ferry.csv
    fields = {f.name: f.metadata.get("unit") for f in delta.ensure_table(stored, "readings").schema().fields}
    assert fields["heading_rad"] == "rad"


def test_a_set_is_built_again_from_the_bytes_in_the_bucket(stored: Warehouse) -> None:
    (name,) = parameter_sets.summaries(stored, "ferry")["parameter_set_id"].to_list()
    assert rerun(stored, name).verdict == "bit-identical"


def test_the_command_line_reaches_it_by_the_environment(
    stored: Warehouse, bucket: Bucket, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in bucket.settings.items():
        monkeypatch.setenv(name, value)
    output = kempf("segments", "--warehouse", stored.uri, "--json")
    assert output.code == 0, output
    assert [one["segment_id"] for one in output.json] == [one.segment_id for one in segments.current(stored)]
    assert kempf("params", "list", "--warehouse", stored.uri).code == 0
    assert kempf("vessels", "list", "--warehouse", f"{bucket.uri}/nothing-here", "--json").code == 4


def test_several_writers_lose_nothing(bucket: Bucket) -> None:
    warehouse = Warehouse(f"{bucket.uri}/many", bucket.settings)

    def write(k: int) -> None:
        mine = Warehouse(warehouse.uri, bucket.settings)
        vessels.register(mine, f"ship{k}", VesselProfile(vessel=f"ship{k}", length_m=50.0 + k))
        runs.record_all(mine, [runs.FlowRun(runs.run_id("test", k), "test", f"ship{k}", "done")])
        runs.record_all(mine, [runs.FlowRun(runs.run_id("test", "all"), "test", None, f"last was {k}")])

    with ThreadPoolExecutor(3) as pool:
        list(pool.map(write, range(6)))
    assert vessels.names(warehouse) == sorted(f"ship{k}" for k in range(6))
    assert len(runs.all_runs(warehouse, "test")) == 7


def test_reprocessing_moves_the_alias_and_history_stays(stored: Warehouse) -> None:
    before = {row.ingest_id for row in logs.current(stored)}
    changed = vessels.current(stored, "ferry").model_copy(update={"wind_arm_per_m": 0.004})
    vessels.register(stored, "ferry", changed)
    report = reprocess_vessel(stored, "ferry", QUICK)
    assert (report.status, report.reread, report.new_sets, report.failures) == ("changed", 1, 1, [])
    assert {row.ingest_id for row in logs.current(stored)}.isdisjoint(before)
    assert len(parameter_sets.summaries(stored, "ferry")) == 2
    name = parameter_sets.summaries(stored, "ferry")["parameter_set_id"].to_list()[0]
    assert aliases.point(stored, "ferry", name) and aliases.of_vessel(stored, "ferry") == {"current": name}


def test_a_damaged_object_is_reported_and_repaired(stored: Warehouse, ferry: Ship) -> None:
    (row,) = logs.current(stored)
    stored.write_bytes(ferry.csv[:-1], "raw", row.log_id[:2], row.log_id)
    with pytest.raises(KempfError, match="is damaged"):
        raw_bytes(stored, row.log_id)
    raw.put(stored, LogFile(ferry.csv))
    assert raw_bytes(stored, row.log_id) == ferry.csv


def test_a_table_that_is_lost_whole_is_named_and_repaired(bucket: Bucket, ferry: Ship, tmp_path: Path) -> None:
    warehouse = taken_in(Warehouse(f"{bucket.uri}/lost", bucket.settings), ferry, tmp_path)
    found = segments.current(warehouse)
    for name in ("vessels", "segments"):
        for path in warehouse.paths_below(name):
            warehouse.delete(name, *path.split("/"))
    assert [one.words for one in verify(warehouse)] == ["The table vessels is gone.", "The table segments is gone."]
    with pytest.raises(KempfError, match="The table segments is gone"):
        segments.current(warehouse)
    done = repair(warehouse)
    assert done.left == [] and verify(warehouse) == []
    assert segments.current(warehouse) == found != []


def test_what_cannot_be_reached_is_one_clear_error_that_may_pass(bucket: Bucket) -> None:
    off = {**bucket.settings, "AWS_ENDPOINT_URL": "http://127.0.0.1:1"}
    for address, options in (("s3://fleet/stored", off), ("s3://no-such-bucket/x", bucket.settings)):
        warehouse = Warehouse(address, options)
        with pytest.raises(KempfError) as caught:
            vessels.register(warehouse, "ferry", VesselProfile(vessel="ferry"))
        assert caught.value.code in ("warehouse_unreachable", "warehouse_not_writable"), caught.value
        assert "testing" not in json.dumps(caught.value.as_json())
    with pytest.raises(NotFound, match="no warehouse"):
        vessels.names(Warehouse(f"{bucket.uri}/empty", bucket.settings))


def test_compaction_and_vacuum_keep_in_a_bucket_what_they_keep_in_a_folder(bucket: Bucket) -> None:
    warehouse = Warehouse(f"{bucket.uri}/compacted", bucket.settings)
    moments = []
    for i in range(3):
        asked = inputs(start_utc_ns=START_NS + i)
        stated = {"table_versions": delta.versions(warehouse) if i else {}}
        parameter_sets.insert(warehouse, [parameter_set("aurora", asked, provenance=stated)])
        runs.record_all(warehouse, [runs.FlowRun("run-1", "test", None, str(i))])
        moments.append(datetime.now(UTC))
    pins = compaction.pinned(warehouse)["runs"]
    then = [delta.read(warehouse, "runs", version=v).rows() for v in pins]
    assert len(then) == 2 and "runs" in delta.versions(warehouse)
    assert compaction.compact(warehouse, more_files_than=1) == ("parameter_sets",)
    for i in range(2):
        runs.record_all(warehouse, [runs.FlowRun("run-1", "test", None, f"later {i}")])
    time.sleep(1.1)  # a bucket gives the age of an object in whole seconds
    said = {one.table: one.files for one in compaction.vacuum(warehouse, 0.0, dry_run=True)}
    done = {one.table: one.files for one in compaction.vacuum(warehouse, 0.0)}
    assert done == said == {"parameter_sets": 0, "runs": 2, "raw": 0}
    assert [delta.read(warehouse, "runs", version=v).rows() for v in pins] == then
    assert [run.status for run in runs.all_runs(warehouse)] == ["later 1"]
    found = [sets_by(warehouse, moment) for moment in moments]
    assert found == [1, 2, 3]


def sets_by(warehouse: Warehouse, moment: datetime) -> int:
    version = delta.version_as_of(warehouse, "parameter_sets", moment)
    return delta.read(warehouse, "parameter_sets", version=version).height


def test_an_inbox_in_a_bucket(bucket: Bucket, ferry: Ship, tmp_path: Path) -> None:
    place = Warehouse(f"{bucket.uri}/arrivals", bucket.settings)
    place.write_bytes(yaml.safe_dump(ferry.profile).encode(), "ferry", "profile.yaml")
    place.write_bytes(ferry.csv, "ferry", "day.csv.gz")
    place.write_bytes(ferry.nmea, "fery", "next.nmea.gz")
    warehouse = Warehouse(str(tmp_path / "w"), bucket.settings)
    folder = SourceFolder(place.uri, bucket.settings)
    run = take_inbox(warehouse, folder, settle_s=0.0)
    assert [one.path for one in run.ingested] == [f"{place.uri}/ferry/day.csv.gz"]
    assert [(one.address, one.code) for one in run.quarantined] == [(f"{place.uri}/fery/next.nmea.gz", "no_vessel")]
    # now that there is a ship whose name is like it, the reason says so
    (held,) = take_inbox(warehouse, folder, settle_s=0.0).quarantined
    assert "like it: 'ferry'" in str(held.message)
    assert take_inbox(warehouse, folder, settle_s=0.0).known == 2
    assert release(warehouse, "next.nmea.gz", "ferry").outcome == "new"
    with pytest.raises(NotFound, match="no folder"):
        take_inbox(warehouse, SourceFolder(f"{bucket.uri}/nothing", bucket.settings))
    with pytest.raises(KempfError) as found:
        take_inbox(warehouse, SourceFolder("s3://no-such-bucket/x", bucket.settings))
    assert found.value.code in ("no_inbox", "inbox_unreadable")


def test_a_log_is_purged_from_a_bucket(bucket: Bucket, ferry: Ship, tmp_path: Path) -> None:
    place = taken_in(Warehouse(f"{bucket.uri}/purged", bucket.settings), ferry, tmp_path)
    (row,) = logs.current(place)
    # of earlier versions, too: what compaction put together lies beside what it was put together from
    compaction.compact(place, 1)
    assert any(row.log_id in path for path in place.paths_below("raw"))
    receipt = purge(place, row.log_id, "end of the charter")
    assert receipt.readings > 1000 and purges.of_logs(place) == {row.log_id: receipt}
    assert raw.kept(place) == []
    assert [path.rpartition("/")[2] for path in place.paths_below("raw")] == [f"{row.log_id}{purges.NOTE}"]
    for table in ("readings", "rejected", "lost", "examinations"):
        assert delta.read(place, table).height == 0
        for path in place.paths_below(table):
            if path.endswith(".parquet") and not path.startswith("_delta_log"):
                with place.opened(table, *path.split("/")) as stream:
                    assert stream is not None and row.ingest_id not in set(pl.read_parquet(stream)["ingest_id"])
    (refused,) = ingest(place, [tmp_path / "ferry.csv.gz"], given=VesselProfile.model_validate(ferry.profile))
    assert refused.error is not None and refused.error.code == "log_purged"


def test_an_earlier_warehouse_is_brought_forward_in_a_bucket(
    bucket: Bucket, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with tarfile.open(ROOT / "tests" / "workbench" / "earlier_warehouse.tar.xz") as packed:
        packed.extractall(tmp_path, filter="data")
    warehouse = Warehouse(f"{bucket.uri}/earlier", bucket.settings)
    top = tmp_path / "warehouse"
    for path in sorted(path for path in top.rglob("*") if path.is_file()):
        warehouse.write_bytes(path.read_bytes(), *path.relative_to(top).parts)
    with pytest.raises(KempfError, match="works with layout 4"):
        logs.current(warehouse)
    place = chain.forward(warehouse)
    before = commits.contents(place, "readings", None, by="ingest_id", without="month")
    monkeypatch.setattr(by_month, "MOST_LOGS", 1)
    with monkeypatch.context() as cut_off:
        # another process compacts the table after the first log
        count, commit = [0], commits.append_alone

        def overtaken(*arguments: Any, **named: Any) -> None:
            count[0] += 1
            if count[0] == 3:
                table = delta.open_table(place, "readings")
                assert table is not None
                rows = delta.rows(table, "readings")
                delta.replace(table, "readings", iter([rows]), "month = '2025-05'")
            commit(*arguments, **named)

        cut_off.setattr(commits, "append_alone", overtaken)
        with pytest.raises(KempfError) as caught:
            chain.migrate(warehouse, lambda done, total, what: None)
    assert caught.value.code == "warehouse_busy"
    with pytest.raises(KempfError, match="not finished"):
        logs.current(Warehouse(warehouse.uri, bucket.settings))
    said = chain.migrate(warehouse, lambda done, total, what: None)
    assert said[0] == "readings: 2 ingests have the same rows as before."
    assert "readings: 1 vessel has the same rows as before." in said[1:] and len(before) == 2
    table = delta.open_table(warehouse, "readings")
    partition = f"/vessel_key={vessel_key('ferry')}/month=2025-05/"
    assert table is not None and all(partition in uri for uri in table.file_uris())
    assert verify(warehouse) == [] and warehouse.marker() == Marker(LAYOUT)
    assert [readings.read(warehouse, row.ingest_id).height for row in logs.current(warehouse)] == [
        count for count, _, _ in before.values()
    ]
