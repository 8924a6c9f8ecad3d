"""`kempf predict` on a simulated ship: what it prints, what it refuses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest
import yaml

from kempf.pipeline.segment.circles.turning_figures import TurningFigures, turning_figures
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.manoeuvre import SteadyCourse, TurningCircle
from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT, TrialSettings, simulate_trial
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets
from tests.conftest import Ship
from tests.workbench.driving import Ran, kempf


@pytest.fixture(scope="module")
def warehouse(mariner: Ship, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("predict")
    logs, place = mariner.write(folder / "logs"), folder / "warehouse"
    assert kempf("ingest", logs / "mariner.csv.gz", "--profile", logs / "profile.yaml", "--warehouse", place).code == 0
    assert kempf("identify", "--vessel", "mariner", "--warehouse", place).code == 0
    return place


def predicted(warehouse: Path, *arguments: object) -> Ran:
    return kempf("predict", *arguments, "--vessel", "mariner", "--warehouse", warehouse)


def test_a_turning_circle_has_an_interval_at_every_figure_and_says_what_lies_beyond(warehouse: Path) -> None:
    shown = predicted(warehouse, "turning-circle", "--json").json
    assert shown["manoeuvre"] == {"kind": "turning-circle", "rudder_deg": 35.0, "side": "starboard"}
    assert {"advance_m", "transfer_m", "tactical_diameter_m", "steady_yaw_rate_deg_s", "steady_drift_deg",
            "speed_loss_percent"} <= set(shown["figures"])  # fmt: skip
    for figure in shown["figures"].values():
        assert figure["low"] < figure["value"] < figure["high"]
    assert [one["parameter_set_id"] for one in shown["models"]] == [shown["parameter_set_id"]]
    assert shown["models"][0]["draws"] == 256
    by_quantity = {one["quantity"]: one for one in shown["extrapolated"]}
    assert by_quantity["rudder"]["covered"][1] == pytest.approx(20.0, abs=0.5)
    assert {one["name"] for one in shown["imo"]} == {"advance", "tactical diameter"}
    assert any("one model" in s or "taken alone" in s for s in shown["assumed"])
    assert shown["own_zigzags"]["zigzags"] == 1
    again = predicted(warehouse, "turning-circle", "--json").json
    assert again == shown


def test_another_steering_gear_is_asked_for_and_said(warehouse: Path) -> None:
    own = predicted(warehouse, "turning-circle", "--json").json
    slow = predicted(warehouse, "turning-circle", "--rudder-rate", 1, "--json").json
    assert slow["rudder_rate_deg_s"] == {"value": pytest.approx(1.0), "std": 0.0, "executes": 0}
    assert own["rudder_rate_deg_s"]["executes"] > 0
    # 35 deg at 1 deg/s instead of 5 take 28 s longer: half of that at the speed of the approach
    longer = slow["figures"]["advance_m"]["value"] - own["figures"]["advance_m"]["value"]
    assert longer == pytest.approx(0.5 * 28.0 * own["speed_m_s"], rel=0.25)
    assert any("at 1 deg/s, as asked for" in said for said in slow["assumed"])
    # her own zigzags were steered with her own gear
    assert slow["own_zigzags"] == own["own_zigzags"]


def test_a_circle_within_what_was_sailed_is_that_of_the_simulator(warehouse: Path) -> None:
    shown = predicted(warehouse, "turning-circle", "--rudder", 20, "--speed", 7.7175, "--side", "port", "--json").json
    truth = _sailed_in_calm_water(-20.0)
    for name in ("advance_m", "transfer_m", "tactical_diameter_m"):
        figure = shown["figures"][name]
        assert figure["value"] == pytest.approx(getattr(truth, name), rel=0.02), name
        assert figure["low"] <= getattr(truth, name) <= figure["high"], name
    assert shown["figures"]["steady_yaw_rate_deg_s"]["value"] < 0.0


def _sailed_in_calm_water(rudder_deg: float) -> TurningFigures:
    hull = HULLS["mariner"]
    trial = simulate_trial(TrialSettings(hull, (SteadyCourse(10.0), TurningCircle(rudder_deg, 540.0))))
    record, path = trial.truth.manoeuvres[1], trial.truth.trajectory
    rows = slice(round(record.start_s / path.step_s), round(record.end_s / path.step_s) + 1)
    v, _, psi, north, east, forward = path.state[rows].T
    speed, drift = np.hypot(forward, v), np.arctan2(-v, forward)
    return turning_figures(path.time_s[rows] - record.start_s, north, east, psi, speed, drift, 0.0)


def test_overshoots_are_a_list_and_lie_beside_the_measured_ones(warehouse: Path) -> None:
    ran = predicted(warehouse, "zigzag", "--angles", "20/20", "--compare", "--json")
    shown = ran.json
    assert len(shown["figures"]["overshoots_deg"]) == 4
    assert {"value", "low", "high"} == set(shown["figures"]["overshoots_deg"][0])
    measured = shown["measured"]
    assert len(measured) == 1
    assert measured[0]["sample"] == "fitted"
    first = measured[0]["figures"][0]
    assert first["measured"] == pytest.approx(first["value"], abs=4.0)
    table = predicted(warehouse, "zigzag", "--compare").out
    assert "measured, and predicted as each was sailed" in table
    # the wind of a zigzag is found in it
    assert measured[0]["wind_force_m_s2"] != 0.0
    assert "wind force of these" not in table
    assert "not compared" not in table
    none = predicted(warehouse, "zigzag", "--angles", "5/5", "--compare").out
    assert "not compared, as they are of other angles: 1 with --angles 20/20" in " ".join(none.split())
    assert "no manoeuvre of this kind" in none


def test_a_circle_sailed_in_the_wind_lies_within_what_the_wind_of_the_zigzags_does(
    warehouse: Path, mariner: Ship, tmp_path: Path
) -> None:
    place, logs = copytree(warehouse, tmp_path / "warehouse"), mariner.write(tmp_path / "logs")
    programme = (SteadyCourse(300.0), TurningCircle(-35.0, 560.0), SteadyCourse(60.0))
    settings = TrialSettings(
        HULLS["mariner"], programme, PAPER_ENVIRONMENT, seed=21, start_utc_ns=1_750_100_000 * 10**9
    )
    (logs / "circle.csv.gz").write_bytes(to_csv(simulate_trial(settings)))
    assert kempf("ingest", logs / "circle.csv.gz", "--profile", logs / "profile.yaml", "--warehouse", place).code == 0
    shown = predicted(place, "turning-circle", "--compare", "--json").json
    (measured,) = shown["measured"]
    assert measured["sample"] == "held_out" and measured["side"] == "port"
    # of the simulator's force, and it wanders by 1e-3
    assert measured["wind_force_m_s2"] == 0.0
    assert measured["wind_force_std_m_s2"] == pytest.approx(PAPER_ENVIRONMENT.wind_force.mean, rel=0.5)
    figures = {one["figure"]: one for one in measured["figures"]}
    assert {"advance_m", "transfer_m", "tactical_diameter_m", "steady_yaw_rate_deg_s"} <= set(figures)
    assert all(one["agrees"] for one in figures.values()), figures
    assert any("wind force of these manoeuvres is not known" in words for words in shown["judged"])
    # in calm water none of them is as wide
    for name, figure in shown["figures"].items():
        if name in ("transfer_m", "tactical_diameter_m"):
            assert figures[name]["high"] - figures[name]["low"] > 2.0 * (figure["high"] - figure["low"])


def test_a_model_is_predicted_at_full_scale_too(warehouse: Path, mariner: Ship, tmp_path: Path) -> None:
    logs, place = mariner.write(tmp_path / "logs"), tmp_path / "warehouse"
    (logs / "scale.yaml").write_text("model_scale: 4\n", encoding="utf-8")
    profiles = ("--profile", logs / "profile.yaml", "--profile", logs / "scale.yaml")
    assert kempf("ingest", logs / "mariner.csv.gz", *profiles, "--warehouse", place).code == 0
    assert kempf("identify", "--vessel", "mariner", "--warehouse", place).code == 0
    for kind in ("turning-circle", "spiral"):
        shown = predicted(place, kind, "--json").json
        own = shown["figures"]
        full = shown["full_scale"]["figures"]
        assert own.keys() == full.keys()
        assert predicted(warehouse, kind, "--json").json["full_scale"] is None
        if kind == "turning-circle":
            length = yaml.safe_load((logs / "profile.yaml").read_text(encoding="utf-8"))["length_m"]
            assert shown["full_scale"]["length_m"] == pytest.approx(4.0 * length)
            assert shown["full_scale"]["speed_m_s"] == pytest.approx(2.0 * shown["speed_m_s"])
            factors = {"advance_m": 4.0, "time_to_90_s": 2.0, "steady_yaw_rate_deg_s": 0.5, "steady_drift_deg": 1.0}
            for name, factor in factors.items():
                for end in ("value", "low", "high"):
                    assert full[name][end] == pytest.approx(factor * own[name][end]), name
        else:
            assert [one["value"] for one in full["from_port_deg_s"]] == pytest.approx(
                [0.5 * one["value"] for one in own["from_port_deg_s"]]
            )
    ran = predicted(place, "turning-circle")
    assert "at full scale" in ran.out
    assert "full scale by Froude's law, 1:4: what the lower Reynolds number" in " ".join(ran.out.split())
    assert "judged at full scale, 1:4:" in " ".join(ran.out.split())


@pytest.mark.parametrize("kind", ["turning-circle", "zigzag", "pull-out", "spiral"])
def test_every_manoeuvre_is_printed_and_drawn(kind: str, warehouse: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    ran = predicted(warehouse, kind, "--figure", tmp_path / "drawn.png")
    assert ran.code == 0, ran.err
    assert "95 % interval" in ran.out
    assert "assumed: calm, deep water" in ran.out
    assert (tmp_path / "drawn.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "code", "word"),
    [
        (["turning-circle", "--speed", 0], "speed_out_of_range", "expected more than 0"),
        (["turning-circle", "--speed", "nan"], "speed_out_of_range", "expected more than 0"),
        (["turning-circle", "--rudder-rate", 0], "rudder_rate_out_of_range", "expected more than 0"),
        (["turning-circle", "--rudder", 0], "rudder_out_of_range", "up to 60"),
        (["pull-out", "--rudder", 90], "rudder_out_of_range", "up to 60"),
        (["zigzag", "--angles", "20"], "angles_unreadable", "pair of angles"),
        (["zigzag", "--angles", "0/20"], "angles_out_of_range", "0/20"),
        (["zigzag", "--rudder", 20], "usage", "--angles"),
        (["spiral", "--angles", "20/20"], "usage", "--rudder"),
        (["turning-circle", "--figure", "x.gif"], "cannot_write", ".gif"),
    ],
)
def test_requests_that_make_no_manoeuvre_are_refused(
    arguments: list[object], code: str, word: str, warehouse: Path
) -> None:
    ran = predicted(warehouse, *arguments, "--json")
    assert ran.code == 2
    assert ran.json["error"]["code"] == code
    assert word in f"{ran.json['error']['message']} {ran.json['error']['next_step']}"


def test_a_spiral_of_a_stable_ship_says_that_there_is_no_loop(warehouse: Path) -> None:
    shown = predicted(warehouse, "spiral", "--rudder", 10, "--json").json
    width = shown["figures"]["loop_width_deg"]
    assert width["value"] == width["low"] == 0.0
    assert shown["unstable_on_a_straight_course"] == 0.0
    assert shown["manoeuvre"]["orders_deg"] == [10.0, 5.0, 0.0, -5.0, -10.0]


def test_a_vessel_without_a_set_and_a_set_without_errors_are_refused(
    warehouse: Path, mariner: Ship, tmp_path: Path
) -> None:
    logs = mariner.write(tmp_path / "logs")
    empty = tmp_path / "warehouse"
    profile = ("--profile", logs / "profile.yaml", "--warehouse", empty)
    assert kempf("ingest", logs / "mariner.csv.gz", *profile).code == 0
    ran = kempf("predict", "zigzag", "--vessel", "mariner", "--warehouse", empty, "--json")
    assert (ran.code, ran.json["error"]["code"]) == (4, "no_parameter_set")
    there = Warehouse(str(warehouse))
    one = parameter_sets.get(there, aliases.of_vessel(there, "mariner")["current"])
    bare = replace(one, parameter_set_id="ps-00000000000000ff", covariance_names=(), covariance=())
    parameter_sets.insert(there, [bare])
    ran = predicted(warehouse, "zigzag", "--set", "ps-00000000000000ff", "--json")
    assert (ran.code, ran.json["error"]["code"]) == (3, "set_without_covariance")


def test_an_unstable_set_is_refused_with_what_to_sail(warehouse: Path) -> None:
    there = Warehouse(str(warehouse))
    one = parameter_sets.get(there, aliases.of_vessel(there, "mariner")["current"])
    values = tuple(replace(p, value=0.3 * p.value) if p.name == "a22" else p for p in one.parameters)
    parameter_sets.insert(there, [replace(one, parameter_set_id="ps-00000000000000fe", parameters=values)])
    ran = predicted(warehouse, "turning-circle", "--set", "ps-00000000000000fe", "--json")
    assert (ran.code, ran.json["error"]["code"]) == (3, "predicts_no_ship")
    assert "spiral" in ran.json["error"]["next_step"]
