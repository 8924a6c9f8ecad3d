from __future__ import annotations

from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import runs


def test_a_run_is_stored_as_it_stands(warehouse: Warehouse) -> None:
    name = runs.run_id("ingest", {"logs": ["a"]})
    assert name == runs.run_id("ingest", {"logs": ("a",)})
    assert name != runs.run_id("identify", {"logs": ["a"]})
    assert runs.record_all(warehouse, [runs.FlowRun(name, "ingest", None, "running")])
    done = runs.FlowRun(name, "ingest", None, "completed", {"logs": 3}, {"slowest": "day'1", "ratio": float("nan")})
    assert runs.record_all(warehouse, [done])
    version = delta.versions(warehouse)
    assert not runs.record_all(warehouse, [done])
    assert delta.versions(warehouse) == version
    assert runs.all_runs(warehouse) == [done]
    assert done.message["ratio"] is None


def test_runs_are_listed_by_flow(warehouse: Warehouse) -> None:
    for flow in ("identify", "ingest"):
        for vessel in ("x' OR '1'='1", None):
            runs.record_all(warehouse, [runs.FlowRun(runs.run_id(flow, vessel), flow, vessel, "completed")])
    assert len(runs.all_runs(warehouse)) == 4
    assert {run.flow for run in runs.all_runs(warehouse, "ingest")} == {"ingest"}
    assert {run.vessel for run in runs.all_runs(warehouse, "ingest")} == {None, "x' OR '1'='1"}
