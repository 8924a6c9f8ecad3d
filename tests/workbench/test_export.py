"""``kempf export``: what other programs read is what the set says; and ``kempf params steering``."""

from __future__ import annotations

import csv
import json
import runpy
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.io import loadmat

from kempf.pipeline.model.ship import Hull, discrete_from_continuous
from tests.workbench.driving import HULL, kempf, one_of, refused


def exported(filled: Path, form: str, *options: object):
    return kempf("export", form, one_of(filled, "ml"), *options, "--warehouse", filled)


def shown(filled: Path, estimator: str = "ml"):
    return kempf("params", "show", one_of(filled, estimator), "--warehouse", filled, "--json").json


def hull(filled: Path) -> Hull:
    return Hull(*(shown(filled)["parameters"][name]["value"] for name in HULL))


@pytest.mark.parametrize("form", ["yaml", "csv"])
def test_text_is_what_params_export_writes(filled: Path, form: str):
    output = exported(filled, form)
    old = kempf("params", "export", one_of(filled, "ml"), "--format", form, "--warehouse", filled)
    assert (output.code, output.out) == (0, old.out) and old.code == 0


def test_yaml_holds_all_that_is_promised(filled: Path):
    content, one = yaml.safe_load(exported(filled, "yaml").out), shown(filled)
    assert content["parameters"] == one["parameters"]
    assert np.shape(content["covariance"]["values"]) == (len(content["covariance"]["names"]),) * 2
    assert content["provenance"]["inputs"]["log_ids"] == one["provenance"]["inputs"]["log_ids"]
    assert {"fit", "parent", "noise", "model"} <= set(content)


def test_csv_is_one_row_a_number(filled: Path):
    rows = list(csv.DictReader(exported(filled, "csv").out.splitlines()))
    assert [row["name"] for row in rows if row["group"] == "parameters"] == HULL
    assert all(float(row["std"]) > 0 and row["unit"] for row in rows)


def test_control_module_runs_and_is_the_model(filled: Path, tmp_path: Path):
    control = pytest.importorskip("control", reason="python-control is not installed")
    path = tmp_path / "ship.py"
    output = exported(filled, "control", "--step", "0.5", "--out", path)
    assert output.code == 0 and output.out == ""
    made = runpy.run_path(str(path))
    assert made["PARAMETERS"] == {n: p["value"] for n, p in shown(filled)["parameters"].items()}
    smooth, sampled = made["continuous"], made["discrete"]
    assert isinstance(smooth, control.StateSpace) and smooth.isctime() and sampled.dt == 0.5
    assert smooth.state_labels == sampled.state_labels == ["v", "r", "psi", "F", "c_N", "c_E"]
    assert smooth.input_labels == ["rudder"]
    assert smooth.output_labels == ["lateral_speed", "yaw_rate", "heading", "cross_track_speed"]
    assert set(made["UNITS"]) == {*smooth.state_labels, *smooth.input_labels, *smooth.output_labels}
    V = made["SPEED_M_S"]
    A, B = discrete_from_continuous(hull(filled), V, 0.5)
    assert sampled.A[:2, :2] == pytest.approx(A) and sampled.B[:2] == pytest.approx(B)
    again = control.c2d(smooth, 0.5)
    assert np.allclose(again.A, sampled.A, rtol=1e-9) and np.allclose(again.B, sampled.B, rtol=1e-9)
    # steady turn per rudder by python-control and by Nomoto's K
    turn = control.ss2tf(smooth)["yaw_rate", "rudder"]
    K = kempf("params", "steering", one_of(filled, "ml"), "--warehouse", filled, "--json").json["nomoto"]["constants"][
        "K"
    ]
    assert np.real(turn(1e-7j)) == pytest.approx(K["value"], rel=1e-3)
    spread = [made["STANDARD_ERRORS"][name] for name in HULL]
    assert np.sqrt(np.diag(made["COVARIANCE"])) == pytest.approx(spread)
    gain = control.dlqe(sampled.A, np.eye(6), sampled.C[:3], made["Q"], made["R"])[0]
    assert gain.shape == (6, 3) and np.all(np.abs(np.linalg.eigvals(sampled.A - gain @ sampled.C[:3])) < 1.0)


