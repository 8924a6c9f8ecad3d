"""What is damaged in a warehouse is found, and made again as far as the raw logs and the sealed copies reach."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from shutil import copytree, rmtree
from typing import Any

import pytest

from kempf.flows.jobs.corrections.correct_segments import plan_for
from kempf.flows.jobs.corrections.purge_logs import purge
from kempf.flows.jobs.corrections.remove_logs import move, remove, remove_vessel, rename_vessel, restore
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.repair.repair_warehouse import repair
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.state.former_vessel import former_vessels
from kempf.schemas.errors import KempfError
from kempf.schemas.tables import TABLES
from kempf.warehouse.storage import delta, table_cache
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, corrections, logs, notes, parameter_sets, purges, raw, segments, vessels
from kempf.warehouse.upkeep import compaction
from kempf.warehouse.upkeep.verify import verify
from tests.conftest import Ship
from tests.flows.content import fresh, seen
from tests.flows.test_brought_forward import take_in
from tests.workbench.driving import kempf


@pytest.fixture(scope="module")
def _filled(mariner: Ship, ferry: Ship, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two vessels with a log each, a correction, parameter sets."""
    folder = tmp_path_factory.mktemp("repair")
    warehouse = fresh(folder / "w")
    for ship, name, ending in ((mariner, "mariner", "nmea.gz"), (ferry, "ferry", "csv.gz")):
        path = ship.write(folder / name)
        ingest(warehouse, [path / f"{name}.{ending}"], given=read_profiles([path / "profile.yaml"]))
    assert logs.current(warehouse, "mariner")[0].tally.records_rejected > 0
    zigzag = segments.current(warehouse, "mariner")[0]
    plan_for(warehouse, zigzag.segment_id, "accept", "looked at").store(warehouse)
    for name in ("mariner", "ferry"):
        reprocess_vessel(warehouse, name)
    assert verify(warehouse) == []
    return folder


@pytest.fixture
def warehouse(_filled: Path, tmp_path: Path) -> Warehouse:
    return Warehouse(str(copytree(_filled / "w", tmp_path / "w")))


def content(warehouse: Warehouse) -> dict[str, list[dict[str, Any]]]:
    """What a warehouse says, but for in which run and from which versions of tables sets were made."""
    found = seen(warehouse)
    for row in found["parameter_sets"]:
        known = json.loads(row["provenance_json"])
        row["provenance_json"] = json.dumps({k: v for k, v in known.items() if k != "flow_run"}, sort_keys=True)
    return found


