"""Who is looked at again, how the work is cut, what is tried again and when a run fails: without an engine."""

from __future__ import annotations

from pathlib import Path
from shutil import copytree
from typing import Any

import pytest

from kempf.flows.fleet import plan as planning
from kempf.flows.fleet import report as fleet_report
from kempf.flows.fleet.plan import Plan, do_batch, do_fleet, lost, plan, to_try_again, together
from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
from kempf.flows.jobs.ingest.ingest_logs import ingest_log
from kempf.flows.jobs.reprocess.vessel_report import VesselReport, run_id_of
from kempf.flows.jobs.state import vessel_state
from kempf.flows.jobs.state.vessel_state import fleet_state as state_of
from kempf.pipeline.ingest.log_file import LogFile
from kempf.schemas.errors import DataRejected, KempfError
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, runs, vessels
from kempf.workbench.web.addresses import of_vessel
from tests.conftest import Ship
from tests.flows.content import fresh, versions

QUICK = Request(estimator="least-squares")


@pytest.fixture(scope="module")
def settled(ferry: Ship, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two vessels that are up to date: one with a log, one without any."""
    warehouse = fresh(tmp_path_factory.mktemp("plan") / "w")
    profile = VesselProfile.model_validate(ferry.profile)
    assert ingest_log(warehouse, "ferry", "day.csv.gz", LogFile(ferry.csv), profile, "day").outcome == "new"
    identify_vessel(warehouse, "ferry", QUICK)
    vessels.register(warehouse, "idle", VesselProfile(vessel="idle", length_m=10.0))
    assert [name for name, _ in plan(warehouse).due] == ["ferry", "idle"]
    reports = do_fleet(warehouse)
    assert [(r["vessel"], r["status"], r["kept_sets"]) for r in reports] == [
        ("ferry", "unchanged", 1),
        ("idle", "unchanged", 0),
    ]
    return Path(warehouse.uri)


@pytest.fixture
def own(settled: Path, tmp_path: Path) -> Warehouse:
    return fresh(copytree(settled, tmp_path / "w"))


def due(warehouse: Warehouse, **named: Any) -> list[str]:
    return [name for name, _ in plan(warehouse, **named).due]


def test_what_was_left_up_to_date_is_not_looked_at(own: Warehouse) -> None:
    at = versions(own)
    found = plan(own)
    assert found.due == () and [r["vessel"] for r in found.kept] == ["ferry", "idle"]
    assert [(r["logs"], r["segments"], r["kept_sets"], r["new_sets"]) for r in found.kept] == [
        (1, 1, 1, 0),
        (0, 0, 0, 0),
    ]
    assert versions(own) == at
    assert due(own, changed_only=False) == ["ferry", "idle"]
    assert due(own, names=["idle", "nobody"]) == ["nobody"]


def test_everything_that_a_result_rests_on_makes_her_due(own: Warehouse, ferry: Ship, monkeypatch: Any) -> None:
    (name,) = state_of(own)["ferry"].set_ids
    aliases.point(own, "ferry", name)
    assert due(own) == ["ferry"]
    do_fleet(own)
    assert due(own) == []
    ingest_log(own, "ferry", "other.nmea.gz", LogFile(ferry.nmea), vessels.current(own, "ferry"), "x")
    assert due(own) == ["ferry"]
    do_fleet(own)
    vessels.register(own, "idle", VesselProfile(vessel="idle", length_m=11.0))
    assert due(own) == ["idle"]
    do_fleet(own)
    assert due(own) == []
    monkeypatch.setattr(vessel_state.code_version, "fingerprint", lambda _: "0" * 16)
    assert due(own) == ["ferry", "idle"]


def test_a_log_that_comes_while_she_is_worked_on_leaves_her_due(own: Warehouse, ferry: Ship, monkeypatch: Any) -> None:
    from kempf.flows.jobs.reprocess import reprocess_vessel

    real = reprocess_vessel._withdraw

    def meanwhile(warehouse: Warehouse, vessel: str, report: VesselReport) -> None:
        real(warehouse, vessel, report)
        ingest_log(own, "ferry", "late.nmea.gz", LogFile(ferry.nmea), vessels.current(own, "ferry"), "late")

    vessels.register(own, "ferry", vessels.current(own, "ferry").model_copy(update={"wind_arm_per_m": 0.009}))
    with monkeypatch.context() as patched:
        patched.setattr(reprocess_vessel, "_withdraw", meanwhile)
        (report,) = do_batch(own, ["ferry"], changed_only=True)
    assert report["status"] == "changed" and due(own) == ["ferry"]
    assert [r["new_sets"] for r in do_fleet(own)] == [1, 0]
    assert due(own) == []


def refuse(monkeypatch: Any, error: KempfError) -> None:
    """Let every vessel but the idle one fail so."""
    from kempf.flows.jobs.reprocess import reprocess_vessel

    real = reprocess_vessel._withdraw

    def failing(warehouse: Warehouse, vessel: str, report: VesselReport) -> None:
        real(warehouse, vessel, report)
        if vessel != "idle":
            report.fail("day.csv.gz", error)

    monkeypatch.setattr(reprocess_vessel, "_withdraw", failing)


def test_refused_data_alarm_once_and_are_not_tried_every_night(own: Warehouse, monkeypatch: Any) -> None:
    refuse(monkeypatch, DataRejected("too_short", "The record is too short.", "Log for longer."))
    vessels.register(own, "ferry", vessels.current(own, "ferry").model_copy(update={"wind_arm_per_m": 0.007}))
    first = do_fleet(own)
    assert [r["status"] for r in first] == ["failed", "unchanged"] and fleet_report.alarming(first[0])
    assert fleet_report.sentence(first) == "2 vessels: 1 failed, 1 unchanged; look at ferry"
    assert due(own) == []
    again = do_fleet(own)
    assert [r["status"] for r in again] == ["failed", "unchanged"] and not any(map(fleet_report.alarming, again))
    assert again[0]["failures"][0]["error"]["next_step"] == "Log for longer."
    assert fleet_report.sentence(again) == "2 vessels: 1 failed, 1 unchanged (1 as the run before)"
    text = fleet_report.markdown(again)
    assert "| ferry | day.csv.gz: The record is too short. | before | Log for longer. |" in text
    assert {run.vessel: run.status for run in runs.all_runs(own, "reprocess")} == {
        "ferry": "failed",
        "idle": "unchanged",
    }


@pytest.mark.parametrize("code", ["warehouse_unreachable", "internal"])
def test_what_may_be_mended_is_tried_again_and_alarms_every_night(own: Warehouse, monkeypatch: Any, code: str) -> None:
    with monkeypatch.context() as patched:
        refuse(patched, KempfError(code, "It did not answer.", "Look at it."))
        for _ in range(2):
            reports = do_fleet(own, ["ferry"], changed_only=False)
            assert fleet_report.alarming(reports[0])
            assert due(own) == ["ferry"]
        assert to_try_again(reports) == (["ferry"] if code == "warehouse_unreachable" else [])
    assert [r["status"] for r in do_fleet(own)] == ["unchanged", "unchanged"]
    assert due(own) == []


def finished(work: list[int], workers: int) -> list[int]:
    """When each worker is done, where each takes the next batch when it has done one."""
    until = [0] * workers
    for logs in work:
        until[until.index(min(until))] += logs
    return until


@pytest.mark.parametrize("workers", [1, 2, 5])
@pytest.mark.parametrize("vessels", [1, 6, 24, 100, 1000])
def test_batches_hold_everybody_once_and_workers_end_together(vessels: int, workers: int) -> None:
    logs_of = {f"v{k:03d}": 1 + k % 7 for k in range(vessels)}
    found = Plan(tuple(sorted(logs_of.items(), key=lambda one: -one[1])), ())
    batches = found.batches(workers)
    assert sorted(name for batch in batches for name in batch) == sorted(logs_of)
    work = [sum(logs_of[name] for name in batch) for batch in batches]
    assert max(work) < planning.LOGS_A_BATCH + 7
    until = finished(work, workers)
    # nobody waits for longer than one of the last batches takes, or a vessel
    assert max(until) - min(until) <= max(work[0] / 4, 7) + 7
    everybody = sum(work)
    # the first batch leaves enough for all to share
    assert work[0] < everybody / workers * 0.5 + 7
    assert len(work) <= everybody / planning.LOGS_A_BATCH + 6 * workers + 1


def test_batches_of_hardly_anything() -> None:
    assert Plan((("c", 900), ("a", 1), ("b", 1)), ()).batches(2) == [["c"], ["a", "b"]]
    idle = tuple((f"v{k}", 0) for k in range(600))
    assert [len(batch) for batch in Plan(idle, ()).batches(2)][:3] == [60, 60, 60]
    mixed = Plan((*((f"w{k}", 5) for k in range(100)), *idle), ()).batches(2)
    assert max(map(len, mixed)) <= 60
    assert Plan((), ()).batches(4) == []


def test_a_lost_batch_is_reported_and_tried_again_and_other_code_is_refused(own: Warehouse) -> None:
    reports = lost(["ferry", "idle"], RuntimeError("worker killed"))
    assert to_try_again(reports) == ["ferry", "idle"] and all(map(fleet_report.alarming, reports))
    first = {**do_batch(own, ["ferry"], changed_only=True)[0], "new_sets": 2, "reread": 1, "kept_sets": 0}
    second = {**first, "status": "unchanged", "new_sets": 0, "reread": 0, "kept_sets": 2}
    assert together(first, second) == {**second, "status": "changed", "new_sets": 2, "reread": 1, "kept_sets": 0}
    at = versions(own)
    refused = do_batch(own, ["ferry"], changed_only=True, code=["another", "version"])
    assert refused[0]["failures"][0]["error"]["code"] == "other_code" and versions(own) == at
    assert do_batch(own, ["ferry"], changed_only=True, code=vessel_state.responsible_code())[0]["failures"] == []


def test_a_large_fleet_has_a_table_of_those_where_something_happened() -> None:
    calm = [VesselReport(f"v{k}").as_json() for k in range(fleet_report.MOST_ROWS)]
    assert len(fleet_report.table(calm)) == fleet_report.MOST_ROWS
    loud = VesselReport("loud", new_sets=1)
    loud.fail("a|b", KempfError("x", "Two\nlines.", "Do."))
    assert [row["vessel"] for row in fleet_report.table([*calm, loud.as_json()])] == ["loud"]
    assert "| loud | a\\|b: Two lines. | this run | Do. |" in fleet_report.markdown([*calm, loud.as_json()])


def test_vessels_of_a_summary_link_to_their_pages() -> None:
    reports = [VesselReport(name) for name in ("Ferry One", "loud")]
    for one in reports:
        one.fail("reading", KempfError("x", "Broken.", "Do."))
    text = fleet_report.markdown([one.as_json() for one in reports], pages="http://ship:8899/")
    assert "| [loud](http://ship:8899/v/loud) | reading: Broken." in text
    assert f"[Ferry One](http://ship:8899{of_vessel('Ferry One')})" in text and "/v/~ferry-one-" in text


def test_a_run_is_remembered_under_one_name(own: Warehouse) -> None:
    names = {run.run_id for run in runs.all_runs(own, "reprocess")}
    assert names == {run_id_of(name, changed_only=True) for name in ("ferry", "idle")}
