"""Every set built again: counted, interrupted, taken up again; and what other code would move."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan
from pathlib import Path
from typing import Any

import pytest
import yaml

from kempf.flows.jobs.identify.identify_vessel import Request, build, identify_vessel
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.reprocess import preview_code, rerun_all
from kempf.flows.jobs.reprocess.adopt_code import adopt_code
from kempf.flows.jobs.reprocess.parameter_changes import Move, paired
from kempf.flows.jobs.reprocess.preview_code import VesselPreview, preview_all, standing_sets
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.rerun_all import verify_all
from kempf.flows.jobs.reprocess.rerun_set import inputs_of
from kempf.flows.jobs.state import vessel_state
from kempf.flows.jobs.state.out_of_date import said_of_vessel
from kempf.pipeline.ingest.log_file import LogFile
from kempf.schemas.errors import KempfError, NotFound
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.code import code_version
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import equivalents, examinations, logs, parameter_sets, provenance, runs, segments
from kempf.warehouse.tables.parameter_set import ParameterSet, StoredValue
from kempf.warehouse.upkeep import compaction
from tests.flows.content import fresh, seen
from tests.warehouse.samples import parameter_set
from tests.workbench.driving import kempf, refused, tree

LEAST_SQUARES = Request(estimator="least-squares")
NONE = {"bit-identical": 0, "equal within tolerance": 0, "different": 0, "failed": 0}


@pytest.fixture(scope="module")
def _identified(harbour: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("identified") / "w"
    warehouse = fresh(folder)
    profile = VesselProfile.model_validate(yaml.safe_load((harbour / "profile.yaml").read_text()))
    ingest(warehouse, [harbour / f"mariner.{end}" for end in ("nmea.gz", "csv.gz")], given=profile)
    identify_vessel(warehouse, "mariner", LEAST_SQUARES)
    return folder


@pytest.fixture
def own(_identified: Path, tmp_path: Path) -> Warehouse:
    from shutil import copytree

    return fresh(copytree(_identified, tmp_path / "w"))


def other_code(monkeypatch: pytest.MonkeyPatch, letter: str = "f") -> None:
    monkeypatch.setattr(code_version, "fingerprint", lambda _: letter * 16)


def test_every_set_is_counted_and_the_second_call_computes_nothing(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    before = seen(own)
    found = verify_all(own)
    assert found.counts() == {**NONE, "bit-identical": 2}
    assert found.counts(code_changed=True) == NONE
    assert seen(own) == before, "verdicts are runs, and nothing else is stored"
    assert [run.status for run in runs.all_runs(own, "rerun")] == ["bit-identical"] * 2
    monkeypatch.setattr(rerun_all, "rebuilt", lambda *_: pytest.fail("built again"))
    version = delta.versions(own)["runs"]
    again = verify_all(own)
    assert (again.counts(), again.as_json()["known_before"]) == (found.counts(), 2)
    assert delta.versions(own)["runs"] == version
    assert verify_all(own, ["mariner"], afresh=False).counts() == found.counts()


def test_a_verdict_of_other_flows_is_not_taken_over(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    """What the flows put beside an estimate, such as warnings, is compared too; their code is no part of a set's id."""
    assert verify_all(own).counts() == {**NONE, "bit-identical": 2}
    monkeypatch.setattr(code_version, "fingerprint_of_packages", lambda *_: "f" * 16)
    vessel_state.deciding_code.cache_clear()
    try:
        assert verify_all(own).as_json()["known_before"] == 0
    finally:
        vessel_state.deciding_code.cache_clear()


