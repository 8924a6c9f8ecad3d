"""What is wrong with logs and models is said after the work, marks them, and decides by a file of limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest

from kempf.flows.fleet import report as fleet_report
from kempf.flows.fleet.plan import do_fleet
from kempf.flows.jobs.ingest.files import read_profiles, read_quality
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.flows.jobs.reprocess.vessel_quality import marks, quality_of
from kempf.schemas.errors import UsageError
from kempf.schemas.quality import FINDINGS, NO_LIMITS, FleetLimits, Limits
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, parameter_sets, segments
from kempf.warehouse.tables.parameter_set import ParameterSet
from tests.conftest import Ship
from tests.flows.content import fresh
from tests.workbench.driving import kempf

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def _filled(mariner: Ship, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A zigzag, a voyage without one, and a log without a rudder."""
    folder = mariner.write(tmp_path_factory.mktemp("quality"))
    (folder / "voyage.nmea").write_bytes(b"".join(mariner.lines[:900]))
    without = [line for line in mariner.lines if b"RSA" not in line]
    assert len(without) < len(mariner.lines)
    (folder / "no_rudder.nmea").write_bytes(b"".join(without))
    warehouse = fresh(folder / "w")
    names = ("mariner.nmea.gz", "voyage.nmea", "no_rudder.nmea")
    ingest(warehouse, [folder / name for name in names], given=read_profiles([folder / "profile.yaml"]))
    reprocess_vessel(warehouse, "mariner")
    return folder


@pytest.fixture
def warehouse(_filled: Path, tmp_path: Path) -> Warehouse:
    return Warehouse(str(copytree(_filled / "w", tmp_path / "w")))


def spoilt(warehouse: Warehouse, change: Callable[[ParameterSet], ParameterSet]) -> ParameterSet:
    """Store a set beside the only one, as if it had come out so."""
    (stored,) = parameter_sets.get_all(warehouse, "mariner")
    changed = replace(change(stored), parameter_set_id="ps-0123456789abcdef")
    parameter_sets.insert(warehouse, [changed])
    return changed


def test_a_log_of_a_turning_circle_alone_is_no_finding(warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch) -> None:
    (zigzag,) = segments.current(warehouse, "mariner")
    (voyage,) = (log for log in logs.current(warehouse, "mariner") if log.file_name == "voyage.nmea")
    circle = replace(zigzag, kind="turning_circle", ingest_id=voyage.ingest_id, log_id=voyage.log_id)
    monkeypatch.setattr(segments, "found_in", lambda *_: [zigzag, circle])
    assert {finding.kind for finding in quality_of(warehouse, "mariner")} == {"missing_channels"}


def test_logs_and_sets_are_judged(warehouse: Warehouse) -> None:
    kinds = {one.kind: one for one in quality_of(warehouse, "mariner")}
    assert set(kinds) == {"no_zigzag", "missing_channels"}
    assert kinds["no_zigzag"].words == (
        "voyage.nmea: no manoeuvre was found, neither one to fit nor one to hold a model against."
    )
    assert kinds["missing_channels"].words.startswith("no_rudder.nmea: no rudder_angle in this log")
    (zigzag,) = segments.current(warehouse, "mariner")
    assert marks(warehouse) == {}
    bad = spoilt(warehouse, lambda one: replace(one, convergence={**one.convergence, "converged": False}))
    (found,) = (one for one in quality_of(warehouse, "mariner") if one.kind == "not_converged")
    assert found.subject == bad.parameter_set_id and "did not converge" in found.words
    assert marks(warehouse, "mariner") == {zigzag.segment_id: ["not converged (ml)"]}
    (shown,) = (one for one in kempf("segments", "--warehouse", warehouse.uri, "--json").json if one["marks"])
    assert shown["segment_id"] == zigzag.segment_id
    assert f"{zigzag.segment_id[:12]}: not converged (ml)" in kempf("segments", "--warehouse", warehouse.uri).out
    history = ("history", "--vessel", "mariner", "--parameter", "b2", "--warehouse", warehouse.uri)
    assert {row["parameter_set_id"]: row["converged"] for row in kempf(*history, "--json").json}[
        bad.parameter_set_id
    ] is False
    assert kempf(*history).out.count("not converged") == 1


