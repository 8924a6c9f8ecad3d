"""What a person says of manoeuvres: it is an input of the sets that follow, survives every rerun, and is taken back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from shutil import copytree
from types import ModuleType

import pytest

from kempf.flows.fleet.plan import plan
from kempf.flows.jobs.corrections.correct_segments import plan_for, plan_new
from kempf.flows.jobs.corrections.remove_logs import rename_vessel
from kempf.flows.jobs.identify.chosen_set import chosen_set
from kempf.flows.jobs.identify.identify_vessel import identify_vessel
from kempf.flows.jobs.identify.standing_model import model_of, standing
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.rerun_set import rerun
from kempf.flows.jobs.state.out_of_date import unsearched
from kempf.schemas.errors import DataRejected, NotFound, UsageError
from kempf.warehouse.queries.standing import standing_ids
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, corrections, examinations, logs, notes, parameter_sets, segments
from tests.conftest import Ship
from tests.flows.content import fresh
from tests.late import VESSEL
from tests.workbench.driving import kempf

SECOND_NS = 1_000_000_000


@pytest.fixture(scope="module")
def _filled(mariner: Ship, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = mariner.write(tmp_path_factory.mktemp("corrections"))
    warehouse = fresh(folder / "w")
    ingest(warehouse, [folder / "mariner.mcap"], given=read_profiles([folder / "profile.yaml"]))
    identify_vessel(warehouse, "mariner")
    reprocess_vessel(warehouse, "mariner")
    return folder


@pytest.fixture
def warehouse(_filled: Path, tmp_path: Path) -> Warehouse:
    return Warehouse(str(copytree(_filled / "w", tmp_path / "w")))


def test_an_excluded_manoeuvre_counts_nowhere_until_it_is_accepted(warehouse: Warehouse) -> None:
    (zigzag,) = segments.current(warehouse, "mariner")
    before = standing_ids(warehouse, "mariner")
    assert before and not plan(warehouse, None, changed_only=True).due
    planned = plan_for(warehouse, zigzag.segment_id[:10], "exclude", "the engine was slowed down")
    assert set(planned.affected.set_ids) == set(before) and planned.affected.current
    assert segments.current(warehouse, "mariner") == [zigzag]  # nothing is stored yet
    planned.store(warehouse)
    assert segments.current(warehouse, "mariner") == []
    (kept,) = (one for one in segments.found_in(warehouse, "mariner") if one.is_zigzag)
    assert (kept.segment_id, kept.excluded) == (zigzag.segment_id, "the engine was slowed down")
    assert standing_ids(warehouse, "mariner") == []
    assert set(aliases.of_vessel(warehouse, "mariner")) == {aliases.WITHDRAWN}
    with pytest.raises(NotFound, match="was corrected or removed") as none:
        chosen_set(warehouse, "mariner", None)
    assert "kempf reprocess" in none.value.next_step
    assert plan(warehouse, None, changed_only=True).due
    with pytest.raises(UsageError, match="excluded already"):
        plan_for(warehouse, zigzag.segment_id, "exclude", "again")
    other = zigzag.start_utc_ns + 7 * SECOND_NS, zigzag.end_utc_ns
    with pytest.raises(UsageError, match="is excluded \\(the engine was slowed down\\)") as refused:
        plan_for(warehouse, zigzag.segment_id, "correct", "a better begin", other)
    assert refused.value.code == "segment_excluded"
    # the sets of the time before are there, and one is built again bit for bit
    assert rerun(warehouse, before[0]).verdict == "bit-identical"
    plan_for(warehouse, zigzag.segment_id, "accept", "it was not").store(warehouse)
    (back,) = segments.current(warehouse, "mariner")
    assert back.segment_id == zigzag.segment_id and back.detail["by_hand"]["action"] == "accept"
    reprocess_vessel(warehouse, "mariner")
    assert standing_ids(warehouse, "mariner") == before
    # two people at once: what the one excluded meanwhile is not let count again by the other's bounds
    late = plan_for(warehouse, zigzag.segment_id, "correct", "a better begin", other)
    plan_for(warehouse, zigzag.segment_id, "exclude", "tugs alongside").store(warehouse)
    with pytest.raises(UsageError, match="is excluded"):
        late.store(warehouse)
    assert [one.correction.action for one in corrections.all_of(warehouse)] == ["exclude", "accept", "exclude"]


def test_a_model_keeps_its_effects_without_a_manoeuvre_and_with_it_again(late_added: Path, tmp_path: Path) -> None:
    warehouse = Warehouse(str(copytree(late_added / "w", tmp_path / "w")))
    whole = aliases.of_vessel(warehouse, VESSEL)[aliases.CURRENT]
    left_out = segments.current(warehouse, VESSEL)[0]
    plan_for(warehouse, left_out.segment_id, "exclude", "tugs alongside").store(warehouse)
    assert aliases.of_vessel(warehouse, VESSEL) == {aliases.WITHDRAWN: whole}
    reprocess_vessel(warehouse, VESSEL)
    without = standing(warehouse, VESSEL)
    assert without is not None and model_of(without)[0].effects == ("rudder_lag",)
    assert left_out.segment_id not in without.segment_ids
    assert aliases.of_vessel(warehouse, VESSEL) == {aliases.CURRENT: without.parameter_set_id}
    plan_for(warehouse, left_out.segment_id, "accept", "they had let go").store(warehouse)
    reprocess_vessel(warehouse, VESSEL)
    assert aliases.of_vessel(warehouse, VESSEL) == {aliases.CURRENT: whole}, "the very set of before"


def test_other_bounds_make_another_set_that_is_built_again_bit_for_bit(warehouse: Warehouse, _filled: Path) -> None:
    (zigzag,) = segments.current(warehouse, "mariner")
    (log,) = logs.current(warehouse)
    before = standing_ids(warehouse, "mariner")
    bounds = zigzag.start_utc_ns + 7 * SECOND_NS, zigzag.end_utc_ns
    planned = plan_for(warehouse, zigzag.segment_id, "correct", "she was still turning", bounds)
    # the approach that is left counts as one: the first leg has no overshoot
    assert len(planned.after.overshoots_deg) == len(zigzag.overshoots_deg)
    assert planned.after.overshoots_deg == pytest.approx(zigzag.overshoots_deg, abs=0.1)
    assert planned.doubts == () and planned.as_json()["doubts"] == []
    (doubt,) = replace(planned, after=replace(planned.after, overshoots_deg=(3.0, -1.8))).doubts
    assert doubt.startswith("overshoot 2 (-1.8 deg) is negative: she turned back before she was ")
    planned.store(warehouse)
    (corrected,) = segments.current(warehouse, "mariner")
    assert (corrected.start_utc_ns, corrected.end_utc_ns) == bounds and corrected == planned.after
    assert corrected.segment_id != zigzag.segment_id
    (outcome,) = identify_vessel(warehouse, "mariner")
    assert outcome.new and outcome.parameter_set is not None
    made = outcome.parameter_set
    assert made.provenance["inputs"]["segments"][0]["start_utc_ns"] == bounds[0]
    assert rerun(warehouse, made.parameter_set_id).verdict == "bit-identical"
    assert not set(before) & set(standing_ids(warehouse, "mariner"))
    # of a correction the next one is of the same manoeuvre, however it is called
    later = bounds[0] + SECOND_NS, bounds[1]
    plan_for(warehouse, corrected.segment_id, "correct", "one second more", later).store(warehouse)
    (again,) = segments.current(warehouse, "mariner")
    assert again.start_utc_ns == later[0]
    subject = {"start_utc_ns": zigzag.start_utc_ns, "end_utc_ns": zigzag.end_utc_ns}
    assert again.detail["by_hand"]["subject"] == subject
    # the log under another name, read anew: what was said holds
    rename_vessel(warehouse, "mariner", "mariner_ii", "sold")
    (moved,) = segments.current(warehouse, "mariner_ii")
    assert (moved.segment_id, moved.start_utc_ns) == (again.segment_id, later[0])
    assert unsearched(warehouse, logs.current(warehouse)) == []
    plan_for(warehouse, moved.segment_id, "accept", "the search was right").store(warehouse)
    (found,) = segments.current(warehouse, "mariner_ii")
    assert found.segment_id == zigzag.segment_id
    assert log.log_id in {one.log_id for one in corrections.all_of(warehouse)}


def test_a_zigzag_is_added_and_taken_out(warehouse: Warehouse) -> None:
    (zigzag,) = segments.current(warehouse, "mariner")
    (log,) = logs.current(warehouse)
    # two zigzags of one: the first legs, and what lies behind
    half = zigzag.executes_utc_ns[3]
    plan_for(warehouse, zigzag.segment_id, "correct", "the speed fell", (zigzag.start_utc_ns, half - SECOND_NS)).store(
        warehouse
    )
    planned = plan_new(warehouse, log.file_name, (half, zigzag.end_utc_ns), "the rest of it")
    assert planned.before is None and planned.after.kind in {"zigzag", "zigzag_broken_off"}
    planned.store(warehouse)
    first, second = segments.current(warehouse, "mariner")
    assert (first.end_utc_ns, second.start_utc_ns) == (half - SECOND_NS, half)
    with pytest.raises(UsageError, match="overlap"):
        plan_for(warehouse, first.segment_id, "correct", "too far", (first.start_utc_ns, half + 20 * SECOND_NS))
    with pytest.raises(UsageError, match="There is a zigzag"):
        plan_new(warehouse, log.log_id[:8], (half, zigzag.end_utc_ns), "once more")
    plan_for(warehouse, second.segment_id, "exclude", "too short").store(warehouse)
    assert [one.segment_id for one in segments.current(warehouse, "mariner")] == [first.segment_id]
    plan_for(warehouse, second.segment_id, "accept", "long enough").store(warehouse)
    assert [one.segment_id for one in segments.current(warehouse, "mariner")] == [first.segment_id, second.segment_id]


def test_a_correction_that_was_interrupted_is_found_by_the_next_run(warehouse: Warehouse) -> None:
    (zigzag,) = segments.current(warehouse, "mariner")
    planned = plan_for(warehouse, zigzag.segment_id, "exclude", "the engine was slowed down")
    corrections.add(warehouse, planned.log.log_id, zigzag.segment_id, planned.correction)  # and no more
    assert [row.log_id for row in unsearched(warehouse, logs.current(warehouse))] == [planned.log.log_id]
    assert plan(warehouse, None, changed_only=True).due
    reprocess_vessel(warehouse, "mariner")
    assert segments.current(warehouse, "mariner") == []


def _end(*arguments: object, **named: object) -> None:
    raise KeyboardInterrupt


CUT_OFF_AT = ((aliases, "withdraw"), (segments, "replace"), (examinations, "replace"))


@pytest.mark.parametrize("at", CUT_OFF_AT, ids=lambda at: f"{at[0].__name__}.{at[1]}")
def test_a_correction_that_was_interrupted_is_finished_by_the_same_command(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch, at: tuple[ModuleType, str]
) -> None:
    (zigzag,) = segments.current(warehouse, "mariner")
    assert aliases.of_vessel(warehouse, "mariner")
    with monkeypatch.context() as cut_off:
        cut_off.setattr(*at, _end)
        with pytest.raises(KeyboardInterrupt):
            plan_for(warehouse, zigzag.segment_id, "exclude", "the speed fell").store(warehouse)
    plan_for(warehouse, zigzag.segment_id, "exclude", "the speed fell").store(warehouse)
    assert segments.current(warehouse, "mariner") == []
    assert set(aliases.of_vessel(warehouse, "mariner")) == {aliases.WITHDRAWN}
    assert unsearched(warehouse, logs.current(warehouse)) == [] and len(corrections.all_of(warehouse)) == 1
    with pytest.raises(UsageError, match="excluded already"):
        plan_for(warehouse, zigzag.segment_id, "exclude", "the speed fell")


def test_a_zigzag_whose_addition_was_interrupted_is_added_by_the_same_command(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    (zigzag,) = segments.current(warehouse, "mariner")
    (log,) = logs.current(warehouse)
    half = (zigzag.start_utc_ns + zigzag.end_utc_ns) // 2
    plan_for(warehouse, zigzag.segment_id, "correct", "short", (zigzag.start_utc_ns, half - SECOND_NS)).store(warehouse)
    rest = (half, zigzag.end_utc_ns)
    with monkeypatch.context() as cut_off:
        cut_off.setattr(examinations, "replace", _end)
        with pytest.raises(KeyboardInterrupt):
            plan_new(warehouse, log.log_id, rest, "the rest of it").store(warehouse)
    plan_new(warehouse, log.log_id, rest, "the rest of it").store(warehouse)
    assert len(segments.current(warehouse, "mariner")) == 2 and len(corrections.all_of(warehouse)) == 2
    assert unsearched(warehouse, logs.current(warehouse)) == []
    with pytest.raises(UsageError, match="There is a zigzag"):
        plan_new(warehouse, log.log_id, rest, "the rest of it")


def test_bounds_that_are_none(warehouse: Warehouse) -> None:
    (zigzag,) = segments.current(warehouse, "mariner")
    start, end = zigzag.start_utc_ns, zigzag.end_utc_ns
    for bounds, code in (
        ((end, start), "bounds_reversed"),
        ((start - 10**15, end), "bounds_outside_log"),
    ):
        with pytest.raises(UsageError) as refused:
            plan_for(warehouse, zigzag.segment_id, "correct", "x", bounds)
        assert refused.value.code == code
    with pytest.raises(DataRejected, match="no zigzag to describe"):
        plan_for(warehouse, zigzag.segment_id, "correct", "x", (start, start + SECOND_NS))
    assert corrections.all_of(warehouse) == []


def test_a_manoeuvre_that_newer_code_does_not_find(warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch) -> None:
    (zigzag,) = segments.current(warehouse, "mariner")
    monkeypatch.setattr("kempf.flows.jobs.ingest.find_segments.find_zigzags", lambda *arguments: [])
    with pytest.raises(NotFound, match="finds nothing any more") as gone:
        plan_for(warehouse, zigzag.segment_id, "exclude", "engine slowed")
    assert gone.value.code == "manoeuvre_gone" and corrections.all_of(warehouse) == []
    bounds = zigzag.start_utc_ns, zigzag.end_utc_ns
    plan_for(warehouse, zigzag.segment_id, "correct", "it was one", bounds).store(warehouse)
    (kept,) = segments.current(warehouse, "mariner")
    assert (kept.start_utc_ns, kept.end_utc_ns) == bounds


def test_the_command_line(warehouse: Warehouse) -> None:
    at = ("--warehouse", warehouse.uri)
    (zigzag,) = (one for one in kempf("segments", *at, "--json").json if one["kind"] == "zigzag")
    name = zigzag["segment_id"]
    refused = kempf("segments", "exclude", name, "--reason", "x", *at, "--json")
    assert refused.code == 2 and refused.json["error"]["code"] == "not_confirmed"
    assert kempf("segments", "exclude", name, "--reason", "engine slowed", "--yes", *at).out.startswith(name)
    assert f"{name[:12]} is excluded: engine slowed" in kempf("segments", *at).out
    (shown,) = (one for one in kempf("segments", *at, "--json").json if one["segment_id"] == name)
    assert shown["excluded"] == "engine slowed"
    done = kempf("segments", "accept", name, "--reason", "no", "--yes", *at, "--json").json
    assert done["after"]["excluded"] is None and done["before"]["excluded"] == "engine slowed"
    start = f"{zigzag['start'][:17]}59.5Z"
    done = kempf("segments", "correct", name, "--start", start, "--reason", "late", "--yes", *at, "--json").json
    assert done["after"]["start"][:21] == start[:21]
    name = done["after"]["segment_id"]
    listed = kempf("segments", "corrections", *at, "--json").json
    assert [(one["number"], one["action"], one["vessel"]) for one in listed] == [
        (1, "exclude", "mariner"),
        (2, "accept", "mariner"),
        (3, "correct", "mariner"),
    ]
    assert all(one["at"].endswith("Z") for one in listed) and listed == sorted(listed, key=lambda one: one["at"])
    for arguments, code in (
        (("correct", name, "--reason", "x"), "no_bounds"),
        (("correct", name, "--reason", "x", "--start", "noon"), "not_a_time"),
        (("exclude", "seg-0000", "--reason", "x"), "no_segment"),
        (("add", "nothing.csv", "--start", start, "--end", start, "--reason", "x"), "no_log"),
    ):
        output = kempf("segments", *arguments, *at, "--json")
        assert output.json["error"]["code"] == code, output
    before = kempf("segments", "--json", "exclude", name, "--reason", "x", *at)
    assert before.json["error"]["code"] == "option_before_command"


def test_notes_are_kept_and_shown(warehouse: Warehouse) -> None:
    at = ("--warehouse", warehouse.uri)
    (log,) = logs.current(warehouse)
    set_id = parameter_sets.get_all(warehouse, "mariner")[0].parameter_set_id
    (zigzag,) = segments.current(warehouse, "mariner")
    docked = kempf("note", "docked, hull cleaned", "--vessel", "mariner", "--at", "2025-06-01", *at, "--json").json
    assert (docked["number"], docked["subject"], docked["at"]) == (1, "vessel", "2025-06-01T00:00:00.000000Z")
    kempf("note", "laden", "--log", log.log_id[:8], "--draught", "8.1", *at)
    kempf("note", "gusty", "--segment", zigzag.segment_id[:12], *at)
    kempf("note", "delivered to the yard", "--set", set_id, *at)
    listed = notes.of_vessel(warehouse, "mariner")
    assert [(one.subject, one.subject_id, one.draught_m) for one in listed] == [
        ("vessel", "mariner", None),
        ("log", log.log_id, 8.1),
        ("segment", zigzag.segment_id, None),
        ("set", set_id, None),
    ]
    assert kempf("note", *at, "--json").json[0]["text"] == "docked, hull cleaned"
    assert "note: mariner: 2025-06-01: docked, hull cleaned" in kempf("history", "--vessel", "mariner", *at).out
    for arguments, code in (
        (("x",), "no_subject"),
        ((" ", "--vessel", "mariner"), "empty_note"),
        (("x", "--vessel", "nobody"), "no_vessel"),
        (("x", "--log", log.log_id, "--vessel", "aurora"), "subject_of_another_vessel"),
        (("x", "--log", log.log_id, "--set", set_id), "several_subjects"),
        (("x", "--vessel", "mariner", "--draught", "-2"), "draught_not_positive"),
        (("--log", log.log_id), "no_note"),
    ):
        output = kempf("note", *arguments, *at, "--json")
        assert output.code != 0 and output.json["error"]["code"] == code, output
    assert len(notes.of_vessel(warehouse)) == 4
