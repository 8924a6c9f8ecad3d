"""``kempf steer``: the law of a set on the simulated ship, beside one from wrong parameters."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.workbench.driving import kempf, one_of, refused

SHORT = ("--minutes", "8")


def steered(filled: Path, *options: object):
    chosen = () if "--set" in options else ("--set", one_of(filled, "ml"))
    short = () if "--minutes" in options else SHORT
    return kempf("steer", "--vessel", "mariner", *chosen, *short, *options, "--warehouse", filled)


def test_a_law_and_one_from_wrong_parameters(filled: Path):
    output = steered(filled, "--wrong", "4", "--json").json
    assert output["vessel"] == "mariner" and output["parameter_set_id"] == one_of(filled, "ml")
    right, wrong = output["laws"]
    assert right["closed_loop"]["stable"] and right["performance"]["kept"]
    assert right["performance"]["heading_rms_deg"] < 0.3
    assert list(right["law"]["gain"]) == ["v", "r", "psi", "F", "V_T"]
    assert len(right["closed_loop"]["poles"]) == 8
    assert wrong["performance"]["heading_rms_deg"] > right["performance"]["heading_rms_deg"]
    assert wrong["course_change"]["overshoot_deg"] > 2 * right["course_change"]["overshoot_deg"]
    assert wrong["closed_loop"]["modulus_margin"] < right["closed_loop"]["modulus_margin"]
    assert steered(filled, "--wrong", "4", "--json").json == output


def test_for_a_person_with_another_set(filled: Path):
    other = one_of(filled, "least-squares")
    output = steered(filled, "--wrong", other, "--method", "poles")
    assert output.code == 0, output
    assert "from wrong parameters" in output.out and f"wrong: {other} (mariner)" in output.out
    assert "heading rms, deg" in output.out and "modulus margin" in output.out
    alone = steered(filled)
    assert alone.code == 0 and "wrong" not in alone.out


def test_a_figure(filled: Path, tmp_path: Path):
    pytest.importorskip("matplotlib")
    path, again = tmp_path / "track.png", tmp_path / "again.png"
    for one in (path, again):
        assert steered(filled, "--wrong", "0.4", "--figure", one, "--json").json["figure"] == str(one)
    assert path.read_bytes().startswith(b"\x89PNG") and path.read_bytes() == again.read_bytes()
    refused(steered(filled, "--figure", path, "--json"), 2, "cannot_write")
    refused(steered(filled, "--figure", tmp_path / "track.doc", "--json"), 2, "cannot_write")
    refused(steered(filled, "--figure", tmp_path / "none" / "t.png", "--json"), 2, "cannot_write")


def test_wrong_requests_are_refused(filled: Path):
    refused(steered(filled, "--wrong", "-2", "--json"), 2, "wrong_factor")
    refused(steered(filled, "--wrong", "nan", "--json"), 2, "wrong_factor")
    refused(steered(filled, "--wrong", "ps-zzz", "--json"), 4, "no_parameter_set")
    refused(steered(filled, "--set", "ps-zzz", "--json"), 4, "no_parameter_set")
    refused(steered(filled, "--minutes", "3", "--json"), 2, "track_too_short")
    refused(steered(filled, "--minutes", "nan", "--json"), 2, "track_too_short")
    refused(steered(filled, "--speed", "0", "--json"), 2, "speed_not_positive")
    refused(kempf("steer", "--vessel", "nobody", "--warehouse", filled, "--json"), 4, "no_vessel")
