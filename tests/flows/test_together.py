"""Vessels that are brought up to date together share their commits, and nothing else."""

from __future__ import annotations

import gzip
from dataclasses import replace
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest

from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
from kempf.flows.jobs.ingest.ingest_logs import ingest_log
from kempf.flows.jobs.reprocess import reprocess_vessel as job
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel, reprocess_vessels
from kempf.pipeline.ingest.log_file import LogFile
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets, runs, segments, vessels
from tests.conftest import Ship
from tests.flows.content import RUNS, fresh, seen

FLEET = ["cutter", "ferry", "sloop"]
QUICK = Request(estimator="least-squares")


@pytest.fixture(scope="module")
def stocked(ferry: Ship, tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("together") / "w"
    rows = gzip.decompress(ferry.csv)
    for k, name in enumerate(FLEET):
        profile = VesselProfile.model_validate({**ferry.profile, "vessel": name})
        data = gzip.compress(rows, compresslevel=k + 1, mtime=0)  # other bytes, so another log
        assert ingest_log(fresh(place), name, f"{name}.csv.gz", LogFile(data), profile, name).outcome == "new"
    return place


@pytest.fixture
def own(stocked: Path, tmp_path: Path) -> Warehouse:
    return fresh(copytree(stocked, tmp_path / "w"))


def touch(warehouse: Warehouse) -> None:
    found = [(name, vessels.current(warehouse, name)) for name in FLEET]
    vessels.register_all(warehouse, [(n, p.model_copy(update={"wind_arm_per_m": 0.003})) for n, p in found])


def test_one_commit_a_table_and_what_each_alone_would_make(own: Warehouse, tmp_path: Path) -> None:
    assert own.folder is not None
    alone = fresh(copytree(own.folder, tmp_path / "alone"))
    for warehouse in (own, alone):
        touch(warehouse)
    before = delta.versions(own)
    together = reprocess_vessels(own, FLEET)
    after = delta.versions(own)
    assert [(r.vessel, r.status, r.reread, r.new_sets) for r in together] == [(v, "changed", 1, 1) for v in FLEET]
    written = ("logs", "readings", "rejected", "segments", "examinations", "parameter_sets", "aliases", *RUNS)
    # a table that was not there is made by a commit of its own
    made = {name: after[name] - before.get(name, 0) for name in after if name != "vessels"}
    assert made == dict.fromkeys(written, 1)
    assert [reprocess_vessel(alone, name).as_json() for name in FLEET] == [report.as_json() for report in together]
    assert seen(alone) == seen(own)
    assert runs.all_runs(alone) == runs.all_runs(own)
    assert [r.status for r in reprocess_vessels(own, FLEET)] == ["unchanged"] * 3


@pytest.mark.parametrize("step", ["stale_logs", "identify_segments", "_withdraw"])
def test_one_that_fails_at_any_step_takes_no_other_with_her(own: Warehouse, monkeypatch: Any, step: str) -> None:
    real = getattr(job, step)

    def failing(warehouse: Warehouse, vessel: str, *rest: Any, **named: Any) -> Any:
        if vessel == "ferry":
            raise ZeroDivisionError(step)
        return real(warehouse, vessel, *rest, **named)

    with monkeypatch.context() as patched:
        patched.setattr(job, step, failing)
        reports = reprocess_vessels(own, FLEET, QUICK)
    assert [(r.status, r.new_sets) for r in reports][::2] == [("changed", 1)] * 2
    assert reports[1].status == "failed" and step in reports[1].failures[0]["error"]["message"]
    assert {one.vessel: one.status for one in runs.all_runs(own)}["ferry"] == "failed"
    again = reprocess_vessel(own, "ferry", QUICK)
    assert (again.failures, again.new_sets + again.kept_sets) == ([], 1)


def test_a_set_that_cannot_be_stored_is_reported_for_its_vessel_alone(own: Warehouse, tmp_path: Path) -> None:
    assert own.folder is not None
    elsewhere = fresh(copytree(own.folder, tmp_path / "elsewhere"))
    (there,) = identify_vessel(elsewhere, "ferry", QUICK)
    assert there.parameter_set is not None
    real = parameter_sets.insert

    def late(warehouse: Warehouse, sets: Any) -> Any:
        """Another process stores the same set with another content right before."""
        made = there.parameter_set
        assert made is not None
        if made.parameter_set_id not in set(parameter_sets.summaries(warehouse)["parameter_set_id"]):
            real(warehouse, [replace(made, convergence={"converged": "perhaps"})])
        return real(warehouse, sets)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(parameter_sets, "insert", late)
        reports = reprocess_vessels(own, FLEET, QUICK)
    assert [(r.status, r.new_sets) for r in reports] == [("changed", 1), ("failed", 0), ("changed", 1)]
    assert [f["error"]["code"] for f in reports[1].failures] == ["parameter_set_differs"]
    assert parameter_sets.summaries(own).height == 3


def test_what_was_identified_is_kept_where_it_is_interrupted(own: Warehouse, monkeypatch: Any) -> None:
    real = job.identify_segments

    def interrupted(warehouse: Warehouse, vessel: str, *rest: Any, **named: Any) -> Any:
        if vessel == "sloop":
            raise KeyboardInterrupt
        return real(warehouse, vessel, *rest, **named)

    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr(job, "identify_segments", interrupted)
        reprocess_vessels(own, FLEET, QUICK)
    assert parameter_sets.summaries(own)["vessel"].to_list() == ["cutter", "ferry"]
    reports = reprocess_vessels(own, FLEET, QUICK)
    assert [(r.new_sets, r.kept_sets) for r in reports] == [(0, 1), (0, 1), (1, 0)]


def test_current_stays_with_the_first_of_two_models_that_wait_together(own: Warehouse) -> None:
    found = {}
    for name in ("first", "second"):
        (outcome,) = identify_vessel(own, "ferry", Request(ModelSpec(name=name)))
        assert outcome.parameter_set is not None
        found[name] = outcome.parameter_set
    aliases.point(own, "ferry", found["first"].parameter_set_id)
    touch(own)
    (report,) = reprocess_vessels(own, ["ferry"])
    assert (report.new_sets, report.withdrawn) == (2, None)
    now = parameter_sets.get(own, aliases.of_vessel(own, "ferry")["current"])
    assert now.model_spec["name"] == "first"
    (segment,) = segments.current(own, "ferry")
    assert now.provenance["ingest_ids"] == [segment.ingest_id]
