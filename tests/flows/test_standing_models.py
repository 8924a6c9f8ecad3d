"""Which models of a vessel are kept up to date, where ``current`` points, and that no result rests on old readings."""

from __future__ import annotations

from pathlib import Path

import pytest

from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.rerun_set import rerun
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.code import code_version
from kempf.warehouse.queries import history
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, logs, parameter_sets, vessels

SETTINGS = zigzag_settings("ferry", duration_s=400.0, steady_s=60.0)
CALM = Request(ModelSpec(name="calm", current="none"))


@pytest.fixture
def ferry(tmp_path: Path) -> tuple[Warehouse, Path, VesselProfile]:
    log = tmp_path / "day.mcap"
    log.write_bytes(to_mcap(simulate_trial(SETTINGS)))
    return Warehouse(str(tmp_path / "warehouse")), log, logger_profile(SETTINGS)


def current_model(warehouse: Warehouse) -> str:
    return parameter_sets.get(warehouse, aliases.of_vessel(warehouse, "ferry")["current"]).model_name


def test_every_model_is_kept_and_current_stays_with_the_chosen_one(ferry) -> None:
    warehouse, log, profile = ferry
    ingest(warehouse, [log], given=profile)
    identify_vessel(warehouse, "ferry")
    assert current_model(warehouse) == "plain"
    identify_vessel(warehouse, "ferry", CALM)
    assert current_model(warehouse) == "calm"
    assert reprocess_vessel(warehouse, "ferry").status == "unchanged"
    assert current_model(warehouse) == "calm"
    vessels.register(warehouse, "ferry", profile.model_copy(update={"wind_arm_per_m": 0.01}))
    assert reprocess_vessel(warehouse, "ferry").new_sets == 2
    assert current_model(warehouse) == "calm"
    assert {row["model"] for row in history.of_vessel(warehouse, "ferry").rows()} == {"plain", "calm"}


def test_current_is_withdrawn_where_its_set_no_longer_stands(ferry) -> None:
    warehouse, log, profile = ferry
    ingest(warehouse, [log], given=profile)
    (outcome,) = identify_vessel(warehouse, "ferry")
    assert outcome.parameter_set is not None
    blind = [
        source.model_copy(
            update={"channels": {k: v for k, v in source.channels.items() if v.channel != "rudder_angle"}}
        )
        for source in profile.sources
    ]
    vessels.register(warehouse, "ferry", profile.model_copy(update={"sources": blind}))
    report = reprocess_vessel(warehouse, "ferry")
    assert (report.segments, report.withdrawn) == (0, outcome.parameter_set.parameter_set_id)
    assert aliases.of_vessel(warehouse, "ferry") == {aliases.WITHDRAWN: report.withdrawn}
    assert reprocess_vessel(warehouse, "ferry").withdrawn is None


def test_readings_of_other_code_are_read_anew_before_anything_is_computed(ferry, monkeypatch) -> None:
    warehouse, log, profile = ferry
    with monkeypatch.context() as before:
        before.setattr(code_version, "fingerprint", lambda _: "0" * 16)
        ingest(warehouse, [log], given=profile)
        assert logs.current(warehouse)[0].code_version == "0" * 16
    (outcome,) = identify_vessel(warehouse, "ferry")
    assert outcome.parameter_set is not None
    assert logs.current(warehouse)[0].code_version == code_version.fingerprint("ingest")
    assert rerun(warehouse, outcome.parameter_set.parameter_set_id).verdict == "bit-identical"
    report = reprocess_vessel(warehouse, "ferry")
    assert (report.status, report.reread, report.kept_sets) == ("unchanged", 0, 1)
    assert len(history.of_vessel(warehouse, "ferry", "b2").rows()) == 1
