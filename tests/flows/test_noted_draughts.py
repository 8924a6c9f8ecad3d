"""Draughts that people note, as the effect of her load takes them, and notes that go where their log or vessel goes."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from pathlib import Path
from shutil import copytree

import pytest

from kempf.flows.jobs.corrections import remove_logs
from kempf.flows.jobs.corrections.notes_of_hers import notes_of_hers
from kempf.flows.jobs.corrections.remove_logs import move, rename_vessel
from kempf.flows.jobs.diagnose.stored_diagnosis import inputs_of_diagnosis
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.ship_model import ship_of_set
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN, inputs_of
from kempf.flows.jobs.identify.vessel_model import store_model
from kempf.flows.jobs.ingest.ingest_logs import ingest_log
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.rerun_set import rerun
from kempf.flows.jobs.state.vessel_state import fleet_state
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.queries.standing import standing_ids
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, logs, notes, parameter_sets, segments, vessels
from kempf.warehouse.tables.parameter_set import ParameterSet
from tests.flows.content import fresh
from tests.workbench.driving import kempf

DAY_NS = 86_400_000_000_000
#: m, of her trials; the second and third are deeper by two tenths
DRAUGHTS = (6.0, 7.2, 7.2, 6.0, 6.0)
#: by which hull and rudder act more at a tenth of the draught deeper
SHARE = 0.1


@pytest.fixture(scope="module")
def sailed(tmp_path_factory: pytest.TempPathFactory) -> Warehouse:
    """Trials of a ferry who is in ballast, laden, in ballast again, and her model with the effect of her load."""
    warehouse = fresh(tmp_path_factory.mktemp("laden") / "w")
    for day, draught in enumerate(DRAUGHTS):
        settings = zigzag_settings("ferry", duration_s=300.0, steady_s=40.0, seed=900 + day)
        acts = 1.0 + SHARE * 10.0 * (draught - DRAUGHTS[0]) / DRAUGHTS[0]
        of_hull = settings.hull.parameters
        scaled = {name: acts * getattr(of_hull, name) for name in ("a11", "a21", "a22", "b1", "b2")}
        settings = replace(
            settings,
            start_utc_ns=settings.start_utc_ns + day * DAY_NS,
            hull=replace(settings.hull, parameters=replace(of_hull, **scaled)),
        )
        data, profile = to_csv(simulate_trial(settings), rate_hz=2.0), logger_profile(settings)
        assert len(ingest_log(warehouse, "ferry", f"day{day}.csv.gz", LogFile(data), profile, "ferry").segments) == 1
    made, _ = store_model(warehouse, choose(warehouse, "ferry"), model(warehouse), NONE_OF_ONES_OWN)
    aliases.point(warehouse, "ferry", made.parameter_set_id)
    reprocess_vessel(warehouse, "ferry")
    return warehouse


@pytest.fixture
def ferry(sailed: Warehouse, tmp_path: Path) -> Warehouse:
    assert sailed.folder is not None
    return Warehouse(str(copytree(sailed.folder, tmp_path / "w")))


def model(warehouse: Warehouse) -> ModelSpec:
    return default_model_of(warehouse, "ferry").model_copy(update={"effects": ("load_condition",)})


def of_load(warehouse: Warehouse) -> ParameterSet:
    return parameter_sets.get(warehouse, aliases.of_vessel(warehouse, "ferry")["current"])


def note_all(warehouse: Warehouse) -> None:
    for row, draught in zip(sorted(logs.current(warehouse), key=lambda row: row.file_name), DRAUGHTS, strict=True):
        notes.add(warehouse, "ferry", "log", row.log_id, "read at the marks", draught_m=draught)


def test_a_model_with_the_load_goes_by_the_draughts_once_every_log_has_one(ferry: Warehouse) -> None:
    by_number, chosen = of_load(ferry), choose(ferry, "ferry")
    assert by_number.model_name.endswith("load_condition") and sorted(chosen.loads.values()) == [
        0.0,
        1.0,
        2.0,
        3.0,
        4.0,
    ]
    assert not inputs_of(chosen, model(ferry), NONE_OF_ONES_OWN).draughts_m
    before = fleet_state(ferry)["ferry"].digest
    note_all(ferry)
    assert fleet_state(ferry)["ferry"].digest != before
    noted = choose(ferry, "ferry")
    assert sorted(noted.loads.values()) == pytest.approx([0.0, 0.0, 0.0, 2.0, 2.0])
    report = reprocess_vessel(ferry, "ferry")
    assert not report.failures
    by_draught = of_load(ferry)
    assert by_draught.parameter_set_id != by_number.parameter_set_id
    assert sorted(by_draught.provenance["inputs"]["draughts_m"].values()) == sorted(DRAUGHTS)
    share = next(one for one in by_draught.parameters if one.name == "load_condition.c")
    assert share.std is not None and share.value is not None
    # known to be there, and as large as it was made
    assert abs(share.value - SHARE) < 3.0 * share.std < SHARE
    assert by_draught.convergence["log_likelihood"] > by_number.convergence["log_likelihood"] + 10.0
    standing = standing_ids(ferry, "ferry")
    assert by_draught.parameter_set_id in standing and by_number.parameter_set_id not in standing
    assert rerun(ferry, by_draught.parameter_set_id).verdict == "bit-identical"
    assert rerun(ferry, by_number.parameter_set_id).verdict == "bit-identical"
    # she is taken to be as in her last trial
    effects = ship_of_set(ferry, by_draught).effects
    assert effects is not None and effects.day == 0.0
    effects = ship_of_set(ferry, by_number).effects
    assert effects is not None and effects.day == 4.0


def test_a_plain_model_goes_by_no_draught_and_a_diagnosis_does(ferry: Warehouse) -> None:
    plain = default_model_of(ferry, "ferry")
    before = inputs_of(choose(ferry, "ferry"), plain, NONE_OF_ONES_OWN).as_json()
    diagnosed = inputs_of_diagnosis(choose(ferry, "ferry"), plain, NONE_OF_ONES_OWN)
    note_all(ferry)
    noted = choose(ferry, "ferry")
    assert inputs_of(noted, plain, NONE_OF_ONES_OWN).as_json() == before
    assert inputs_of_diagnosis(noted, plain, NONE_OF_ONES_OWN) == {**diagnosed, "draughts_m": noted.draughts_m}


def test_a_set_is_superseded_where_another_draught_is_noted(ferry: Warehouse) -> None:
    note_all(ferry)
    reprocess_vessel(ferry, "ferry")
    first = of_load(ferry)
    row = min(logs.current(ferry), key=lambda row: row.file_name)
    notes.add(ferry, "ferry", "log", row.log_id, "misread before", draught_m=6.3)
    assert first.parameter_set_id not in standing_ids(ferry, "ferry")
    reprocess_vessel(ferry, "ferry")
    assert of_load(ferry).provenance["inputs"]["draughts_m"][row.log_id] == 6.3
    assert rerun(ferry, first.parameter_set_id).verdict == "bit-identical"


def test_a_draught_of_the_vessel_holds_from_its_date_on(ferry: Warehouse) -> None:
    rows = sorted(logs.current(ferry), key=lambda row: row.file_name)
    began = {segment.log_id: segment.start_utc_ns for segment in choose(ferry, "ferry").segments}
    notes.add(ferry, "ferry", "vessel", "ferry", "no date, no draught of a trial", draught_m=9.0)
    notes.add(ferry, "ferry", "vessel", "ferry", "in ballast", event_utc_ns=began[rows[0].log_id], draught_m=6.0)
    notes.add(ferry, "ferry", "vessel", "ferry", "loaded", event_utc_ns=began[rows[0].log_id] + 1, draught_m=7.0)
    assert choose(ferry, "ferry").draughts_m == {
        rows[0].log_id: 6.0,
        rows[1].log_id: 7.0,
        **dict.fromkeys((row.log_id for row in rows[2:]), 7.0),
    }
    notes.add(ferry, "ferry", "log", rows[2].log_id, "read at the marks", draught_m=6.2)
    assert choose(ferry, "ferry").draughts_m[rows[2].log_id] == 6.2


def test_draughts_of_some_logs_are_no_measure(ferry: Warehouse) -> None:
    row = min(logs.current(ferry), key=lambda row: row.file_name)
    notes.add(ferry, "ferry", "log", row.log_id, "read at the marks", draught_m=6.0)
    chosen = choose(ferry, "ferry")
    assert not chosen.draughts_m and sorted(chosen.loads.values()) == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_notes_go_with_a_moved_log_and_a_renamed_vessel(ferry: Warehouse) -> None:
    row = min(logs.current(ferry), key=lambda row: row.file_name)
    docked = notes.add(ferry, "ferry", "vessel", "ferry", "docked", event_utc_ns=1_000)
    read = notes.add(ferry, "ferry", "log", row.log_id, "read at the marks", draught_m=6.1)
    vessels.register(ferry, "sister", vessels.current(ferry, "ferry").model_copy(update={"vessel": "sister"}))
    move(ferry, row.log_id, "sister", "wrong folder")
    (moved,) = notes.of_vessel(ferry, "sister")
    assert (moved.subject, moved.subject_id, moved.draught_m) == ("log", row.log_id, 6.1)
    assert moved.text == f"read at the marks [ferry, note {read.number}]"
    rename_vessel(ferry, "sister", "sibling", "sold")
    (renamed,) = notes.of_vessel(ferry, "sibling")
    assert renamed.draught_m == 6.1
    rename_vessel(ferry, "ferry", "ro-ro", "sold")
    (kept,) = (one for one in notes.of_vessel(ferry, "ro-ro") if one.subject == "vessel")
    assert (kept.subject_id, kept.event_utc_ns) == ("ro-ro", 1_000)
    assert kept.text == f"docked [ferry, note {docked.number}]"


def test_the_notes_of_all_vessels_are_read_only_where_one_was_carried(
    ferry: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[str | None] = []
    of_vessel = notes.of_vessel

    def counted(warehouse: Warehouse, vessel: str | None = None, as_of: datetime | None = None) -> list[notes.Note]:
        read.append(vessel)
        return of_vessel(warehouse, vessel, as_of)

    monkeypatch.setattr(notes, "of_vessel", counted)
    for row in logs.current(ferry):
        notes.add(ferry, "ferry", "log", row.log_id, "read at the marks [at the stern, note 1]")
    held = len(notes_of_hers(ferry, "ferry"))
    assert held > 1 and read == ["ferry"]
    rename_vessel(ferry, "ferry", "ro-ro", "sold")
    assert read.count(None) == 2 < 1 + len(logs.current(ferry))
    assert len(notes_of_hers(ferry, "ro-ro")) == held and read[-2:] == ["ro-ro", None]


def test_a_note_that_comes_back_is_the_original_again(ferry: Warehouse) -> None:
    row = min(logs.current(ferry), key=lambda row: row.file_name)
    manoeuvre = next(one for one in segments.current(ferry, "ferry") if one.log_id == row.log_id)
    on_log = notes.add(ferry, "ferry", "log", row.log_id, "laden [ferry, note 7]", draught_m=6.1)
    on_segment = notes.add(ferry, "ferry", "segment", manoeuvre.segment_id, "gusty")
    vessels.register(ferry, "sister", vessels.current(ferry, "ferry").model_copy(update={"vessel": "sister"}))
    for _ in range(2):
        move(ferry, row.log_id, "sister", "wrong folder")
        assert notes_of_hers(ferry, "ferry") == [] and len(notes_of_hers(ferry, "sister")) == 2
        move(ferry, row.log_id, "ferry", "hers after all")
        assert notes_of_hers(ferry, "ferry") == [on_log, on_segment] and notes_of_hers(ferry, "sister") == []
    assert len(notes.of_vessel(ferry)) == 4
    # as earlier versions carried it back: it is shown once
    copy = notes.of_vessel(ferry, "sister")[0]
    notes.add(ferry, "ferry", "log", row.log_id, f"{copy.text} [sister, note {copy.number}]", draught_m=6.1)
    assert notes_of_hers(ferry, "ferry") == [on_log, on_segment]
    docked = notes.add(ferry, "ferry", "vessel", "ferry", "docked")
    rename_vessel(ferry, "ferry", "ro-ro", "sold")
    rename_vessel(ferry, "ro-ro", "ferry", "bought back")
    assert notes_of_hers(ferry, "ferry") == [on_log, on_segment, docked]
    listed = kempf("note", "--vessel", "sister", "--warehouse", ferry.uri)
    assert listed.code == 0 and listed.out.strip() == "no notes"


def test_notes_are_there_once_where_a_move_was_cut_off(ferry: Warehouse) -> None:
    row = min(logs.current(ferry), key=lambda row: row.file_name)
    notes.add(ferry, "ferry", "log", row.log_id, "read at the marks", draught_m=6.1)
    vessels.register(ferry, "sister", vessels.current(ferry, "ferry").model_copy(update={"vessel": "sister"}))
    for cut_off in ("remove", "store"):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(remove_logs, cut_off, interrupted)
            with pytest.raises(KeyboardInterrupt):
                move(ferry, row.log_id, "sister", "wrong folder")
    _, now = move(ferry, row.log_id, "sister", "wrong folder")
    (moved,) = notes.of_vessel(ferry, "sister")
    assert now.vessel == "sister" and (moved.subject_id, moved.draught_m) == (row.log_id, 6.1)


def interrupted(*_: object) -> None:
    raise KeyboardInterrupt
