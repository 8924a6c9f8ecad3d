"""The jobs as plain functions: what they give back, what they store, what they leave alone."""

from __future__ import annotations

from pathlib import Path
from shutil import copytree

import pytest
import yaml

from kempf.flows.jobs.identify.identify_vessel import Request, build, identify_vessel, inputs_of
from kempf.flows.jobs.identify.parameter_set_of import SetRequest
from kempf.flows.jobs.ingest.files import read_model, read_profiles
from kempf.flows.jobs.ingest.ingest_logs import ingest, settle_vessel
from kempf.flows.jobs.ingest.register_vessel import set_vessel
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.rerun_set import rerun
from kempf.flows.process.wrap_error import wrapped
from kempf.pipeline.channels.instruments import from_readings
from kempf.schemas.errors import KempfError, NotFound, UsageError
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, logs, parameter_sets, readings, runs, segments, vessels
from tests.conftest import Ship
from tests.flows.content import fresh, versions

LEAST_SQUARES = Request(estimator="least-squares")


def loaded(harbour: Path) -> VesselProfile:
    return read_profiles([harbour / "profile.yaml"])


@pytest.fixture(scope="module")
def _stocked(harbour: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("stocked") / "w"
    outcomes = ingest(fresh(place), [harbour / "mariner.nmea.gz", harbour / "mariner.mcap"], given=loaded(harbour))
    assert [o.outcome for o in outcomes] == ["new", "new"]
    return place


@pytest.fixture
def stocked(_stocked: Path, tmp_path: Path) -> Warehouse:
    """A copy of a warehouse with two logs of one zigzag, which the test may change."""
    return fresh(copytree(_stocked, tmp_path / "w"))


def test_progress_is_shown_from_the_first_to_the_last(harbour: Path, tmp_path: Path):
    stated: list[tuple[int, int, str]] = []

    def progress(done: int, total: int, what: str) -> None:
        stated.append((done, total, what))

    paths = [harbour / "mariner.csv.gz", harbour / "none"]
    ingest(fresh(tmp_path / "w"), paths, given=loaded(harbour), progress=progress)
    identify_vessel(fresh(tmp_path / "w"), "mariner", LEAST_SQUARES, progress=progress)
    assert stated == [
        (0, 2, "reading mariner.csv.gz"),
        (1, 2, "reading none"),
        (2, 2, "done"),
        (0, 1, "identifying 1 segments of mariner.csv.gz"),
        (1, 1, "done"),
    ]


def test_the_three_formats_hold_one_zigzag(harbour: Path, stocked: Warehouse):
    ingest(stocked, [harbour / "mariner.csv.gz"], given=loaded(harbour))
    found = segments.current(stocked)
    assert len(found) == 3
    executes = [s.executes_utc_ns for s in found]
    assert len({len(e) for e in executes}) == 1
    spread = [max(times) - min(times) for times in zip(*executes, strict=True)]
    assert max(spread) < 500_000_000


def test_a_given_profile_is_laid_over_the_stored_one(stocked: Warehouse):
    name, profile = settle_vessel(stocked, "mariner", VesselProfile(length_m=200.0))
    assert (name, profile.vessel, profile.length_m) == ("mariner", "mariner", 200.0)
    assert profile.sources == vessels.current(stocked, "mariner").sources
    another = settle_vessel(stocked, "another", None, new_vessel=True)
    assert another == ("another", VesselProfile(vessel="another"))
    with pytest.raises(UsageError, match="No vessel is named"):
        settle_vessel(stocked, None, VesselProfile())


def test_identify_stores_each_set_once_points_to_the_last_and_builds_it_again(stocked: Warehouse):
    first = identify_vessel(stocked, "mariner")
    assert [o.new for o in first] == [True, True]
    at = versions(stocked)
    again = identify_vessel(stocked, "mariner")
    assert [o.new for o in again] == [False, False]
    assert [o.parameter_set for o in again] == [o.parameter_set for o in first]
    assert versions(stocked) == at
    assert first[-1].parameter_set is not None
    current = {"current": first[-1].parameter_set.parameter_set_id}
    assert aliases.of_vessel(stocked, "mariner") == current
    result = rerun(stocked, current["current"])
    assert (result.verdict, result.differences, result.code_changed, result.packages_changed) == (
        "bit-identical",
        [],
        False,
        {},
    )
    assert versions(stocked) == at, "a rerun stores nothing"
    identify_vessel(stocked, "mariner", LEAST_SQUARES)  # a baseline is nobody's current model
    assert aliases.of_vessel(stocked, "mariner") == current


def test_another_model_makes_another_set(stocked: Warehouse):
    asked = [LEAST_SQUARES, Request(ModelSpec(name="other"), "least-squares"), Request(ModelSpec(), "least-squares")]
    made = [identify_vessel(stocked, "mariner", request) for request in asked]
    ids = [o.parameter_set.parameter_set_id for outcomes in made for o in outcomes if o.parameter_set]
    assert ids[0:2] == ids[4:6]
    assert set(ids[0:2]).isdisjoint(ids[2:4])


def test_a_segment_that_cannot_be_identified_stops_no_other(mariner: Ship, stocked: Warehouse, tmp_path: Path):
    # a log without GNSS holds a zigzag, but no lateral speed
    path = tmp_path / "blind.nmea"
    path.write_bytes(b"".join(line for line in mariner.lines if b"$GP" not in line))
    (outcome,) = ingest(stocked, [path], "mariner")
    assert len(outcome.segments) == 1
    outcomes = identify_vessel(stocked, "mariner", LEAST_SQUARES)
    failed = [o for o in outcomes if o.error is not None]
    assert [o.error.code for o in failed if o.error] == ["channel_missing"]
    assert len(outcomes) == 3 and sum(o.parameter_set is not None for o in outcomes) == 2


def test_a_set_is_a_function_of_its_inputs(stocked: Warehouse):
    (segment, _), profile = segments.current(stocked), vessels.current(stocked, "mariner")
    inputs = inputs_of(segment, profile.sha256, LEAST_SQUARES)
    instruments = from_readings(readings.read(stocked, segment.ingest_id))
    request = SetRequest(inputs, profile, "mariner", (segment.segment_id,), {})
    one, two = (build({segment.log_id: instruments}, request) for _ in range(2))
    assert one == two
    assert len(parameter_sets.summaries(stocked)) == 0


def test_reprocess_does_what_changed_and_no_more(stocked: Warehouse):
    first = reprocess_vessel(stocked, "mariner", LEAST_SQUARES)
    assert (first.status, first.logs, first.reread, first.new_sets, first.kept_sets) == ("changed", 2, 0, 2, 0)
    at = versions(stocked)
    second = reprocess_vessel(stocked, "mariner", LEAST_SQUARES, changed_only=False)
    assert (second.status, second.new_sets, second.kept_sets) == ("unchanged", 0, 2)
    assert second.verified == {"bit-identical": 2}
    assert versions(stocked) == at
    vessels.register(stocked, "mariner", vessels.current(stocked, "mariner").model_copy(update={"length_m": 150.0}))
    third = reprocess_vessel(stocked, "mariner", LEAST_SQUARES)
    assert (third.status, third.reread, third.new_sets, third.segments) == ("changed", 2, 2, 2)
    assert {run.status for run in runs.all_runs(stocked, "reprocess")} == {"changed", "unchanged"}


def test_reprocess_goes_on_behind_a_damaged_log(stocked: Warehouse):
    identify_vessel(stocked, "mariner", LEAST_SQUARES)
    damage(stocked, logs.current(stocked)[0].log_id)
    checked = reprocess_vessel(stocked, "mariner", LEAST_SQUARES, changed_only=False)
    assert (checked.status, checked.verified) == ("failed", {"bit-identical": 1})
    assert [f["error"]["code"] for f in checked.failures] == ["raw_bytes_damaged"]
    vessels.register(stocked, "mariner", vessels.current(stocked, "mariner").model_copy(update={"length_m": 150.0}))
    reread = reprocess_vessel(stocked, "mariner", LEAST_SQUARES)
    assert (reread.status, reread.reread, reread.new_sets) == ("failed", 1, 1)
    assert [f["error"]["code"] for f in reread.failures] == ["raw_bytes_damaged"]
    # the log is still in as it was read before
    assert len(logs.current(stocked)) == len(segments.current(stocked)) == 2


def damage(warehouse: Warehouse, log_id: str) -> None:
    assert warehouse.folder is not None
    kept = warehouse.folder / "raw" / log_id[:2] / log_id
    data = bytearray(kept.read_bytes())
    data[len(data) // 2] ^= 0xFF
    kept.write_bytes(data)


def test_a_vessel_that_is_not_there_is_reported(stocked: Warehouse):
    report = reprocess_vessel(stocked, "nobody")
    assert report.status == "failed"
    assert report.failures[0]["error"]["code"] == "no_vessel"


def test_set_vessel(stocked: Warehouse, harbour: Path, tmp_path: Path):
    assert not set_vessel(stocked, "mariner", [harbour / "profile.yaml"])
    wider = tmp_path / "wider.yaml"
    wider.write_text(yaml.safe_dump({"beam_m": 30.0}))
    assert set_vessel(stocked, "mariner", [wider])
    assert vessels.current(stocked, "mariner") == VesselProfile(vessel="mariner", beam_m=30.0)
    with pytest.raises(UsageError):
        set_vessel(stocked, "mariner", [])


def test_a_model_from_a_file(tmp_path: Path):
    path = tmp_path / "model.yaml"
    path.write_text("name: stream\ncurrent: lateral\n")
    assert read_model(path) == ModelSpec(name="stream", current="lateral")
    path.write_text("effects: [rudder_lag]\n")
    assert read_model(path).effects == ("rudder_lag",)
    path.write_text("base: guesswork\n")
    with pytest.raises(UsageError, match="guesswork"):
        read_model(path)


def test_nothing_to_identify_from(tmp_path: Path):
    with pytest.raises(NotFound, match="no warehouse"):
        identify_vessel(fresh(tmp_path / "w"), "mariner")


def test_an_unforeseen_error_keeps_its_cause():
    error = KeyError("x")
    wrapped_error = wrapped(error)
    assert (wrapped_error.code, wrapped_error.exit_code, wrapped_error.__cause__) == ("internal", 1, error)
    known = KempfError("a", "b", "c")
    assert wrapped(known) is known
