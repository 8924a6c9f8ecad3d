"""The Prefect flows, run for real on a small fleet against a server of their own."""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest

from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, logs, parameter_sets, runs, segments, vessels
from tests.conftest import Ship
from tests.flows.content import fresh, versions

FLEET = ("ferry", "mariner", "tramp")


@pytest.fixture(scope="module", autouse=True)
def _server() -> Iterator[None]:
    import_module("kempf.flows.fleet.flows")  # first: it sets what Prefect reads when it is imported
    from prefect.testing.utilities import prefect_test_harness

    with prefect_test_harness(server_startup_timeout=180):
        yield


@pytest.fixture(scope="module")
def fleet(mariner: Ship, ferry: Ship, tmp_path_factory: pytest.TempPathFactory) -> Warehouse:
    """Three vessels, a log each, taken in by the flow and identified by reprocessing."""
    from kempf.flows.fleet.arrivals import LogsFailed
    from kempf.flows.fleet.flows import ingest, reprocess

    folder = tmp_path_factory.mktemp("fleet")
    mariner.write(folder / "mariner")
    ferry.write(folder / "ferry")
    (folder / "tramp.nmea").write_bytes(b"".join(mariner.lines)[:-1])  # other bytes, so another log
    place = str(folder / "w")
    for name in ("mariner", "ferry"):
        outcomes = ingest([str(folder / name / f"{name}.csv.gz")], place, None, [str(folder / name / "profile.yaml")])
        assert [one["outcome"] for one in outcomes] == ["new"]
    tramp = folder / "tramp.yaml"
    tramp.write_text("vessel: tramp\n", encoding="utf-8")
    with pytest.raises(LogsFailed, match="1 of 2 logs could not be taken in: none: ") as failed:
        ingest([str(folder / "tramp.nmea"), str(folder / "none")], place, None, [str(tramp)])
    assert [one["outcome"] for one in failed.value.details["outcomes"]] == ["new", "failed"]
    reports = reprocess(place)
    assert [(r["vessel"], r["status"], r["new_sets"]) for r in reports] == [(name, "changed", 1) for name in FLEET]
    return Warehouse(place)


@pytest.fixture
def own(fleet: Warehouse, tmp_path: Path) -> Warehouse:
    assert fleet.folder is not None
    return fresh(copytree(fleet.folder, tmp_path / "w"))


def tables_of(key: str) -> list[list[dict[str, Any]]]:
    """The rows of every table artifact with a key, the latest first."""
    from prefect.client.orchestration import get_client
    from prefect.client.schemas.filters import ArtifactFilter, ArtifactFilterKey
    from prefect.client.schemas.sorting import ArtifactSort

    with get_client(sync_client=True) as client:
        wanted = ArtifactFilter(key=ArtifactFilterKey(any_=[key]))
        found = client.read_artifacts(artifact_filter=wanted, sort=ArtifactSort.CREATED_DESC)
    assert {one.type for one in found} == {"table"}
    return [json.loads(one.data) if isinstance(one.data, str) else one.data for one in found]


def summary_of_last_run() -> str:
    """The text of the latest summary."""
    from prefect.client.orchestration import get_client
    from prefect.client.schemas.filters import ArtifactFilter, ArtifactFilterKey
    from prefect.client.schemas.sorting import ArtifactSort

    with get_client(sync_client=True) as client:
        wanted = ArtifactFilter(key=ArtifactFilterKey(any_=["kempf-fleet"]))
        found = client.read_artifacts(artifact_filter=wanted, sort=ArtifactSort.CREATED_DESC, limit=1)
    return str(found[0].data)


def test_every_flow_leaves_a_table(fleet: Warehouse):
    rows = [row for table in tables_of("kempf-ingest") for row in table]
    assert {(row["log"], row["outcome"]) for row in rows} >= {("tramp.nmea", "new"), ("none", "failed")}
    assert next(row for row in rows if row["log"] == "none")["error"]
    (table,) = [t for t in tables_of("kempf-reprocess") if t[0]["status"] == "changed"][-1:]
    assert [(row["vessel"], row["failures"]) for row in table] == [(name, "") for name in FLEET]


def test_identify_as_a_flow(own: Warehouse):
    from kempf.flows.fleet.flows import identify

    rows = identify("ferry", own.uri, "least-squares")
    assert [(row["converged"], row["error"]) for row in rows] == [(True, "")]
    stored = parameter_sets.get(own, rows[0]["parameter_set"])
    assert stored.estimator == "least-squares"
    assert stored.provenance["flow_run"]
    assert tables_of("kempf-identify")[0][0]["parameter_set"] == rows[0]["parameter_set"]


def test_a_second_run_changes_nothing_but_the_runs(own: Warehouse):
    from kempf.flows.fleet.flows import reprocess

    at = versions(own)
    reports = reprocess(own.uri)
    assert [(r["vessel"], r["status"], r["kept_sets"]) for r in reports] == [(n, "unchanged", 1) for n in FLEET]
    assert versions(own) == at
    assert {run.status for run in runs.all_runs(own)} == {"unchanged"}


