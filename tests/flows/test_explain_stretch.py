"""A stretch that a person chooses, and what every effect would explain of it."""

from __future__ import annotations

from pathlib import Path
from shutil import copytree
from typing import Any

import numpy as np
import pytest

from tests.late import VESSEL, run
from tests.made_once import made_once
from tests.workbench.driving import kempf

#: effects that all say that the rudder is late: a stretch does not tell one from the other
LATE = {"rudder_lag", "dead_time", "rate_limit", "backlash"}


@pytest.fixture(scope="module")
def identified(late_ingested: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ship whose rudder answers late, simulated by a program of its own, with the plain model."""

    def identify(folder: Path) -> None:
        copytree(late_ingested, folder)
        run(folder, "identify", "--vessel", VESSEL)

    return made_once(tmp_path_factory, "late_identified", identify)


def explained(folder: Path, start: str, end: str) -> Any:
    return run(folder, "explain", "--vessel", VESSEL, "--from", start, "--to", end, "--json").json


def test_the_worst_stretch_is_explained_by_what_is_wrong_with_the_ship(identified: Path):
    where = run(identified, "compare", "--vessel", VESSEL, "--where", "--json").json["where"]
    sample = "held_out" if where["held_out"] else "fitted"
    worst = next(one for one in where[sample]["worst"] if one["channel"] == "yaw_rate")
    start, end = (np.datetime64(worst[name].rstrip("Z"), "ns") for name in ("start", "end"))
    wide = np.timedelta64(5, "s")
    found = explained(identified, str(start - wide), str(end + wide))
    assert found["verdict"] == "stands_out" and found["held_out"] == (sample == "held_out")
    first = found["effects"][0]
    assert first["effect"] in LATE and first["p_adjusted"] < 0.01
    scores = [one["score"] for one in found["effects"] if one["score"] is not None]
    assert len(scores) > 10 and min(scores) >= 0.0
    assert all(
        0.0 <= one["p_value"] <= one["p_adjusted"] <= 1.0 for one in found["effects"] if one["score"] is not None
    )
    assert {one["effect"]: one["why"] for one in found["effects"]}["load_condition"]  # one log: cannot be seen
    # by all manoeuvres the same effect has the same sign, and a smaller error
    for name, here in first["size"].items():
        every = first["everywhere"]["size"][name]
        assert here["value"] * every["value"] > 0.0 and every["std"] < here["std"]


def test_a_stretch_in_which_the_rudder_is_still_says_nothing(identified: Path):
    segment = run(identified, "segments", "--vessel", VESSEL, "--json").json[0]
    start = np.datetime64(segment["start"].rstrip("Z"), "ns") + np.timedelta64(20, "s")
    found = explained(identified, str(start), str(start + np.timedelta64(40, "s")))
    assert found["verdict"] == "nothing_stands_out"


def test_what_cannot_be_explained_says_why(identified: Path):
    first, second, *_ = run(identified, "segments", "--vessel", VESSEL, "--json").json
    start = np.datetime64(first["start"].rstrip("Z"), "ns")
    assert explained(identified, str(start), str(start + np.timedelta64(5, "s")))["verdict"] == "too_short"

    def refused(begin: str, end: str) -> tuple[int, str]:
        done = kempf(
            *("explain", "--vessel", VESSEL, "--from", begin, "--to", end), "--warehouse", identified / "w", "--json"
        )
        return done.code, done.json["error"]["code"]

    assert refused("2001-01-01", "2001-01-02") == (4, "no_stretch")
    assert refused(first["start"], second["end"]) == (2, "stretch_over_several")
    both = ("explain", "--vessel", VESSEL, "--from", first["start"], "--to", second["end"], "--json")
    # logs of a basin may share their instants: then the manoeuvre says which
    for one in (first, second):
        assert run(identified, *both, "--segment", one["segment_id"][:9]).json["segment_id"] == one["segment_id"]
    nobody = kempf(*both, "--segment", "seg-nobody", "--warehouse", identified / "w")
    assert (nobody.code, nobody.json["error"]["code"]) == (4, "no_run")
    assert refused(first["end"], first["start"]) == (2, "window_empty")
    assert refused("noon", first["end"]) == (2, "not_a_time")