def test_mat_file_is_the_model(filled: Path, tmp_path: Path):
    path, other = tmp_path / "ship.mat", tmp_path / "again.mat"
    assert exported(filled, "mat", "--speed", "6", "--course", "90", "--out", path).code == 0
    assert exported(filled, "mat", "--speed", "6", "--course", "90", "--out", other).code == 0
    assert path.read_bytes() == other.read_bytes()
    held = loadmat(path)
    A, B = hull(filled).continuous(6.0)
    assert held["A"][:2, :2] == pytest.approx(A) and held["B"][:2] == pytest.approx(B)
    n = held["A"].shape[0]
    assert held["C"].shape == (4, n) and held["D"].shape == (4, 1) and held["Ad"].shape == (n, n)
    assert [str(cell[0]) for cell in held["state_names"][:, 0]] == ["v", "r", "psi", "F", "c_N", "c_E"]
    assert [str(cell[0]) for cell in held["parameter_names"][:, 0]] == HULL
    assert held["parameter_covariance"] == pytest.approx(np.array(shown(filled)["covariance"]["values"])[:6, :6])
    assert held["parameter_set_id"][0] == one_of(filled, "ml") and held["vessel"][0] == "mariner"
    # on an easterly course the northward stream sets to port: eq. (19)
    assert held["C"][0, 4:] == pytest.approx([-1.0, 0.0], abs=1e-12)


@pytest.mark.parametrize("form", ["yaml", "csv", "control", "mat"])
def test_files_as_json(filled: Path, tmp_path: Path, form: str):
    path = tmp_path / "file"
    output = exported(filled, form, "--out", path, "--json")
    assert output.json == {"parameter_set_id": one_of(filled, "ml"), "format": form, "out": str(path), "text": None}
    refused(exported(filled, form, "--out", path, "--json"), 2, "cannot_write")
    if form != "mat":
        assert exported(filled, form, "--json").json["text"].encode() == path.read_bytes()


def test_wrong_requests_are_refused(filled: Path, tmp_path: Path):
    refused(exported(filled, "mat", "--json"), 2, "no_file_given")
    refused(exported(filled, "control", "--speed", "0", "--json"), 2, "speed_not_positive")
    refused(exported(filled, "control", "--step", "-1", "--json"), 2, "step_not_positive")
    refused(exported(filled, "control", "--course", "nan", "--json"), 2, "course_not_finite")
    refused(
        kempf("export", "mat", "ps-zzz", "--out", tmp_path / "x", "--warehouse", filled, "--json"),
        4,
        "no_parameter_set",
    )
    assert not (tmp_path / "x").exists()


def test_steering_of_a_set(filled: Path):
    name = one_of(filled, "ml")
    output = kempf("params", "steering", name, "--warehouse", filled, "--json").json
    constants = output["nomoto"]["constants"]
    assert list(constants) == ["K", "T1", "T2", "T3", "T", "K'", "T'"]
    assert all(set(c) == {"value", "std", "unit", "interval_95"} and c["std"] > 0 for c in constants.values())
    truth = {"K": 0.185, "T2": 7.8, "T3": 18.5}  # published of the simulated ship
    for key, exact in truth.items():
        assert abs(constants[key]["value"] - exact) < 4 * constants[key]["std"]
    assert output["stability"]["verdict"] in ("stable", "unstable", "cannot be determined from these data")
    assert 0.0 <= output["stability"]["probability_stable"] <= 1.0
    faster = kempf(
        "params", "steering", name, "--speed", str(2 * output["speed_m_s"]), "--warehouse", filled, "--json"
    ).json
    assert faster["nomoto"]["constants"]["K"]["value"] == pytest.approx(2 * constants["K"]["value"])
    assert faster["nomoto"]["constants"]["K'"]["value"] == pytest.approx(constants["K'"]["value"])
    human = kempf("params", "steering", name, "--warehouse", filled)
    assert human.code == 0 and "on a straight course: " in human.out and "\nT3 " in human.out
    json.dumps(output)
    refused(
        kempf("params", "steering", name, "--speed", "-1", "--warehouse", filled, "--json"), 2, "speed_not_positive"
    )
