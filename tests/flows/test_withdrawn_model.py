"""The model of a vessel whose current set was withdrawn or is lost: it stays hers until a person chooses another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from kempf.flows.jobs.corrections.remove_logs import rename_vessel
from kempf.flows.jobs.identify.chosen_set import chosen_set
from kempf.flows.jobs.identify.pending import PendingSets
from kempf.flows.jobs.identify.standing_model import POOLED, standing_model, undo
from kempf.flows.jobs.ingest.ingest_logs import ingest_log
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.vessel_report import VesselReport
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.readings import Tally
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.schemas.errors import NotFound
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.queries.standing import standing_ids
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, logs, parameter_sets, segments, vessels
from kempf.warehouse.tables.logs import LogRow
from kempf.warehouse.tables.parameter_set import ParameterSet, parameter_set_id
from tests.warehouse import samples

PLAIN = ModelSpec()
LAGGING = ModelSpec(effects=("rudder_lag",))


def of_model(spec: ModelSpec, vessel: str = "aurora") -> ParameterSet:
    made_of = samples.inputs(model_spec=spec.model_dump(mode="json"), estimator=POOLED, settings={"segments": []})
    return samples.parameter_set(vessel, made_of, model_sha256=spec.sha256, fit={"rung": {}})


@pytest.fixture
def warehouse(tmp_path: Path) -> Warehouse:
    """A vessel whose current model has an effect."""
    made = Warehouse(str(tmp_path / "warehouse"))
    vessels.register(made, "aurora", VesselProfile(vessel="aurora", length_m=100.0))
    parameter_sets.insert(made, [of_model(LAGGING)])
    aliases.point(made, "aurora", of_model(LAGGING).parameter_set_id)
    return made


def test_a_withdrawn_model_is_not_replaced_by_the_plain_one(warehouse: Warehouse) -> None:
    aliases.withdraw(warehouse, "aurora")
    waiting = PendingSets(warehouse, "aurora")
    assert not waiting.may_move(PLAIN, adopt=True)
    assert waiting.may_move(LAGGING, adopt=False)
    assert standing_model(warehouse, "aurora")[0] == LAGGING
    with pytest.raises(NotFound) as refused:
        undo(warehouse, "aurora")
    assert refused.value.code == "no_parameter_set" and "withdrawn" in refused.value.details


def test_a_model_whose_set_is_lost_is_replaced_only_where_a_person_asks(warehouse: Warehouse) -> None:
    aliases.point_all(warehouse, {("aurora", aliases.CURRENT): "ps-" + "0" * 16})
    waiting = PendingSets(warehouse, "aurora")
    assert not waiting.may_move(PLAIN, adopt=False)
    assert waiting.may_move(PLAIN, adopt=True)


def test_a_renamed_vessel_has_the_model_that_she_had(warehouse: Warehouse) -> None:
    name = of_model(LAGGING).parameter_set_id
    aliases.point_all(warehouse, {("boreas", aliases.WITHDRAWN): name})
    assert standing_model(warehouse, "boreas")[0] == LAGGING
    assert not PendingSets(warehouse, "boreas").may_move(PLAIN, adopt=False)


def test_a_rename_hands_the_model_on(warehouse: Warehouse) -> None:
    rename_vessel(warehouse, "aurora", "boreas", "sold")
    assert standing_model(warehouse, "boreas")[0] == LAGGING
    assert "aurora" not in vessels.profiles(warehouse)
    assert chosen_set(warehouse, "boreas", aliases.WITHDRAWN)[0].vessel == "aurora"
    with pytest.raises(NotFound, match="earlier name, 'aurora'") as none:
        chosen_set(warehouse, "boreas")
    assert "kempf reprocess --vessel boreas" in none.value.next_step


def test_a_rename_ends_also_where_what_the_model_brings_forward_is_lost(warehouse: Warehouse) -> None:
    before = {"set": "ps-" + "0" * 16, "manoeuvres": 16, "fitted_at_once": 16}
    made_of = samples.inputs(estimator=POOLED, settings={"segments": [], "updates": before})
    parameter_sets.insert(warehouse, [samples.parameter_set("aurora", made_of)])
    aliases.point_all(warehouse, {("aurora", aliases.CURRENT): parameter_set_id(made_of)})
    rename_vessel(warehouse, "aurora", "boreas", "sold")
    assert aliases.of_vessel(warehouse, "boreas") == {aliases.WITHDRAWN: parameter_set_id(made_of)}
    assert "aurora" not in vessels.profiles(warehouse)


def test_a_night_says_that_the_model_is_lost_and_leaves_it_so(tmp_path: Path) -> None:
    settings = zigzag_settings("ferry", duration_s=300.0, steady_s=40.0)
    own = Warehouse(str(tmp_path / "warehouse"))
    log = LogFile(to_csv(simulate_trial(settings), rate_hz=2.0))
    ingest_log(own, "ferry", "day.csv.gz", log, logger_profile(settings), "ferry")
    first = reprocess_vessel(own, "ferry")
    assert first.status == "changed" and first.current == aliases.of_vessel(own, "ferry")[aliases.CURRENT]
    assert reprocess_vessel(own, "ferry").status == "unchanged"
    lost = "ps-" + "0" * 16
    aliases.point_all(own, {("ferry", aliases.CURRENT): lost})
    for _ in range(2):
        report = reprocess_vessel(own, "ferry")
        (failure,) = report.failures
        assert failure["error"]["code"] == "model_lost" and lost in failure["error"]["message"]
        assert aliases.of_vessel(own, "ferry") == {aliases.WITHDRAWN: lost}


def test_a_report_says_changed_where_only_the_current_set_is_another() -> None:
    assert VesselReport("aurora").status == "unchanged"
    assert VesselReport("aurora", current="ps-1").status == "changed"
    assert VesselReport("aurora", withdrawn="ps-1").status == "changed"


def test_logs_in_which_nothing_is_found_are_named_as_the_reason(warehouse: Warehouse) -> None:
    aliases.withdraw(warehouse, "aurora")
    with pytest.raises(NotFound, match="no manoeuvre is found") as none:
        chosen_set(warehouse, "aurora")
    assert "kempf doctor" in none.value.next_step and "kempf reprocess" not in none.value.next_step


def test_of_a_log_and_its_beginning_one_pooled_set_stands(warehouse: Warehouse) -> None:
    """The log was read while it was still being written, and again when it was whole."""
    second_ns = 1_000_000_000
    executes = tuple(samples.START_NS + k * 60 * second_ns for k in range(1, 6))
    rows, found = [], {}
    for log, last in (("cut", 3), ("whole", 5), ("other", 5)):
        log_id = log[0] * 64
        late = 86_400 * second_ns if log == "other" else 0
        made = samples.segment("aurora", log_id, log, samples.START_NS + late)
        times = tuple(at + late for at in executes[:last])
        found[log] = replace(
            made,
            segment_id=f"seg-{log}",
            end_utc_ns=times[-1] + 30 * second_ns,
            executes_utc_ns=times,
            imo={},
            quality={},
        )
        row = (log_id, log, "aurora", f"{log}.csv", "delimited", 1, "b" * 64, samples.CODE)
        rows.append(LogRow(*row, times[0], times[-1], Tally()))
    logs.record(warehouse, rows)
    segments.replace(warehouse, {("aurora", name): [segment] for name, segment in found.items()})

    def pooled(*names: str) -> ParameterSet:
        ids = [found[name].segment_id for name in names]
        made_of = samples.inputs(
            estimator=POOLED, settings={"segments": ids}, log_ids=tuple(found[n].log_id for n in names)
        )
        return samples.parameter_set("aurora", made_of, segment_ids=tuple(ids))

    early, late = pooled("cut", "other"), pooled("whole", "other")
    parameter_sets.insert(warehouse, [early])
    assert early.parameter_set_id in standing_ids(warehouse, "aurora")
    parameter_sets.insert(warehouse, [late])
    standing = standing_ids(warehouse, "aurora")
    assert late.parameter_set_id in standing and early.parameter_set_id not in standing
