"""An inbox: what is new gets in, what cannot be placed or read waits for a person, and nothing is done twice."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from kempf.flows.fleet.arrivals import LogsFailed
from kempf.flows.jobs.corrections.remove_logs import remove, remove_vessel, rename_vessel
from kempf.flows.jobs.inbox.release_log import dismiss, release
from kempf.flows.jobs.inbox.take_inbox import NeedsAPerson, take_inbox
from kempf.schemas.errors import DataRejected, KempfError, NotFound, UsageError
from kempf.warehouse.sources.source_folder import SourceFolder
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import inbox, logs, vessels
from tests.conftest import Ship
from tests.workbench.driving import kempf


def taken(place: Path, warehouse: Warehouse):
    return take_inbox(warehouse, SourceFolder(str(place)), settle_s=0.0)


@pytest.fixture
def place(mariner: Ship, tmp_path: Path) -> Path:
    """An inbox with the folder of a ship: her profile, her log and something that is no log."""
    folder = tmp_path / "inbox" / "mariner"
    folder.mkdir(parents=True)
    (folder / "profile.yaml").write_text(yaml.safe_dump(mariner.profile))
    (folder / "day.csv.gz").write_bytes(mariner.csv)
    (folder / "minutes.pdf").write_bytes(b"%PDF-1.7\n\x00\x01 minutes of the meeting")
    (folder / ".day.part").write_bytes(b"")
    return tmp_path / "inbox"


@pytest.fixture
def warehouse(tmp_path: Path) -> Warehouse:
    return Warehouse(str(tmp_path / "w"))


def test_what_is_new_gets_in_once_and_what_is_no_log_waits_for_a_person(place: Path, warehouse: Warehouse) -> None:
    first = taken(place, warehouse)
    assert [Path(one.path).name for one in first.ingested] == ["day.csv.gz"] and first.ingested[0].outcome == "new"
    (pdf,) = first.quarantined
    assert pdf.address == f"{place}/mariner/minutes.pdf" and pdf.code and pdf.next_step and pdf.address in first.tried
    assert [row.vessel for row in logs.current(warehouse)] == ["mariner"]
    again = taken(place, warehouse)
    assert again.ingested == () and again.quarantined == (pdf,) and not again.tried and again.known == 2
    dismissed = dismiss(warehouse, "minutes.pdf", "minutes of a meeting")
    assert dismissed.message == "minutes of a meeting" and taken(place, warehouse).quarantined == ()
    # what is written anew is looked at again
    (place / "mariner" / "minutes.pdf").write_bytes(b"%PDF-1.7\n\x00 other minutes")
    assert [one.address for one in taken(place, warehouse).quarantined] == [pdf.address]
    with pytest.raises(UsageError, match="blank"):
        dismiss(warehouse, "minutes.pdf", " ")


def test_the_description_of_a_bag_waits_for_nobody(place: Path, warehouse: Warehouse) -> None:
    bag = place / "mariner" / "bag"
    bag.mkdir()
    (bag / "bag_0.mcap").write_bytes(b"")
    for folder in (bag, place / "mariner"):
        (folder / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  version: 5\n")
    held = {one.address.removeprefix(f"{place}/mariner/") for one in taken(place, warehouse).quarantined}
    assert held == {"minutes.pdf", "bag/bag_0.mcap", "metadata.yaml"}


def test_a_slip_of_the_hand_makes_no_ship_and_is_released_by_one_command(
    place: Path, mariner: Ship, warehouse: Warehouse
) -> None:
    taken(place, warehouse)
    (place / "marinner").mkdir()
    (place / "marinner" / "second.nmea.gz").write_bytes(mariner.nmea)
    (place / "adrift.mcap").write_bytes(mariner.mcap)
    found = {Path(one.address).name: one for one in taken(place, warehouse).quarantined}
    assert found["second.nmea.gz"].code == "no_vessel" and "like it: 'mariner'" in str(found["second.nmea.gz"].message)
    assert found["adrift.mcap"].code == "not_placed"
    assert vessels.names(warehouse) == ["mariner"]
    with pytest.raises(NotFound, match="no vessel 'marinner'"):
        release(warehouse, "second.nmea.gz", "marinner")
    released = release(warehouse, "second.nmea.gz", "mariner")
    assert released.outcome == "new" and released.segments
    assert release(warehouse, f"{place}/adrift.mcap", "mariner").outcome == "new"
    with pytest.raises(NotFound, match="is in quarantine"):
        release(warehouse, "adrift.mcap", "mariner")
    assert len(logs.current(warehouse)) == 3 and vessels.names(warehouse) == ["mariner"]
    assert {Path(one.address).name for one in inbox.quarantined(warehouse)} == {"minutes.pdf"}


def test_patterns_in_the_profile_place_a_file_and_do_not_read_her_logs_anew(
    place: Path, mariner: Ship, warehouse: Warehouse
) -> None:
    before = taken(place, warehouse).ingested[0].ingest_id
    (place / "MRN-2.nmea.gz").write_bytes(mariner.nmea)
    assert "not_placed" in [one.code for one in taken(place, warehouse).quarantined]
    (place / "mariner" / "profile.yaml").write_text(yaml.safe_dump({**mariner.profile, "inbox": ["MRN-*"]}))
    taken(place, warehouse)  # makes the profile current, so that the next run places the file by it
    placed = taken(place, warehouse)
    assert [Path(one.path).name for one in placed.ingested] == ["MRN-2.nmea.gz"]
    assert vessels.current(warehouse, "mariner").inbox == ["MRN-*"]
    assert before in [row.ingest_id for row in logs.current(warehouse, "mariner")]
    other = {**mariner.profile, "vessel": "other", "inbox": ["*.nmea.gz"]}
    (place / "other").mkdir()
    (place / "other" / "profile.yaml").write_text(yaml.safe_dump(other))
    (place / "other" / "hers.csv").write_bytes(b"utc,x\n")
    taken(place, warehouse)
    # nothing of hers could be read: she is no vessel, and her patterns place nothing
    assert vessels.names(warehouse) == ["mariner"]


def test_a_profile_that_is_none_holds_its_folder_back(place: Path, mariner: Ship, warehouse: Warehouse) -> None:
    (place / "mariner" / "profile.yaml").write_text("length_m: -3\n")
    held = taken(place, warehouse)
    assert [one.code for one in held.quarantined] == ["profile_invalid"] and held.ingested == ()
    assert sorted(held.waiting) == ["mariner/day.csv.gz", "mariner/minutes.pdf"]
    assert not vessels.profiles(warehouse)
    (place / "mariner" / "profile.yaml").write_text(yaml.safe_dump(mariner.profile))
    mended = taken(place, warehouse)
    assert [Path(one.path).name for one in mended.ingested] == ["day.csv.gz"]
    assert [Path(one.address).name for one in mended.quarantined] == ["minutes.pdf"]


def test_a_file_in_quarantine_is_tried_again_where_its_profile_has_changed(
    place: Path, mariner: Ship, warehouse: Warehouse
) -> None:
    wrong = {**mariner.profile, "sources": []}
    (place / "mariner" / "profile.yaml").write_text(yaml.safe_dump(wrong))
    assert len(taken(place, warehouse).quarantined) == 2
    (place / "mariner" / "profile.yaml").write_text(yaml.safe_dump(mariner.profile))
    assert [Path(one.path).name for one in taken(place, warehouse).ingested] == ["day.csv.gz"]


def test_what_was_written_a_moment_ago_is_left_for_the_next_run(place: Path, warehouse: Warehouse) -> None:
    os.utime(place / "mariner" / "minutes.pdf", (1, 1))
    run = take_inbox(warehouse, SourceFolder(str(place)), settle_s=3600.0)
    assert run.waiting == ("mariner/day.csv.gz",) and run.ingested == ()


def test_an_inbox_that_is_none(tmp_path: Path, warehouse: Warehouse) -> None:
    with pytest.raises(NotFound) as gone:
        taken(tmp_path / "gone", warehouse)
    assert gone.value.code == "no_inbox"
    (tmp_path / "file").write_text("x")
    with pytest.raises(UsageError) as file:
        taken(tmp_path / "file", warehouse)
    assert file.value.code == "inbox_path"
    (tmp_path / "empty").mkdir()
    assert taken(tmp_path / "empty", warehouse).as_json()["known"] == 0 and not warehouse.exists()


def test_a_folder_that_was_renamed_waits_for_nobody_any_more(place: Path, mariner: Ship, warehouse: Warehouse) -> None:
    taken(place, warehouse)
    (place / "marinner").mkdir()
    (place / "marinner" / "second.nmea.gz").write_bytes(mariner.nmea)
    (place / "mariner" / "minutes.pdf").unlink()
    assert [Path(one.address).name for one in taken(place, warehouse).quarantined] == ["second.nmea.gz"]
    (place / "marinner" / "second.nmea.gz").rename(place / "mariner" / "second.nmea.gz")
    done = taken(place, warehouse)
    assert [Path(one.path).name for one in done.ingested] == ["second.nmea.gz"] and done.quarantined == ()


def test_what_was_gone_for_a_night_is_tried_again_when_it_is_back(
    place: Path, mariner: Ship, warehouse: Warehouse, tmp_path: Path
) -> None:
    assert len(taken(place, warehouse).quarantined) == 1 and not taken(place, warehouse).remarks
    place.rename(tmp_path / "elsewhere")
    place.mkdir()
    gone = taken(place, warehouse)
    assert gone.quarantined == () and "The inbox is empty, where 2 files lay before" in gone.remarks[0]
    assert taken(place, warehouse).remarks == ()
    place.rmdir()
    (tmp_path / "elsewhere").rename(place)
    back = taken(place, warehouse)
    (pdf,) = back.quarantined
    assert pdf.address.endswith("minutes.pdf") and pdf.address in back.tried and back.known == 1 and not back.remarks
    place.rename(tmp_path / "elsewhere")
    place.mkdir()
    for said in (True, False):
        shown = kempf("inbox", place, "--settle", 0, "--warehouse", warehouse.uri)
        assert shown.code == 0 and ("The inbox is empty" in shown.err) == said
    place.rmdir()
    (tmp_path / "elsewhere").rename(place)
    assert not taken(place, warehouse).remarks
    # a row of earlier versions, which stored as dismissed what was only gone; what a person dismissed stays so
    inbox.record(warehouse, [replace(pdf, outcome="dismissed", message="It is no longer in the inbox.")])
    assert len(taken(place, warehouse).quarantined) == 1
    dismiss(warehouse, "minutes.pdf", "no log")
    (place / "mariner" / "minutes.pdf").rename(tmp_path / "minutes.pdf")
    taken(place, warehouse)
    (tmp_path / "minutes.pdf").rename(place / "mariner" / "minutes.pdf")
    assert taken(place, warehouse).quarantined == ()


@pytest.mark.parametrize("named_by", ["folder", "profile"])
def test_a_vessel_that_was_renamed_or_removed_is_not_made_again(
    place: Path, mariner: Ship, warehouse: Warehouse, named_by: str
) -> None:
    (place / "mariner" / "minutes.pdf").unlink()
    taken(place, warehouse)
    if named_by == "folder":
        (place / "mariner" / "profile.yaml").unlink()
    rename_vessel(warehouse, "mariner", "sailor", "sold")
    rename_vessel(warehouse, "sailor", "seaman", "sold again")
    (place / "mariner" / "second.nmea.gz").write_bytes(mariner.nmea)
    for new_vessels in (False, True):
        run = take_inbox(warehouse, SourceFolder(str(place)), settle_s=0.0, new_vessels=new_vessels)
        (held,) = run.quarantined
        assert held.code == "vessel_renamed" and "renamed to 'seaman': sold" in str(held.message)
        assert 'vessel: "seaman"' in str(held.next_step) and "logs release" in str(held.next_step)
        assert vessels.names(warehouse) == ["seaman"]
    by_hand = kempf("ingest", place / "mariner" / "second.nmea.gz", "--vessel", "mariner", "--warehouse", warehouse.uri)
    assert by_hand.code == 4 and "--vessel seaman" in by_hand.err
    remove_vessel(warehouse, "seaman", "a slip")
    (held,) = taken(place, warehouse).quarantined
    assert held.code == "vessel_removed" and "kempf vessels set mariner" in str(held.next_step)
    assert vessels.names(warehouse) == []
    # a ship that has the old name now is made by one command, and her folder is hers from then on
    assert release(warehouse, "second.nmea.gz", "mariner", new_vessel=True).outcome == "new"
    assert taken(place, warehouse).quarantined == ()


def test_a_log_that_a_person_removed_stays_removed_when_it_is_delivered_again(
    place: Path, warehouse: Warehouse
) -> None:
    (place / "mariner" / "minutes.pdf").unlink()
    taken(place, warehouse)
    (row,) = logs.current(warehouse)
    remove(warehouse, [row], "wrong draught")
    os.utime(place / "mariner" / "day.csv.gz", (1, 1))
    run = taken(place, warehouse)
    (left,) = run.removed
    assert run.ingested == run.quarantined == () and "wrong draught" in str(left.message)
    assert f"kempf logs restore {row.log_id[:12]}" in str(left.next_step) and logs.current(warehouse) == []
    assert run.as_json()["removed"][0]["log_id"] == row.log_id
    again = taken(place, warehouse)
    assert again.removed == () and again.known == 1
    os.utime(place / "mariner" / "day.csv.gz", (2, 2))
    at = ("--warehouse", warehouse.uri)
    shown = kempf("inbox", place, "--settle", 0, *at)
    assert shown.code == 0 and "0 logs ingested, 1 removed before and left alone, 0 known" in shown.out
    assert "wrong draught" in shown.err
    by_hand = kempf("ingest", place / "mariner" / "day.csv.gz", "--vessel", "mariner", *at)
    assert by_hand.code == 0 and "had been removed (wrong draught)" in by_hand.out
    assert [one.log_id for one in logs.current(warehouse)] == [row.log_id]


def test_links_are_followed_once_and_those_that_lead_nowhere_are_said(
    place: Path, warehouse: Warehouse, tmp_path: Path
) -> None:
    (place / "mariner" / "minutes.pdf").unlink()
    (place / "mariner" / "loop").symlink_to(place / "mariner")
    (place / "a").symlink_to("mariner")
    (place / "mariner" / "day9.csv").symlink_to("/not/mounted/day9.csv")
    (tmp_path / "share").mkdir()
    (place / "mariner" / "day.csv.gz").rename(tmp_path / "share" / "day.csv.gz")
    (place / "mariner" / "linked").symlink_to(tmp_path / "share")
    listing = SourceFolder(str(place)).list()
    assert [file.path for file in listing.files] == ["mariner/linked/day.csv.gz", "mariner/profile.yaml"]
    assert listing.dangling == ("mariner/day9.csv",) and listing.not_entered == ("a", "mariner/loop")
    run = taken(place, warehouse)
    assert len(run.ingested) == 1 and run.quarantined == ()
    assert "1 link leads nowhere" in run.remarks[0] and "mariner/day9.csv" in run.remarks[0]
    assert "2 folders are looked through under other paths already" in run.remarks[1]


def test_a_name_that_is_no_text_stops_no_other_file(place: Path, warehouse: Warehouse) -> None:
    Path(os.fsdecode(os.fsencode(place / "mariner") + b"/tag\xfc.csv")).write_bytes(b"x")
    run = taken(place, warehouse)
    assert len(run.ingested) == 1 and "mariner/tag\\udcfc.csv" in run.remarks[0]


def test_a_file_that_could_not_be_read_for_a_moment_is_tried_again(
    place: Path, warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(*_: object) -> None:
        raise KempfError("file_unreadable", "The share did not answer.", "Look at it.")

    with monkeypatch.context() as patched:
        patched.setattr("kempf.flows.jobs.inbox.take_inbox.ingest_log", failing)
        assert len(taken(place, warehouse).quarantined) == 2
    assert [Path(one.path).name for one in taken(place, warehouse).ingested] == ["day.csv.gz"]


def test_a_full_disk_is_no_files_fault(place: Path, warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise KempfError("disk_full", "There is no room left.", "Make room on it.")

    with monkeypatch.context() as patched:
        patched.setattr("kempf.flows.jobs.inbox.take_inbox.ingest_log", full)
        with pytest.raises(KempfError) as found:
            taken(place, warehouse)
    assert found.value.code == "disk_full"
    assert [Path(one.path).name for one in taken(place, warehouse).ingested] == ["day.csv.gz"]


def test_the_flow_fails_where_a_person_is_needed(place: Path, tmp_path: Path) -> None:
    from importlib import import_module

    flows = import_module("kempf.flows.fleet.flows")  # first: it sets what Prefect reads when it is imported
    from prefect.testing.utilities import prefect_test_harness

    for path in (place / "mariner").iterdir():
        os.utime(path, (1, 1))
    with prefect_test_harness(server_startup_timeout=180):
        _ends_as_failed(flows.ingest, place, tmp_path)


def _ends_as_failed(ingest: Any, place: Path, tmp_path: Path) -> None:
    state = ingest([str(place)], str(tmp_path / "w"), return_state=True)
    assert state.is_failed() and "minutes.pdf" in str(state.message)
    error = state.result(raise_on_failure=False)
    assert isinstance(error, NeedsAPerson) and len(error.details["ingested"]) == 1
    # of one vessel: where the command exits with 3, the flow fails
    pdf, log = place / "mariner" / "minutes.pdf", place / "mariner" / "day.csv.gz"
    state = ingest([str(log), str(pdf)], str(tmp_path / "w"), "mariner", return_state=True)
    assert state.is_failed()
    failed = state.result(raise_on_failure=False)
    assert isinstance(failed, LogsFailed) and isinstance(failed, DataRejected)
    assert [one["outcome"] for one in failed.details["outcomes"]] == ["unchanged", "failed"]
    assert ingest([str(log)], str(tmp_path / "w"), "mariner")[0]["outcome"] == "unchanged"


def test_the_commands(place: Path, mariner: Ship, tmp_path: Path) -> None:
    at = ("--warehouse", tmp_path / "w")
    ran = kempf("inbox", place, "--settle", 0, *at)
    assert ran.code == 3 and "1 log ingested" in ran.out and "minutes.pdf" in ran.err
    shown = kempf("inbox", place, "--settle", 0, "--json", *at)
    assert shown.code == 3 and shown.json["known"] == 2 and not shown.json["quarantined"][0]["new"]
    (listed,) = kempf("logs", "quarantine", "--json", *at).json
    assert listed["file"].endswith("minutes.pdf") and listed["next_step"]
    assert "minutes.pdf" in kempf("logs", "quarantine", *at).out
    assert kempf("logs", "release", "minutes.pdf", *at).code == 3
    assert kempf("logs", "dismiss", "minutes.pdf", "--reason", "no log", *at).code == 0
    assert "no file" in kempf("logs", "quarantine", *at).out
    assert kempf("inbox", place, "--settle", 0, *at).code == 0
    # a folder is taken in as its files, with the profile that lies in it
    refused = kempf("ingest", place / "mariner" / "day.csv.gz", "--vessel", "marinner", "--json", *at)
    assert refused.code == 4 and refused.json["error"]["code"] == "no_vessel"
    whole = kempf("ingest", place / "mariner", "--vessel", "mariner", "--json", *at)
    assert whole.code == 3 and [one["outcome"] for one in whole.json] == ["unchanged", "failed"]
    assert kempf("ingest", place / "mariner" / "day.csv.gz", "--vessel", "new", "--new-vessel", *at).code == 3
    (tmp_path / "none").mkdir()
    assert (
        kempf("ingest", tmp_path / "none", "--vessel", "mariner", "--json", *at).json["error"]["code"] == "empty_folder"
    )
