"""What is no zigzag through the command line: said at ingest, listed with figures, and never fitted."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.manoeuvre import RudderHold, SteadyCourse, TurningCircle, ZigzagTest
from kempf.pipeline.simulate.trial import TrialSettings, simulate_trial
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets, segments
from tests.segment.sailed import direct_spiral
from tests.workbench.driving import Ran, kempf

ANGLES = (15.0, 8.0, 3.0, 0.0, -3.0, -8.0, -15.0)


@pytest.fixture(scope="module")
def taken(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Ran]:
    """A ferry's day: a zigzag, a turning circle with a pull-out behind it, and a spiral."""
    folder = tmp_path_factory.mktemp("day")
    settings = TrialSettings(
        HULLS["ferry"],
        (
            SteadyCourse(120.0),
            ZigzagTest(20.0, 20.0, legs=5),
            SteadyCourse(200.0, heading_deg=40.0),
            TurningCircle(-35.0, 560.0),
            RudderHold(0.0, 150.0),
            SteadyCourse(200.0),
            *direct_spiral(ANGLES, 140.0),
        ),
    )
    (folder / "day.csv").write_bytes(to_csv(simulate_trial(settings)))
    profile = logger_profile(settings).model_dump(mode="json", exclude_defaults=True)
    (folder / "profile.yaml").write_text(yaml.safe_dump(profile, sort_keys=False), encoding="utf-8")
    log, warehouse = folder / "day.csv", folder / "warehouse"
    return warehouse, kempf("ingest", log, "--profile", folder / "profile.yaml", "--warehouse", warehouse)


def test_ingest_says_what_else_was_found(taken: tuple[Path, Ran]) -> None:
    _, ran = taken
    assert ran.code == 0, ran
    assert "1 zigzag: 20/20 to starboard; kept for validation: turning circle with 35 deg to port" in ran.out
    assert "pull out with 35 deg to port, spiral with 15 deg to starboard" in ran.out


def test_segments_lists_every_kind_with_its_figures(taken: tuple[Path, Ran]) -> None:
    warehouse, _ = taken
    listed = kempf("segments", "--warehouse", warehouse).out
    assert "turning circle, rudder 35 deg to port, turned 5" in listed
    assert "pull-out from 35 deg to port; not judged" in listed
    assert "spiral, 13 steps from 15 deg to starboard; no loop seen" in listed
    assert "IMO advance passed: at most 4.5 L" in listed
    advance = next(line for line in listed.splitlines() if line.startswith("  advance:"))
    metres, lengths = float(advance.split()[1]), float(advance.split()[-2])
    assert lengths == pytest.approx(metres / HULLS["ferry"].length_m, abs=0.01)
    found = {one["kind"]: one for one in kempf("segments", "--warehouse", warehouse, "--json").json}
    assert sorted(found) == ["pull_out", "spiral", "turning_circle", "zigzag"]
    assert found["turning_circle"]["psi0_deg"] is None
    for kind in ("pull_out", "spiral", "turning_circle"):
        for name, figure in found[kind]["detail"]["figures"].items():
            assert set(figure) == {"value", "low", "high", "why"}, name
            if figure["low"] is None:
                assert figure["why"], name
            else:
                assert figure["low"] <= figure["value"] <= figure["high"], name


def test_no_job_takes_them_for_zigzags(taken: tuple[Path, Ran]) -> None:
    uri, _ = taken
    warehouse = Warehouse(str(uri))
    assert [s.kind for s in segments.current(warehouse, "ferry")] == ["zigzag"]
    assert len(segments.every(warehouse, "ferry")) == 4
    again = kempf("identify", "--vessel", "ferry", "--estimator", "least-squares", "--warehouse", uri, "--json")
    assert again.code == 0, again
    fitted = [name for one in parameter_sets.get_all(warehouse, "ferry") for name in one.segment_ids]
    assert fitted == [s.segment_id for s in segments.current(warehouse, "ferry")]
    (vessel,) = kempf("vessels", "list", "--warehouse", uri, "--json").json
    assert vessel["segments"] == 1


def test_taking_the_log_in_again_finds_the_same(taken: tuple[Path, Ran]) -> None:
    uri, _ = taken
    folder = uri.parent
    before = segments.every(Warehouse(str(uri)))
    again = kempf("ingest", folder / "day.csv", "--profile", folder / "profile.yaml", "--warehouse", uri, "--json").json
    (log,) = again if isinstance(again, list) else again["logs"]
    assert log["outcome"] == "unchanged"
    assert log["segments"] == [s.segment_id for s in before if s.is_zigzag]
    assert [one["kind"] for one in log["other_manoeuvres"]] == [s.kind for s in before if not s.is_zigzag]
    assert [s.as_json("") for s in segments.every(Warehouse(str(uri)))] == [s.as_json("") for s in before]