def test_a_changed_profile_concerns_her_alone(own: Warehouse):
    from kempf.flows.fleet.flows import reprocess

    before = {row.log_id: row.ingest_id for row in logs.current(own)}
    vessels.register(own, "ferry", vessels.current(own, "ferry").model_copy(update={"wind_arm_per_m": 0.001}))
    reports = {r["vessel"]: r for r in reprocess(own.uri)}
    assert [(n, reports[n]["status"], reports[n]["reread"], reports[n]["new_sets"]) for n in FLEET] == [
        ("ferry", "changed", 1, 1),
        ("mariner", "unchanged", 0, 0),
        ("tramp", "unchanged", 0, 0),
    ]
    changed = {row.vessel for row in logs.current(own) if row.ingest_id != before[row.log_id]}
    assert changed == {"ferry"}
    assert len(segments.current(own)) == 3


def test_a_damaged_raw_copy_is_reported_and_the_others_are_done(own: Warehouse):
    from kempf.flows.fleet.flows import reports_of, reprocess
    from kempf.flows.fleet.report import VesselsFailed

    damage(own, "mariner")
    for name in FLEET:
        profile = vessels.current(own, name).model_copy(update={"wind_arm_per_m": 0.002})
        vessels.register(own, name, profile)
    reports = {r["vessel"]: r for r in reports_of(own.uri, changed_only=False)}
    assert {n: r["status"] for n, r in reports.items()} == {"ferry": "changed", "mariner": "failed", "tramp": "changed"}
    failures = {row["vessel"]: row["failures"] for row in tables_of("kempf-reprocess")[0]}
    assert (failures["ferry"], failures["tramp"]) == ("", "") and "is damaged" in failures["mariner"]
    codes = {failure["error"]["code"] for failure in reports["mariner"]["failures"]}
    assert codes == {"raw_bytes_damaged"}
    assert reports["mariner"]["failures"][0]["error"]["next_step"]
    assert [reports[n]["new_sets"] for n in ("ferry", "tramp")] == [1, 1]
    assert {n: r["verified"] for n, r in reports.items()} == {
        "ferry": {"bit-identical": 2},
        "mariner": {},
        "tramp": {"bit-identical": 2},
    }
    assert [run.vessel for run in runs.all_runs(own, "reprocess") if run.status == "failed"] == ["mariner"]
    # the run itself ends as Failed and says whom to look at, every night until she is mended
    for _ in range(2):
        with pytest.raises(VesselsFailed, match="3 vessels: 1 failed, 2 unchanged; look at mariner"):
            reprocess(own.uri)
    assert "Ingest the original file again" in summary_of_last_run()


def damage(warehouse: Warehouse, vessel: str) -> None:
    assert warehouse.folder is not None
    (row,) = logs.current(warehouse, vessel)
    kept = warehouse.folder / "raw" / row.log_id[:2] / row.log_id
    kept.write_bytes(kept.read_bytes()[:-10])


def test_the_batch_goes_on_behind_a_fault_of_our_own(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    from kempf.flows.fleet.flows import reports_of
    from kempf.flows.jobs.reprocess import reprocess_vessel

    def one(warehouse: Warehouse, vessel: str, *rest: Any) -> Any:
        if vessel == "ferry":
            raise ZeroDivisionError("division by zero")
        return real(warehouse, vessel, *rest)

    real = reprocess_vessel._requests
    monkeypatch.setattr(reprocess_vessel, "_requests", one)
    vessels.register(own, "ferry", vessels.current(own, "ferry").model_copy(update={"wind_arm_per_m": 0.003}))
    reports = reports_of(own.uri, ["tramp", "ferry", "ferry"])
    assert [(r["vessel"], r["status"]) for r in reports] == [("ferry", "failed"), ("tramp", "unchanged")]
    assert "ZeroDivisionError" in reports[0]["failures"][0]["error"]["message"]


def test_a_fleet_of_none(tmp_path: Path):
    from kempf.flows.fleet.flows import reprocess
    from kempf.schemas.errors import NotFound

    warehouse = fresh(tmp_path / "w")
    with pytest.raises(NotFound, match="no warehouse"):
        reprocess(warehouse.uri)
    warehouse.create()
    assert reprocess(warehouse.uri) == []


def test_the_command_runs_the_flow_and_prints_one_document(own: Warehouse):
    from tests.workbench.driving import kempf

    output = kempf("reprocess", "--warehouse", own.uri, "--json")
    assert output.code == 0, output
    assert [r["vessel"] for r in output.json] == list(FLEET)
    damage(own, "ferry")
    failed = kempf("reprocess", "--vessel", "ferry", "--vessel", "tramp", "--everything", "--warehouse", own.uri)
    assert failed.code == 3
    assert "ferry, ps-" in failed.err and "damaged" in failed.err
    assert "\x1b" not in failed.out


def test_the_fleet_is_diagnosed_as_a_flow(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    from kempf.flows.fleet.flows import diagnose
    from kempf.schemas import effects

    few = {name: effects.catalogue()[name] for name in ("rudder_lag", "cross_flow_drag")}
    monkeypatch.setattr(effects, "catalogue", lambda: few)
    before = {name: aliases.of_vessel(own, name) for name in FLEET}
    rows = diagnose(own.uri)
    # one manoeuvre each: nothing can be held against another
    assert [(row["vessel"], row["verdict"], row["effects"]) for row in rows] == [
        (name, "insufficient_data", "") for name in FLEET
    ]
    assert [row["vessel"] for row in tables_of("kempf-diagnose")[0]] == list(FLEET)
    assert {name: aliases.of_vessel(own, name) for name in FLEET} == before, "a diagnosis recommends and moves nothing"
