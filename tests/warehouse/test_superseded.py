"""A set whose log was read anew since is superseded: out of the history by default, and still there."""

from __future__ import annotations

from pathlib import Path

from kempf.flows.jobs.identify.identify_vessel import identify_vessel
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.warehouse.queries import history
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels


def test_a_new_profile_supersedes_and_the_past_stays(tmp_path: Path) -> None:
    settings = zigzag_settings("ferry", duration_s=400.0, steady_s=60.0)
    log = tmp_path / "day.mcap"
    log.write_bytes(to_mcap(simulate_trial(settings)))
    warehouse, profile = Warehouse(str(tmp_path / "warehouse")), logger_profile(settings)
    ingest(warehouse, [log], given=profile)
    first = [o.parameter_set.parameter_set_id for o in identify_vessel(warehouse, "ferry") if o.parameter_set]
    assert len(first) == 1
    assert [r["superseded"] for r in history.of_vessel(warehouse, "ferry", "b2").rows()] == [False]

    vessels.register(warehouse, "ferry", profile.model_copy(update={"wind_arm_per_m": 0.01}))
    assert reprocess_vessel(warehouse, "ferry").new_sets == 1
    now = history.of_vessel(warehouse, "ferry", "b2").rows()
    assert len(now) == 1
    assert now[0]["parameter_set_id"] != first[0]
    every = history.of_vessel(warehouse, "ferry", "b2", superseded=True).rows()
    assert [(r["parameter_set_id"], r["superseded"]) for r in every] == [
        (first[0], True),
        (now[0]["parameter_set_id"], False),
    ]
    assert delta.versions(warehouse)["parameter_sets"] >= 2
