"""What a person did by mistake can be undone: a log removed, restored, moved; a vessel renamed, removed."""

from __future__ import annotations

from pathlib import Path

import pytest

from kempf.flows.fleet.plan import plan
from kempf.flows.jobs.corrections import remove_logs
from kempf.flows.jobs.corrections.affected_sets import of_logs
from kempf.flows.jobs.corrections.remove_logs import move, remove, remove_vessel, rename_vessel, restore
from kempf.flows.jobs.identify.identify_vessel import identify_vessel
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.state.former_vessel import former_vessels
from kempf.schemas.errors import DataRejected, KempfError, NotFound, UsageError
from kempf.warehouse.queries.standing import standing_ids
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, logs, notes, parameter_sets, raw, segments, vessels
from tests.conftest import Ship
from tests.flows.content import fresh
from tests.workbench.driving import kempf


@pytest.fixture(scope="module")
def _filled(mariner: Ship, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = mariner.write(tmp_path_factory.mktemp("undo"))
    warehouse = fresh(folder / "w")
    ingest(
        warehouse, [folder / "mariner.mcap", folder / "mariner.nmea.gz"], given=read_profiles([folder / "profile.yaml"])
    )
    identify_vessel(warehouse, "mariner")
    reprocess_vessel(warehouse, "mariner")
    return folder


@pytest.fixture
def warehouse(_filled: Path, tmp_path: Path) -> Warehouse:
    from shutil import copytree

    return Warehouse(str(copytree(_filled / "w", tmp_path / "w")))


def test_a_removed_log_is_in_nothing_and_comes_back(warehouse: Warehouse, _filled: Path) -> None:
    before = standing_ids(warehouse, "mariner")
    first = next(row for row in logs.current(warehouse) if row.format == "mcap")
    stated = of_logs(warehouse, [first])
    assert len(stated.segment_ids) == 1 and stated.set_ids and set(stated.set_ids) <= set(before)
    found = remove(warehouse, [first], "a trial of another draught")
    assert found == stated
    assert first.log_id not in {row.log_id for row in logs.current(warehouse)}
    assert first.log_id not in {one.log_id for one in segments.every(warehouse, "mariner")}
    assert not set(found.set_ids) & set(standing_ids(warehouse, "mariner"))
    (gone,) = logs.removed(warehouse)
    assert gone.removed == "a trial of another draught" and gone.revision == first.revision + 1
    # nothing was rewritten: her sets are there, and the vessel is due
    assert {one.parameter_set_id for one in parameter_sets.get_all(warehouse, "mariner")} >= set(before)
    assert plan(warehouse, None, changed_only=True).due
    report = reprocess_vessel(warehouse, "mariner")
    assert not report.failures
    pointed = aliases.of_vessel(warehouse, "mariner").get("current")
    assert pointed is None or first.log_id not in parameter_sets.get(warehouse, pointed).log_ids
    with pytest.raises(NotFound):
        logs.by_prefix(warehouse, first.log_id)
    back = restore(warehouse, first.log_id[:10])
    assert (back.ingest_id, back.removed, back.revision) == (first.ingest_id, None, first.revision + 2)
    reprocess_vessel(warehouse, "mariner")
    assert standing_ids(warehouse, "mariner") == before
    with pytest.raises(UsageError, match="blank"):
        remove(warehouse, [first], " ")


def test_a_removed_log_is_ingested_again_as_a_new_one(warehouse: Warehouse, _filled: Path) -> None:
    first = next(row for row in logs.current(warehouse) if row.format == "mcap")
    remove(warehouse, [first], "by mistake")
    (again,) = ingest(warehouse, [_filled / "mariner.mcap"], "mariner")
    assert again.outcome == "new" and again.ingest_id == first.ingest_id
    assert len(logs.current(warehouse)) == 2 and len(segments.every(warehouse, "mariner")) == 2
    (same,) = ingest(warehouse, [_filled / "mariner.mcap"], "mariner")
    assert same.outcome == "unchanged"


def test_a_log_is_given_to_the_vessel_it_is_of(warehouse: Warehouse, _filled: Path) -> None:
    first = next(row for row in logs.current(warehouse) if row.format == "nmea")
    with pytest.raises(NotFound, match="no vessel 'marinner'"):
        move(warehouse, first.log_id, "marinner", "wrong folder")
    with pytest.raises(UsageError, match="already"):
        move(warehouse, first.log_id, "mariner", "wrong folder")
    # the bytes of another vessel's log are refused, and the way out is named
    (refused,) = ingest(warehouse, [_filled / "mariner.nmea.gz"], "second", new_vessel=True)
    assert isinstance(refused.error, DataRejected) and "kempf logs move" in refused.error.next_step
    found, now = move(warehouse, first.log_id, "second", "wrong folder", new_vessel=True)
    assert found is not None and found.vessel == "mariner"
    assert (now.vessel, now.log_id, now.removed) == ("second", first.log_id, None)
    assert [row.format for row in logs.current(warehouse, "mariner")] == ["mcap"]
    assert len(segments.every(warehouse, "second")) == 1 and len(segments.every(warehouse, "mariner")) == 1
    (gone,) = logs.removed(warehouse, "mariner")
    assert gone.removed == "moved to 'second': wrong folder"
    _, back = move(warehouse, first.log_id, "mariner", "it was hers")
    assert back.vessel == "mariner" and len(segments.every(warehouse, "mariner")) == 2


def test_a_move_that_was_cut_off_goes_on(warehouse: Warehouse) -> None:
    first = next(row for row in logs.current(warehouse) if row.format == "nmea")
    remove(warehouse, [first], "moved to 'second': wrong folder")
    found, now = move(warehouse, first.log_id, "second", "wrong folder", new_vessel=True)
    assert found is None and now.vessel == "second"


def test_a_rename_that_was_cut_off_within_the_move_of_a_log_goes_on(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    held = {row.log_id for row in logs.current(warehouse)}
    with monkeypatch.context() as cut_off:
        cut_off.setattr(remove_logs, "store", _end)
        with pytest.raises(KeyboardInterrupt):
            rename_vessel(warehouse, "mariner", "sailor", "sold")
    assert len(logs.removed(warehouse, "mariner")) == 1
    rows = rename_vessel(warehouse, "mariner", "sailor", "sold")
    assert {row.log_id for row in rows} == held and vessels.names(warehouse) == ["sailor"]


def test_a_rename_looks_first_whether_the_bytes_of_all_logs_are_there(warehouse: Warehouse) -> None:
    rows = logs.current(warehouse)
    lost = rows[-1]
    raw.delete(warehouse, lost.log_id)
    with pytest.raises(NotFound, match="No log was moved") as found:
        rename_vessel(warehouse, "mariner", "sailor", "sold")
    assert found.value.code == "no_raw_log" and lost.file_name in found.value.message
    assert vessels.names(warehouse) == ["mariner"] and logs.current(warehouse) == rows
    assert "current" in aliases.of_vessel(warehouse, "mariner")


def test_a_rename_that_stops_half_way_says_how_far_it_came(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    second = logs.current(warehouse)[-1]
    whole = raw.opened

    def damaged(warehouse: Warehouse, name: str) -> object:
        if name == second.log_id:
            raise KempfError("raw_bytes_damaged", "It is damaged.", "Ingest it again.")
        return whole(warehouse, name)

    with monkeypatch.context() as patch:
        patch.setattr(raw, "opened", damaged)
        with pytest.raises(KempfError, match="went to 'sailor'") as found:
            rename_vessel(warehouse, "mariner", "sailor", "sold")
    assert found.value.code == "raw_bytes_damaged" and "1 of 2 logs" in found.value.message
    assert "give the same command again" in found.value.next_step
    assert len(rename_vessel(warehouse, "mariner", "sailor", "sold")) == 2


def test_a_removed_vessel_comes_back_with_a_log_of_hers(warehouse: Warehouse) -> None:
    at = ("--warehouse", warehouse.uri)
    first, second = logs.current(warehouse)
    profile = vessels.current(warehouse, "mariner")
    removed = kempf("vessels", "remove", "mariner", "--reason", "a slip", "--yes", *at)
    assert "kempf logs restore LOG" in removed.out and "kempf logs list --removed --vessel mariner" in removed.out
    assert len(kempf("logs", "list", "--removed", "--vessel", "mariner", "--json", *at).json) == 2
    back = kempf("logs", "restore", first.log_id, *at)
    assert back.code == 0 and "the vessel 'mariner' with it" in back.out
    assert vessels.current(warehouse, "mariner") == profile
    assert [row.log_id for row in logs.current(warehouse, "mariner")] == [first.log_id]
    # under her new name she is the same ship: the old name stays gone
    rename_vessel(warehouse, "mariner", "sailor", "sold")
    with pytest.raises(NotFound, match="renamed to 'sailor'") as found:
        restore(warehouse, second.log_id)
    assert found.value.code == "vessel_renamed" and "logs move" in found.value.next_step
    move(warehouse, second.log_id, "sailor", "hers")
    assert vessels.names(warehouse) == ["sailor"] and len(logs.current(warehouse, "sailor")) == 2


def test_a_removal_that_was_cut_off_goes_on_with_what_follows_from_it(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = logs.current(warehouse)
    assert aliases.of_vessel(warehouse, "mariner")
    for name in ("withdraw", "mark"):
        with monkeypatch.context() as cut_off:
            cut_off.setattr(aliases if name == "withdraw" else logs, name, _end)
            with pytest.raises(KeyboardInterrupt):
                remove(warehouse, rows, "another draught")
        # as long as anything is left to do the logs are there to be removed
        assert logs.current(warehouse) == rows
    remove(warehouse, rows, "another draught")
    assert logs.current(warehouse) == []
    assert set(aliases.of_vessel(warehouse, "mariner")) == {aliases.WITHDRAWN}


def _end(*arguments: object, **named: object) -> None:
    raise KeyboardInterrupt


def test_a_vessel_is_renamed_and_removed(warehouse: Warehouse) -> None:
    held = {row.log_id for row in logs.current(warehouse)}
    zigzag = segments.current(warehouse, "mariner")[0]
    noted = notes.add(warehouse, "mariner", "segment", zigzag.segment_id, "gusty")
    rows = rename_vessel(warehouse, "mariner", "sailor", "sold")
    (carried,) = notes.of_vessel(warehouse, "sailor")
    assert (carried.subject, carried.subject_id) == ("segment", zigzag.segment_id)
    assert carried.text == f"gusty [mariner, note {noted.number}]"
    assert zigzag.segment_id in {one.segment_id for one in segments.current(warehouse, "sailor")}
    assert {row.log_id for row in rows} == held and vessels.names(warehouse) == ["sailor"]
    assert vessels.current(warehouse, "sailor").length_m is not None
    with pytest.raises(NotFound):
        segments.every(warehouse, "mariner")
    assert len(segments.every(warehouse, "sailor")) == 2
    found = remove_vessel(warehouse, "sailor", "scrapped")
    assert found is not None and len(found.logs) == 2
    assert vessels.names(warehouse) == [] and logs.current(warehouse) == []
    with pytest.raises(NotFound):
        remove_vessel(warehouse, "sailor", "scrapped")
    # she may come again
    assert len(ingest(warehouse, [], "sailor")) == 0
    vessels.register(warehouse, "sailor", rows and vessels.get(warehouse, rows[0].profile_sha256))
    assert vessels.names(warehouse) == ["sailor"]


def test_of_a_name_that_came_back_and_was_removed_the_last_reason_is_said(warehouse: Warehouse) -> None:
    rename_vessel(warehouse, "mariner", "sailor", "sold")
    rename_vessel(warehouse, "sailor", "mariner", "bought back")
    assert former_vessels(warehouse)["sailor"].words == "was renamed to 'mariner': bought back"
    remove_vessel(warehouse, "mariner", "scrapped.")
    assert {name: one.words for name, one in former_vessels(warehouse).items()} == {
        "mariner": "was removed: scrapped",
        "sailor": "was removed: scrapped",
    }


def test_the_commands_say_first_what_will_go(warehouse: Warehouse) -> None:
    at = ("--warehouse", warehouse.uri)
    log = logs.current(warehouse)[0]
    asked = kempf("logs", "remove", log.log_id[:12], "--reason", "a test", "--json", *at)
    assert asked.code == 2 and asked.json["error"]["code"] == "not_confirmed"
    assert "count no longer" in asked.json["error"]["message"] and "superseded" in asked.json["error"]["message"]
    assert len(logs.current(warehouse)) == 2
    done = kempf("logs", "remove", log.log_id[:12], "--reason", "a test", "--yes", "--json", *at)
    assert done.code == 0 and done.json["logs"][0]["log_id"] == log.log_id
    (listed,) = kempf("logs", "list", "--removed", "--json", *at).json
    assert listed["removed"] == "a test"
    assert kempf("logs", "restore", log.log_id[:12], *at).code == 0
    moved = kempf("logs", "move", log.log_id[:12], "--vessel", "x", "--new-vessel", "--reason", "y", "--yes", *at)
    assert moved.code == 0 and "kempf reprocess --vessel mariner --vessel x" in moved.out
    assert kempf("vessels", "rename", "x", "z", "--reason", "y", "--yes", *at).code == 0
    assert kempf("vessels", "remove", "z", "--reason", "y", "--yes", *at).code == 0
    assert [one["vessel"] for one in kempf("vessels", "list", "--json", *at).json] == ["mariner"]
    assert kempf("vessels", "rename", "mariner", "mariner", "--reason", "y", "--yes", *at).code == 2