def flipped(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 16
    path.write_bytes(bytes(data))


def files(warehouse: Warehouse, table: str) -> list[Path]:
    assert warehouse.folder is not None
    return sorted(p for p in (warehouse.folder / table).rglob("*.parquet") if "_delta_log" not in p.parts)


def lose(warehouse: Warehouse, *tables: str) -> None:
    """Take whole tables away, with their seals."""
    assert warehouse.folder is not None
    for table in tables:
        rmtree(warehouse.folder / table)
    table_cache._kept.clear()


OF_LOGS = ("readings", "rejected", "examinations", "segments", "logs", "vessels")


@pytest.mark.parametrize(("table", "whole"), [(table, whole) for table in OF_LOGS for whole in (False, True)])
def test_what_logs_gave_is_made_again_from_their_bytes(warehouse: Warehouse, table: str, whole: bool) -> None:
    wanted = content(warehouse)
    if whole:
        lose(warehouse, table)
        assert f"The table {table} is gone." in [one.words for one in verify(warehouse)]
        with pytest.raises(KempfError, match=f"The table {table} is gone: it was written"):
            delta.read(warehouse, table)
    else:
        for path in files(warehouse, table):
            flipped(path)
    named = verify(warehouse)
    assert any(one.table == table and not one.past for one in named)
    refused = kempf("verify", "--warehouse", warehouse.uri, "--json")
    assert refused.code == 3 and len(refused.json) == len(named)
    done = repair(warehouse)
    assert done.done and done.left == []
    for name in ("mariner", "ferry"):
        reprocess_vessel(warehouse, name)
    found = content(warehouse)
    revisions = ("logs", "vessels")  # registers that were made again count their rows from one
    assert {k: v for k, v in found.items() if k not in revisions} == {
        k: v for k, v in wanted.items() if k not in revisions
    }
    for name in revisions:
        last = [[{**row, "revision": 0} for row in one[name]][-2:] for one in (found, wanted)]
        assert last[0] == last[1]
    assert verify(warehouse) == []
    assert warehouse.folder is not None
    assert whole or list((warehouse.folder / "damaged" / table).iterdir())


def test_what_no_log_gives_is_said_where_its_table_is_lost_and_then_all_is_well(warehouse: Warehouse) -> None:
    (current,) = [parameter_sets.get(warehouse, name) for name in aliases.of_vessel(warehouse, "ferry").values()]
    spec = {**current.model_spec, "effects": ["neutral_angle"]}
    with_effect = replace(current, parameter_set_id="ps-0123456789abcdef", model_spec=spec)
    parameter_sets.insert(warehouse, [with_effect])
    notes.add(warehouse, "ferry", "log", current.log_ids[0], "laden")
    lose(warehouse, "aliases", "corrections", "notes")
    assert [one.words for one in verify(warehouse)] == [
        f"The table {table} is gone." for table in TABLES if table in ("aliases", "corrections", "notes")
    ]
    done = repair(warehouse)
    assert done.left == [] and verify(warehouse) == [] and len(done.done) == 3
    said = " ".join(done.gone)
    assert "which set is current is chosen anew by `kempf reprocess`" in said and "named aliases are lost" in said
    assert f"her last one with effects is {with_effect.parameter_set_id} (neutral_angle)" in said
    assert "what people said of manoeuvres has to be said again" in said and "they have to be written again" in said
    # what was made from versions of the lost tables stands in no one's way
    assert compaction.vacuum(warehouse, 0.0)


def test_the_lost_model_of_a_vessel_is_named_with_what_to_do(warehouse: Warehouse) -> None:
    (current,) = aliases.of_vessel(warehouse, "ferry").values()
    aliases.point(warehouse, "ferry", current, "as-built")
    for path in files(warehouse, "parameter_sets"):
        flipped(path)
    table_cache._kept.clear()
    done = repair(warehouse)
    of_ferry = [one for one in done.left if "'ferry'" in one.words]
    assert {one.words.partition(" It was ")[2] for one in of_ferry} == {
        "the current model of 'ferry'.",
        "'as-built' of 'ferry'.",
    }
    assert all(current in one.words for one in of_ferry)
    steps = " ".join(one.next_step or "" for one in of_ferry)
    assert "cannot know which effects it had" in steps and "add them again with `kempf effects add`" in steps
    assert "`kempf params alias as-built ID --vessel ferry`" in steps
    assert all("that no name points to are made again" in words for words in done.gone)
    output = kempf("verify", "--warehouse", warehouse.uri)
    assert output.code == 3 and "next: kempf repair" not in output.out and "kempf effects add" in output.out


@pytest.mark.parametrize("table", ["readings", "examinations", "logs"])
@pytest.mark.parametrize("whole", [True, False])
def test_a_removed_log_is_mended_too_and_can_be_restored(warehouse: Warehouse, table: str, whole: bool) -> None:
    wanted = content(warehouse)
    (ferry,) = logs.current(warehouse, "ferry")
    remove(warehouse, [ferry], "not hers")
    if whole:
        lose(warehouse, table)
    else:
        for path in files(warehouse, table):
            flipped(path)
    profiles = vessels.profiles(warehouse)
    assert verify(warehouse) != []
    assert repair(warehouse).left == [] and verify(warehouse) == []
    assert [row.removed for row in logs.removed(warehouse)] == ["not hers"]
    assert logs.current(warehouse, "ferry") == [] and vessels.profiles(warehouse) == profiles
    restore(warehouse, ferry.log_id)
    reprocess_vessel(warehouse, "ferry")
    found = content(warehouse)
    for name in ("readings", "rejected", "segments", "examinations", "raw"):
        assert found[name] == wanted[name]
    assert verify(warehouse) == []


@pytest.mark.parametrize("also", [(), ("logs",)])
def test_a_purged_log_is_not_taken_in_again_where_the_receipts_are_lost(
    warehouse: Warehouse, ferry: Ship, also: tuple[str, ...], tmp_path: Path
) -> None:
    (row,) = logs.current(warehouse, "ferry")
    receipt = purge(warehouse, row.log_id, "the law")
    lose(warehouse, "purges", *also)
    assert repair(warehouse).left == [] and verify(warehouse) == []
    assert purges.of_logs(warehouse) == {row.log_id: receipt}
    path = ferry.write(tmp_path / "again")
    (outcome,) = ingest(warehouse, [path / "ferry.csv.gz"], "ferry")
    assert outcome.error is not None and outcome.error.code == "log_purged"


def test_sets_and_aliases_come_with_the_next_run_and_what_people_said_is_named_as_lost(warehouse: Warehouse) -> None:
    wanted = content(warehouse)
    pointed = aliases.of_vessel(warehouse, "ferry")
    for table in ("parameter_sets", "aliases", "corrections"):
        for path in files(warehouse, table):
            flipped(path)
    output = kempf("repair", "--warehouse", warehouse.uri, "--json")
    assert output.code == 2 and output.json["error"]["code"] == "not_confirmed"
    output = kempf("repair", "--yes", "--warehouse", warehouse.uri, "--json")
    assert output.code == 0 and output.json["left"] == []
    said = " ".join(output.json["lost"])
    assert "of the table corrections: what people said of manoeuvres has to be said again" in said
    assert "of the table parameter_sets: those of the present code are made again" in said
    assert corrections.all_of(warehouse) == []
    for name in ("mariner", "ferry"):
        reprocess_vessel(warehouse, name)
    ids = [row["parameter_set_id"] for row in wanted["parameter_sets"]]
    assert [row["parameter_set_id"] for row in content(warehouse)["parameter_sets"]] == ids
    assert aliases.of_vessel(warehouse, "ferry") == pointed


def test_sets_come_again_though_one_that_is_lost_was_the_current_one(tmp_path: Path) -> None:
    warehouse = fresh(tmp_path / "w")
    for day in range(2):
        take_in(warehouse, day)
    reprocess_vessel(warehouse, "ferry")
    wanted, pointed = content(warehouse)["parameter_sets"], aliases.of_vessel(warehouse, "ferry")
    # the pooled one, which is made behind the single ones
    assert len(parameter_sets.get(warehouse, pointed["current"]).segment_ids) == 2
    for path in files(warehouse, "parameter_sets"):
        flipped(path)
    repair(warehouse)
    assert not reprocess_vessel(warehouse, "ferry").failures
    assert aliases.of_vessel(warehouse, "ferry") == pointed and verify(warehouse) == []
    again = content(warehouse)["parameter_sets"]
    assert [row["parameter_set_id"] for row in again] == [row["parameter_set_id"] for row in wanted]


def test_a_warehouse_is_built_again_from_its_raw_logs_alone(warehouse: Warehouse, tmp_path: Path) -> None:
    wanted = content(warehouse)
    (row,) = logs.current(warehouse, "ferry")
    remove(warehouse, [row], "not hers")
    assert (raw.described(warehouse, row.log_id) or {})["removed"] == "not hers"
    restore(warehouse, row.log_id)
    place = Warehouse(str(tmp_path / "again"))
    place.create()
    assert warehouse.folder is not None and place.folder is not None
    copytree(warehouse.folder / "raw", place.folder / "raw")
    assert {one.table for one in verify(place)} == {"logs"}
    done = repair(place)
    assert done.left == [] and len(done.done) == 2
    for name in ("mariner", "ferry"):
        assert vessels.current(place, name) == vessels.current(warehouse, name)
        reprocess_vessel(place, name)
    found = content(place)
    for name in ("readings", "rejected", "raw"):
        assert found[name] == wanted[name]
    ids = [row["parameter_set_id"] for row in wanted["parameter_sets"]]
    assert [row["parameter_set_id"] for row in found["parameter_sets"]] == ids


def test_a_raw_log_that_is_in_no_table_and_of_which_it_is_not_known_whose_it_is_is_named(
    warehouse: Warehouse, tmp_path: Path
) -> None:
    (row,) = logs.current(warehouse, "ferry")
    place = Warehouse(str(tmp_path / "again"))
    place.create()
    assert warehouse.folder is not None and place.folder is not None
    copytree(warehouse.folder / "raw", place.folder / "raw")
    beside = place.folder / "raw" / row.log_id[:2] / f"{row.log_id}.json"
    beside.write_bytes(beside.read_bytes()[:100])
    done = repair(place)
    assert [(one.table, one.where) for one in done.left] == [("raw", f"{row.log_id}.json")]
    assert [one.next_step for one in done.left] == ["Ingest the original file again."]
    assert [one.vessel for one in logs.current(place)] == ["mariner"]


def test_a_table_that_is_gone_and_a_raw_log_that_is_damaged(warehouse: Warehouse) -> None:
    assert warehouse.folder is not None
    (row,) = logs.current(warehouse, "ferry")
    kept = warehouse.folder / "raw" / row.log_id[:2] / row.log_id
    flipped(kept)
    rmtree(warehouse.folder / "segments" / "_delta_log")
    table_cache._kept.clear()
    assert {one.table for one in verify(warehouse)} >= {"raw", "segments"}
    done = repair(warehouse)
    assert [one.table for one in done.left] == ["raw"]
    assert not any("Ingest the original file again" in words for words in done.gone)
    output = kempf("repair", "--yes", "--warehouse", warehouse.uri)
    assert output.code == 3 and output.out.count("Ingest the original file again.") == 1
    assert len(segments.current(warehouse)) == 2


def test_what_could_not_be_read_again_is_tried_by_the_next_repair(warehouse: Warehouse) -> None:
    wanted = content(warehouse)["readings"]
    lose(warehouse, "readings")
    (row,) = logs.current(warehouse, "ferry")
    assert warehouse.folder is not None
    kept = warehouse.folder / "raw" / row.log_id[:2] / row.log_id
    whole = kept.read_bytes()
    kept.write_bytes(whole[:-10])
    done = repair(warehouse)
    assert any(words.startswith("the log of the ingest") for words in done.gone)
    assert "damaged/unfinished.json" in {problem.where for problem in verify(warehouse)}
    kept.write_bytes(whole)
    assert repair(warehouse).left == [] and verify(warehouse) == []
    assert content(warehouse)["readings"] == wanted


def test_a_warehouse_in_which_all_is_well_is_left_alone(warehouse: Warehouse) -> None:
    assert kempf("verify", "--warehouse", warehouse.uri).out.strip() == "all is well"
    output = kempf("repair", "--warehouse", warehouse.uri)
    assert output.code == 0 and output.out.strip() == "nothing had to be done"


def newest(warehouse: Warehouse, table: str) -> Path:
    return max(files(warehouse, table), key=lambda path: path.stat().st_mtime_ns)


def test_a_removed_log_stays_removed_and_a_moved_one_where_it_was_moved(warehouse: Warehouse) -> None:
    (ferry,) = logs.current(warehouse, "ferry")
    remove(warehouse, [ferry], "not hers")
    flipped(newest(warehouse, "logs"))
    table_cache._kept.clear()
    assert repair(warehouse).left == []
    assert [row.removed for row in logs.removed(warehouse, "ferry")] == ["not hers"]
    assert logs.current(warehouse, "ferry") == []
    restore(warehouse, ferry.log_id)
    move(warehouse, ferry.log_id, "mariner", "copied into the wrong folder")
    flipped(newest(warehouse, "logs"))
    table_cache._kept.clear()
    assert repair(warehouse).left == []
    assert ferry.log_id in {row.log_id for row in logs.current(warehouse, "mariner")}
    assert (raw.described(warehouse, ferry.log_id) or {})["vessel"] == "mariner"


def cut_off(*_: object) -> None:
    raise KeyboardInterrupt


def test_a_repair_that_was_cut_off_is_finished_by_the_next(
    warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = content(warehouse)["segments"]
    for path in files(warehouse, "segments"):
        flipped(path)
    with monkeypatch.context() as patched:
        patched.setattr("kempf.flows.jobs.repair.repair_warehouse.register_profiles", cut_off)
        with pytest.raises(KeyboardInterrupt):
            repair(warehouse)
    assert [one.where for one in verify(warehouse)] == ["damaged/unfinished.json"]
    assert repair(warehouse).left == [] and content(warehouse)["segments"] == wanted


def test_profiles_come_again_and_what_was_current_stays(warehouse: Warehouse) -> None:
    before = files(warehouse, "vessels")
    newer = vessels.current(warehouse, "mariner").model_copy(update={"length_m": 99.0})
    vessels.register(warehouse, "mariner", newer)
    remove_vessel(warehouse, "ferry", "a rehearsal")
    for path in before:
        flipped(path)
    table_cache._kept.clear()
    assert repair(warehouse).left == []
    assert vessels.names(warehouse) == ["mariner"] and vessels.current(warehouse, "mariner").length_m == 99.0


def read_anew(warehouse: Warehouse) -> str:
    """Give the ferry a newer profile and read her log with it; return the hash of the earlier one."""
    earlier = vessels.current(warehouse, "ferry")
    vessels.register(warehouse, "ferry", earlier.model_copy(update={"length_m": 99.0}))
    reprocess_vessel(warehouse, "ferry")
    (row,) = logs.current(warehouse, "ferry")
    assert row.profile_sha256 != earlier.sha256
    return earlier.sha256


@pytest.mark.parametrize("also", [(), ("readings",)])
def test_profiles_of_earlier_ingests_are_not_asked_for(warehouse: Warehouse, also: tuple[str, ...]) -> None:
    earlier = read_anew(warehouse)
    lose(warehouse, "vessels", *also)
    done = repair(warehouse)
    assert done.left == [] and verify(warehouse) == []
    assert any("those of earlier ingests" in words for words in done.gone)
    assert earlier not in {version.profile_sha256 for version in vessels.all_versions(warehouse)}
    assert vessels.current(warehouse, "ferry").length_m == 99.0
    again = repair(warehouse)
    assert again.done == again.gone == []


@pytest.mark.parametrize("newer", [False, True])
def test_renames_are_told_from_the_logs(warehouse: Warehouse, newer: bool) -> None:
    if newer:
        read_anew(warehouse)
    rename_vessel(warehouse, "ferry", "o'ferry", "sold: to Oslo")
    rename_vessel(warehouse, "o'ferry", "fähre", "sold again")
    wanted, profiles = former_vessels(warehouse), vessels.profiles(warehouse)
    lose(warehouse, "vessels")
    done = repair(warehouse)
    assert done.left == [] and verify(warehouse) == []
    assert former_vessels(warehouse) == wanted and vessels.profiles(warehouse) == profiles
    assert [one.now for one in wanted.values()] == ["fähre", "fähre"]
    again = repair(warehouse)
    assert again.done == again.gone == []


def test_a_vessel_whose_logs_were_removed_counts_still(warehouse: Warehouse) -> None:
    remove(warehouse, logs.current(warehouse, "ferry"), "not hers")
    profiles = vessels.profiles(warehouse)
    lose(warehouse, "vessels")
    done = repair(warehouse)
    assert done.left == [] and verify(warehouse) == []
    assert vessels.profiles(warehouse) == profiles and former_vessels(warehouse) == {}
    assert any(words.startswith("whether 'ferry' was removed or renamed") for words in done.gone)


def test_what_logs_that_went_to_two_vessels_do_not_tell_is_said(tmp_path: Path) -> None:
    warehouse = fresh(tmp_path / "w")
    for day in range(2):
        take_in(warehouse, day)
    for name, row in zip(("one", "two"), logs.current(warehouse, "ferry"), strict=True):
        vessels.register(warehouse, name, vessels.current(warehouse, "ferry"))
        move(warehouse, row.log_id, name, "hers")
    lose(warehouse, "vessels")
    done = repair(warehouse)
    assert done.left == [] and verify(warehouse) == [] and vessels.names(warehouse) == ["one", "two"]
    assert sum(words.startswith("the profile of 'ferry'") for words in done.gone) == 1


@pytest.mark.parametrize("removed", [False, True])
def test_a_profile_that_is_kept_nowhere_has_its_step(warehouse: Warehouse, removed: bool) -> None:
    (row,) = logs.current(warehouse, "ferry")
    if removed:
        remove(warehouse, [row], "not hers")
    lose(warehouse, "vessels")
    assert warehouse.folder is not None
    (warehouse.folder / "raw" / row.log_id[:2] / f"{row.log_id}.json").unlink()
    (left,) = repair(warehouse).left
    assert left.where == row.profile_sha256 and left.next_step == "Ingest the original files again with the profile."
    if not removed:
        vessels.register(warehouse, "ferry", vessels.current(warehouse, "mariner"))
        (left,) = repair(warehouse).left
        assert left.next_step == "`kempf reprocess` reads them with the present profile."
        reprocess_vessel(warehouse, "ferry")
        assert verify(warehouse) == []


def test_the_marker_is_mended_by_the_command(warehouse: Warehouse) -> None:
    assert warehouse.folder is not None
    marker = warehouse.folder / "kempf-warehouse.json"
    for harm in (Path.unlink, lambda path: path.write_text("{")):
        harm(marker)
        output = kempf("repair", "--warehouse", warehouse.uri, "--json")
        assert output.code == 0 and output.json["done"] == ["The file that marks the warehouse was written anew."]
        assert len(logs.current(warehouse)) == 2
