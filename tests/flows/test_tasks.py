"""The tasks of the flows as plain functions: no server is needed to know what they do."""

from __future__ import annotations

from pathlib import Path

from kempf.warehouse.tables import parameter_sets
from tests.flows.content import fresh


def test_the_tasks_do_the_jobs(harbour: Path, tmp_path: Path):
    from kempf.flows.fleet.flows import identify_task, ingest_batch

    place, profile = str(tmp_path / "w"), str(harbour / "profile.yaml")
    paths = [str(harbour / "mariner.mcap"), str(tmp_path / "none")]
    first, second = ingest_batch.fn(place, paths, None, [profile])
    assert (first["outcome"], second["outcome"]) == ("new", "failed")
    assert second["error"]["code"] == "no_such_file"
    (row,) = identify_task.fn(place, "mariner", "least-squares", {"name": "mine"})
    assert row["segment"] == first["segments"][0]
    stored = parameter_sets.get(fresh(tmp_path / "w"), row["parameter_set"])
    assert (stored.model_name, stored.provenance["flow_run"]) == ("mine", None)