def test_interrupted_it_goes_on_where_it_stopped(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    built: list[str] = []
    real = rerun_all.rebuilt

    def noted(warehouse: Warehouse, stored: Any, *rest: Any) -> Any:
        built.append(stored.parameter_set_id)
        return real(warehouse, stored, *rest)

    def stop(done: int, total: int, what: str) -> None:
        if done >= 1:
            raise KeyboardInterrupt

    monkeypatch.setattr(rerun_all, "rebuilt", noted)
    with pytest.raises(KeyboardInterrupt):
        verify_all(own, progress=stop)
    first = set(built)
    assert len(first) == 1
    built.clear()
    found = verify_all(own)
    assert first.isdisjoint(built) and len(built) == 1
    assert found.counts() == {**NONE, "bit-identical": 2}
    assert found.as_json()["known_before"] == 1


def test_what_differs_and_what_cannot_be_built_is_reported(own: Warehouse):
    csv = next(row for row in logs.current(own) if row.format == "delimited")
    assert own.folder is not None
    (own.folder / "raw" / csv.log_id[:2] / csv.log_id).unlink()
    output = kempf("rerun", "--all", "--warehouse", own.uri, "--json")
    assert output.code == 3 and output.json["verdicts"] == {**NONE, "bit-identical": 1, "failed": 1}
    assert {f["error"]["code"] for f in output.json["not_identical"]} == {"no_raw_log"}
    assert len(runs.all_runs(own, "rerun")) == 1, "what failed is tried again"


def test_a_set_that_was_tampered_with_is_different(own: Warehouse):
    row = delta.read(own, "parameter_sets").rows(named=True)[0]
    name = row["parameter_set_id"]
    row["parameters"][0]["value"] *= 1.001
    with delta.ensured(own, "parameter_sets") as table:
        delta.replace(table, "parameter_sets", [row], f"parameter_set_id = '{name}'")
    output = kempf("rerun", "--all", "--verify", "--warehouse", own.uri)
    assert output.code == 5, output
    assert f"mariner, {name}: different in parameters.a11.value" in output.out


def test_an_old_set_is_built_again_after_compaction_and_vacuum(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    import os

    names = [s.parameter_set_id for s in parameter_sets.get_all(own, "mariner")]
    for i in range(3):
        runs.record_all(own, [runs.FlowRun("run-0", "other", None, str(i))])
    assert own.folder is not None
    compaction.compact(own, more_files_than=1)
    for path in own.folder.rglob("*"):
        os.utime(path, (1, 1))
    compaction.vacuum(own, 0.0)
    assert kempf("rerun", names[0], "--warehouse", own.uri).code == 0
    assert verify_all(own).counts() == {**NONE, "bit-identical": 2}
    pins = parameter_sets.get(own, names[-1]).provenance["table_versions"]
    assert all(delta.read(own, name, version=v).height or name in ("aliases",) for name, v in pins.items())


def test_code_that_changes_nothing_moves_nothing(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    assert own.folder is not None
    before = tree(own.folder)
    (same,) = preview_all(own)
    assert (same.sets, same.up_to_date, same.moves) == (2, 2, ())
    other_code(monkeypatch)
    (found,) = preview_all(own)
    assert (found.sets, found.up_to_date, found.identical) == (2, 0, 2)
    assert (found.moves, found.new, found.gone, found.failures) == ((), (), (), ())
    assert tree(own.folder) == before, "nothing is stored"


def test_a_log_that_the_present_code_has_read_already_is_in_the_preview_too(
    own: Warehouse, harbour: Path, monkeypatch: pytest.MonkeyPatch
):
    """Pooled sets and models rest on all logs: one left out would make them others than reprocessing makes them."""
    other_code(monkeypatch)
    ingest(own, [harbour / "mariner.mcap"], vessel="mariner")
    assert len({row.code_version for row in logs.current(own)}) == 2
    reports: list[Any] = []
    real = reprocess_vessel
    monkeypatch.setattr(preview_code, "reprocess_vessel", lambda *a, **k: reports.append(real(*a, **k)) or reports[-1])
    (found,) = preview_all(own)
    done = real(own, "mariner")
    (tried,) = reports
    assert (tried.logs, tried.segments, tried.failures) == (done.logs, done.segments, done.failures) == (3, 3, [])
    assert tried.new_sets == done.new_sets == 3
    assert (found.sets, found.up_to_date, found.identical, found.gone) == (2, 0, 2, ())
    (new,) = found.new
    assert parameter_sets.get(own, new.parameter_set_id).log_ids == (
        LogFile((harbour / "mariner.mcap").read_bytes()).sha256,
    )
    (after,) = preview_all(own)
    assert (after.sets, after.up_to_date, len(reports)) == (3, 3, 1), "nothing is left to try"


def test_a_model_of_which_no_set_stands_is_in_the_preview_too(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    """Reprocessing brings every model up to date that she was ever identified with."""
    other_code(monkeypatch)
    identify_vessel(own, "mariner", replace(LEAST_SQUARES, spec=ModelSpec(name="tank", current="none")))
    other_code(monkeypatch, "e")
    (found,) = preview_all(own)
    assert (found.sets, found.up_to_date, found.identical, found.moves, found.gone) == (2, 0, 2, (), ())
    assert [one.model for one in found.new] == ["plain"] * 2
    assert reprocess_vessel(own, "mariner").new_sets == 4
    assert {one.parameter_set_id for one in found.new} < {s.parameter_set_id for s in standing_sets(own, "mariner")}


def test_what_code_would_change_is_given_in_standard_errors(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    other_code(monkeypatch)
    (bent, other) = (row.log_id for row in logs.current(own))
    steps = {"a11": 0.3, "a12": -1.5, "b2": 0.01}

    def moved(*arguments: Any) -> ParameterSet:
        """What the present code makes, of one log so many standard errors beside it."""
        made = build(*arguments)
        if made.log_ids != (bent,):
            return made
        beside = [replace(e, value=e.value + steps.get(e.name, 0.0) * (e.std or 0.0)) for e in made.parameters]
        return replace(made, parameters=tuple(beside))

    monkeypatch.setattr("kempf.flows.jobs.identify.identify_vessel.build", moved)
    assert own.folder is not None
    before = tree(own.folder)
    output = kempf("rerun", "--all", "--preview", "--fail-above", 1.4, "--warehouse", own.uri, "--json")
    assert tree(own.folder) == before
    assert output.code == 5
    assert [output.json[k] for k in ("sets", "identical", "moved", "new", "gone")] == [2, 1, 1, 0, 0]
    found = tuple(Move(**move) for move in output.json["moves"])
    assert [m.parameter for m in found][:3] == ["a12", "a11", "b2"], "the largest first"
    for move in found:
        stored = {e.name: e for e in parameter_sets.get(own, move.parameter_set_id).parameters}[move.parameter]
        assert (move.before, move.std, move.std_ratio) == (stored.value, stored.std, 1.0)
        assert move.in_std == pytest.approx(steps.get(move.parameter, 0.0), rel=1e-9)
    first = output.json["parameters"][0]
    assert (first["vessel"], first["parameter"], first["sets"]) == ("mariner", "a12", 1)
    assert other not in {move.parameter_set_id for move in found}
    monkeypatch.setattr(preview_code, "preview_all", lambda *_: [VesselPreview("mariner", 2, 0, 1, found)])
    shown = kempf("rerun", "--all", "--preview", "--fail-above", 1.6, "--warehouse", own.uri)
    assert shown.code == 0 and "1 bit-identical, 1 would change" in shown.out
    rows = [line.split() for line in shown.out.splitlines()]
    assert next(row for row in rows if row[:1] == ["mariner"])[:3] == ["mariner", "a12", "-1.5"], "the largest first"


@pytest.mark.parametrize(("after", "std"), [(nan, 0.1), (nan, None), (2.0, None), (inf, 0.1)])
def test_a_value_that_is_none_has_moved_beyond_any_limit(after: float, std: float | None):
    estimates = [StoredValue("a11", value, std, "1/m") for value in (1.0, after)]
    sets = [parameter_set(parameters=(e,), parameter_set_id=f"ps-{k}") for k, e in enumerate(estimates)]
    (move,) = paired(sets[:1], sets[1:]).moves
    assert move.size == inf


def test_a_vessel_that_cannot_be_previewed_stops_no_other(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    other_code(monkeypatch)
    (row, _) = logs.current(own)
    assert own.folder is not None
    kept = own.folder / "raw" / row.log_id[:2] / row.log_id
    kept.write_bytes(kept.read_bytes()[:-10])
    (found,) = preview_all(own)
    assert [f["error"]["code"] for f in found.failures] == ["raw_bytes_damaged"]
    assert (found.identical, len(found.gone)) == (1, 1)

    def broken(*_: Any) -> Any:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(preview_code, "_preview", broken)
    (failed,) = preview_all(own)
    assert "ZeroDivisionError" in failed.failures[0]["error"]["message"]


def test_requests_that_make_no_sense(own: Warehouse, tmp_path: Path):
    place = ("--warehouse", own.uri, "--json")
    refused(kempf("rerun", *place), 2, "one_or_all")
    refused(kempf("rerun", "ps-1", "--all", *place), 2, "one_or_all")
    refused(kempf("rerun", "ps-1", "--preview", *place), 2, "only_with_all")
    refused(kempf("rerun", "--all", "--fail-above", 1, *place), 2, "only_with_preview")
    refused(kempf("rerun", "--all", "--vessel", "nobody", *place), 4, "no_vessel")
    for asked in ("--verify", "--preview"):
        with_none = kempf("rerun", "--all", asked, "--warehouse", tmp_path / "none", "--json")
        refused(with_none, 4, "no_warehouse")
    refused(kempf("compact", "--warehouse", tmp_path / "none", "--json"), 4, "no_warehouse")
    with pytest.raises(NotFound):
        verify_all(fresh(tmp_path / "none"))


def test_code_that_moves_nothing_is_adopted_and_nothing_is_made_anew(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    def sets() -> list[str]:
        return [one.parameter_set_id for one in parameter_sets.get_all(own, "mariner")]

    before, standing = sets(), standing_sets(own, "mariner")
    other_code(monkeypatch)
    assert said_of_vessel(own, "mariner") is not None
    with pytest.raises(KempfError) as caught:
        adopt_code(own, [VesselPreview("mariner", 0, 0)])
    assert caught.value.code == "nothing_compared"
    output = kempf("rerun", "--all", "--preview", "--adopt", "--warehouse", own.uri)
    assert output.code == 0 and "on the evidence of 2 sets of 1 vessel" in output.out, output
    assert said_of_vessel(own, "mariner") is None
    report = reprocess_vessel(own, "mariner")
    assert (report.status, report.reread, report.searched, report.new_sets) == ("unchanged", 0, 0, 0)
    assert sets() == before and standing_sets(own, "mariner") == standing
    (same,) = preview_all(own)
    assert (same.sets, same.up_to_date) == (2, 2)
    # what comes goes on under the fingerprint of the code before, and says which code made it
    made = provenance.collect(own, inputs_of(parameter_sets.get(own, before[0])), [])
    assert made["made_by"] == code_version.fingerprint("estimate") != made["code_version"]
    again = kempf("rerun", "--all", "--preview", "--adopt", "--warehouse", own.uri)
    assert again.code == 0 and "nothing to adopt" in again.out
    # taken back, everything is of other code again
    taken = kempf("rerun", "--unadopt", "--warehouse", own.uri, "--json")
    assert {one["stage"] for one in taken.json["taken_back"]} == set(delta.read(own, "equivalents")["stage"])
    assert said_of_vessel(own, "mariner") is not None
    assert "nothing to take back" in kempf("rerun", "--unadopt", "--warehouse", own.uri).out


def only_search(monkeypatch: pytest.MonkeyPatch) -> None:
    known = code_version.fingerprint
    monkeypatch.setattr(code_version, "fingerprint", lambda stage: "f" * 16 if stage == "segment" else known(stage))


def test_a_search_that_finds_the_same_is_adopted_by_itself(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    only_search(monkeypatch)
    (found,) = preview_all(own)
    assert (found.identical, found.logs, found.logs_otherwise) == (0, 2, ())
    assert [one.stage for one in adopt_code(own, [found])] == ["segment"]
    assert said_of_vessel(own, "mariner") is None


def test_a_search_that_finds_something_else_is_named_and_not_adopted(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    # as if the code before had said something else of one log's channels and of one manoeuvre
    rows = logs.current(own, "mariner")
    examined = examinations.of_ingests(own, [rows[0].ingest_id])[rows[0].ingest_id]
    examinations.replace(own, [replace(examined, findings=("the rudder is held upside down",))])
    only_search(monkeypatch)
    (found,) = preview_all(own)
    assert found.logs_otherwise == (rows[0].file_name,)
    with pytest.raises(KempfError) as caught:
        adopt_code(own, [found])
    assert caught.value.code == "code_moves" and delta.read(own, "equivalents").is_empty()
    output = kempf("rerun", "--all", "--preview", "--warehouse", own.uri)
    assert f"in 1 of 2 logs other things are read or found: {rows[0].file_name}" in output.out


def test_what_a_person_said_of_a_manoeuvre_is_no_difference(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    one = segments.found_in(own, "mariner")[0]
    done = kempf("segments", "exclude", one.segment_id, "--reason", "a tug pushed", "--yes", "--warehouse", own.uri)
    assert done.code == 0, done
    only_search(monkeypatch)
    (found,) = preview_all(own)
    assert found.logs == 2 and not (found.logs_otherwise or found.moves or found.new or found.gone)


def test_the_fleet_looks_at_every_vessel_again_when_code_was_adopted_or_taken_back(
    own: Warehouse, monkeypatch: pytest.MonkeyPatch
):
    other_code(monkeypatch)
    before = vessel_state.fleet_state(own)["mariner"].digest
    adopt_code(own, preview_all(own))
    adopted = vessel_state.fleet_state(own)["mariner"].digest
    equivalents.withdraw(own)
    assert adopted != before == vessel_state.fleet_state(own)["mariner"].digest


def test_code_that_moves_something_is_not_adopted(own: Warehouse, monkeypatch: pytest.MonkeyPatch):
    other_code(monkeypatch)
    (found,) = preview_all(own)
    moving = replace(found, gone=("ps-1",))
    with pytest.raises(KempfError) as caught:
        adopt_code(own, [moving])
    assert caught.value.code == "code_moves" and delta.read(own, "equivalents").is_empty()
    assert kempf("rerun", "--all", "--adopt", "--warehouse", own.uri).code == 2