def test_zigzags_that_share_no_hull_and_such_as_are_left_out(warehouse: Warehouse) -> None:
    (zigzag,) = segments.current(warehouse, "mariner")
    pooling = {"segments": 4, "p_value": 1e-9, "may_be_pooled": False}
    spoilt(
        warehouse,
        lambda one: replace(
            one, convergence={**one.convergence, "pooling": pooling, "left_out": {zigzag.segment_id: "too short"}}
        ),
    )
    found = {one.kind: one.words for one in quality_of(warehouse, "mariner")}
    assert "its 4 manoeuvres do not share one hull (p = 1e-09)" in found["no_shared_hull"]
    assert f"leaves {zigzag.segment_id} out: too short" in found["left_out"]
    assert marks(warehouse) == {zigzag.segment_id: ["left out of the pooled set"]}


def report(vessel: str = "a", **counts: int) -> dict[str, Any]:
    findings = [
        {"kind": kind, "subject": "x", "words": f"{kind} of x."} for kind, n in counts.items() for _ in range(n)
    ]
    return {
        **{"vessel": vessel, "status": "unchanged", "failures": [], "verified": {}, "findings": findings},
        **dict.fromkeys(("logs", "reread", "searched", "segments", "new_sets", "kept_sets"), 0),
    }


def test_limits_decide_and_say_why() -> None:
    limits = FleetLimits(no_zigzag=1, not_converged=0, vessels={"b": Limits(not_converged=None)})
    assert fleet_report.beyond(report(no_zigzag=1), limits) == []
    assert fleet_report.beyond(report(no_zigzag=2, channels=9), limits) == ["2 logs without a manoeuvre to fit"]
    # what a vessel does not name is as for the fleet
    assert fleet_report.beyond(report("b", not_converged=5, no_zigzag=2), limits) == [
        "2 logs without a manoeuvre to fit"
    ]
    assert fleet_report.needs_a_person(report(not_converged=1), limits)
    assert not fleet_report.needs_a_person(report(not_converged=1), NO_LIMITS)
    reports = [report(not_converged=1), report("b", channels=1)]
    words = fleet_report.sentence(reports, limits)
    assert words == "2 vessels: 2 unchanged; 1 beyond the limits of quality: a"
    page = fleet_report.markdown(reports, limits)
    assert "1 parameter set that did not converge, 1 log whose channels contradict each other." in page
    assert "| a | 1 parameter set that did not converge | not_converged of x. |" in page
    assert [row["findings"] for row in fleet_report.table(reports)] == [
        "1 parameter set that did not converge",
        "1 log whose channels contradict each other",
    ]


def test_a_night_over_bad_models_is_not_green_until_they_are_seen_to(warehouse: Warehouse, tmp_path: Path) -> None:
    limits = tmp_path / "quality.yaml"
    limits.write_text("no_zigzag: 0\n", encoding="utf-8")
    asked = ("reprocess", "--quality", limits, "--warehouse", warehouse.uri)
    first = kempf(*asked)
    assert first.code == 5 and "mariner is beyond the limits of quality: 1 log without a manoeuvre to fit" in first.err
    # nothing changed since: it is said again, without looking at her
    (again,) = do_fleet(warehouse)
    assert again["status"] == "unchanged" and {one["kind"] for one in again["findings"]} == {
        "no_zigzag",
        "missing_channels",
    }
    assert kempf(*asked, "--json").code == 5
    limits.write_text("no_zigzag: 0\nvessels: {mariner: {no_zigzag: 1}}\n", encoding="utf-8")
    assert kempf(*asked).code == 0


def test_a_file_of_limits_that_is_none(tmp_path: Path) -> None:
    shipped = read_quality(ROOT / "quality.yaml")
    assert {kind for kind in FINDINGS if shipped.limit("any", kind) == 0} == {
        *("not_converged", "no_shared_hull", "missing_channels", "channels"),
    }
    path = tmp_path / "quality.yaml"
    path.write_text("", encoding="utf-8")
    assert read_quality(path) == NO_LIMITS
    for text, place in (("no_zigzags: 1", "no_zigzags"), ("channels: -1", "channels"), ("[1]", "file")):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(UsageError, match=place) as refused:
            read_quality(path)
        assert refused.value.code == "quality_invalid"
