"""``kempf history --changes``: from parameter sets in a warehouse to what is said, and what is left out of it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets, segments, vessels
from kempf.warehouse.tables.parameter_set import ParameterSet, StoredValue
from tests.history.made import NAMES, UNITS, history, step
from tests.warehouse.samples import inputs, parameter_set, segment
from tests.workbench.driving import Ran, kempf, refused

VESSEL = "aurora"


def made_sets(n: int, shift: np.ndarray | None = None, **changes: object) -> list[ParameterSet]:
    h = history(n, shift=shift)
    made = []
    for i in range(n):
        std = np.sqrt(np.diag(h.covariance[i]))
        estimates = tuple(
            StoredValue(name, float(v), float(s), u)
            for name, v, s, u in zip(NAMES, h.value[i], std, UNITS, strict=True)
        )
        values: dict[str, object] = {
            "parameters": estimates,
            "covariance_names": NAMES,
            "covariance": tuple(tuple(float(x) for x in row) for row in h.covariance[i]),
            "segment_ids": (f"seg-{i}",),
        }
        made_of = inputs(start_utc_ns=int(h.time_utc_ns[i]), settings={"of": str(sorted(changes))})
        made.append(parameter_set(VESSEL, made_of, **{**values, "settings": {}, **changes}))
    return made


@pytest.fixture
def place(tmp_path: Path) -> Path:
    vessels.register(Warehouse(str(tmp_path / "w")), VESSEL, VesselProfile())
    return tmp_path / "w"


def put(place: Path, *sets: ParameterSet) -> None:
    parameter_sets.insert(Warehouse(str(place)), sets)


def asked(place: Path, *more: object) -> Ran:
    return kempf("history", "--vessel", VESSEL, "--changes", *more, "--warehouse", place)


def test_a_new_rudder_is_reported_as_text_and_as_json(place: Path, tmp_path: Path) -> None:
    put(place, *made_sets(16, step(16, 9, b1=0.1, b2=0.1)))
    document = asked(place, "--figure", tmp_path / "f.png", "--json").json
    assert set(document) == {"vessel", "history", "changes"}
    assert len(document["history"]) == 16 * 6
    (one,) = document["changes"]
    assert set(one) == {
        *("model", "model_sha256", "estimator", "parameter_set_ids", "left_out", "sets", "occasions", "pooled"),
        *("verdict", "why", "p_value", "level", "changes", "scatter_between_trials", "smallest_step_seen", "figure"),
    }
    assert (one["verdict"], one["sets"], len(one["occasions"])) == ("step", 16, 16)
    assert one["pooled"]["poolable"] is False
    (change,) = one["changes"]
    assert set(change) == {
        *("kind", "between", "interval", "confidence", "p_value", "bic_ahead_of_other_form", "parameters", "alone"),
    }
    assert change["between"] == [one["occasions"][8], one["occasions"][9]]
    b2 = change["parameters"]["b2"]
    assert set(b2) == {*("before", "change", "std", "low", "high", "percent", "percent_std", "unit", "moved")}
    assert b2["moved"] and b2["unit"] == "1/m^2" and b2["low"] < 0.1 * 6.28e-05 < b2["high"]
    assert (tmp_path / "f.png").read_bytes().startswith(b"\x89PNG")
    output = asked(place)
    assert output.code == 0
    assert "step between " in output.out and "do not agree within their standard errors" in output.out
    assert "seen with 90 % probability" in output.out


def test_no_change_says_what_would_have_been_seen(place: Path) -> None:
    put(place, *made_sets(12))
    (one,) = asked(place, "--json").json["changes"]
    assert (one["verdict"], one["changes"]) == ("no change seen", [])
    assert all(one["smallest_step_seen"][name]["percent"] > 0 for name in NAMES)
    assert "no change seen" in asked(place).out


def test_what_cannot_be_compared_is_left_out_and_counted(place: Path) -> None:
    sets = made_sets(8)
    nan = tuple((math.nan,) * 6 for _ in NAMES)
    blind = tuple(replace(e, std=None) for e in sets[0].parameters)
    put(place, *sets[:4])
    put(place, replace(sets[4], convergence={"converged": False}))
    put(place, replace(sets[5], segment_ids=("seg-0", "seg-1")))
    put(place, replace(sets[6], segment_ids=("seg-0",)))
    put(place, replace(sets[7], covariance=nan, parameters=blind))
    (one,) = asked(place, "--json").json["changes"]
    assert one["parameter_set_ids"] == [s.parameter_set_id for s in sets[:4]]
    assert one["left_out"] == {
        "made of several segments": 1,
        "not converged": 1,
        "of a segment that is there already": 1,
        "without standard errors": 1,
    }
    output = asked(place).out
    assert output.splitlines()[-1] == "left out: 1 set made of several manoeuvres"
    assert "1 set not converged" in output and "several segments" not in output


def test_pooled_sets_are_left_out_in_one_line_and_every_line_fits(place: Path) -> None:
    put(place, *(replace(s, start_utc_ns=10**18 + i) for i, s in enumerate(made_sets(4))))
    for i, model in enumerate(("tank", "plain + wind_force")):
        pooled = made_sets(2, estimator="ml-pooled", model_name=model, model_sha256=f"{i}" * 64)[i]
        put(place, replace(pooled, segment_ids=("seg-0", "seg-1")))
    lines = asked(place).out.splitlines()
    assert lines[0] == "model linear, estimator ml: not testable with these data"
    assert lines[-1] == "left out: 2 sets made of several manoeuvres"
    assert not any("tank" in line for line in lines) and max(map(len, lines)) <= 100
    assert "on 1 occasion, at least 4 occasions are needed" in " ".join(" ".join(lines).split())


def test_of_pooled_sets_alone_nothing_can_be_tested(place: Path) -> None:
    put(place, replace(made_sets(1)[0], segment_ids=("seg-0", "seg-1")))
    assert asked(place).out.splitlines() == [
        "not testable with these data: no set of a single manoeuvre to compare",
        "left out: 1 set made of several manoeuvres",
    ]


def test_a_voyage_that_two_logs_hold_counts_once(place: Path) -> None:
    """Two logs hold the same noise of the sea: their sets say the same, and twice is not two."""
    ours, theirs = made_sets(4), made_sets(4, estimator="ml", log_ids=("b" * 64,))
    put(place, *ours, *(replace(s, segment_ids=(f"twin-{i}",)) for i, s in enumerate(theirs)))
    for log, letter in (("a" * 64, "seg"), ("b" * 64, "twin")):
        found = [
            replace(segment(VESSEL, log, letter, s.start_utc_ns), segment_id=f"{letter}-{i}")
            for i, s in enumerate(ours)
        ]
        segments.replace(Warehouse(str(place)), {(VESSEL, letter): found})
    (one,) = asked(place, "--json").json["changes"]
    assert one["parameter_set_ids"] == [s.parameter_set_id for s in ours] and one["sets"] == 4
    assert one["left_out"] == {"of a manoeuvre that another log holds": 4}


def test_only_one_model_and_estimator_are_compared(place: Path) -> None:
    put(place, *made_sets(4), *made_sets(4, estimator="paper"), *made_sets(3, model_name="tank", model_sha256="d" * 64))
    output = asked(place, "--json").json["changes"]
    assert [(one["model"], one["estimator"], one["sets"]) for one in output] == [
        ("linear", "ml", 4),
        ("tank", "ml", 3),
        ("linear", "paper", 4),
    ]
    assert output[1]["verdict"] == "not testable with these data"
    assert output[1]["p_value"] is None


def test_trials_of_one_day_are_one_occasion_unless_said_otherwise(place: Path) -> None:
    put(place, *(replace(s, start_utc_ns=10**18 + i * 3_600_000_000_000) for i, s in enumerate(made_sets(6))))
    (one,) = asked(place, "--json").json["changes"]
    assert (one["verdict"], len(one["occasions"])) == ("not testable with these data", 1)
    assert "12 h" in one["why"]
    (other,) = asked(place, "--occasion", "0", "--json").json["changes"]
    assert len(other["occasions"]) == 6
    assert other["verdict"] != one["verdict"]


def test_without_sets_nothing_is_reported(place: Path) -> None:
    assert asked(place, "--json").json == {"vessel": VESSEL, "history": [], "changes": []}
    assert "No parameter set" in asked(place).out
    long_ago = asked(place, "--as-of", "2001-01-01", "--json").json
    assert long_ago["changes"] == []


def test_the_plain_history_is_as_it_was_and_loads_no_engine(place: Path) -> None:
    put(place, *made_sets(4))
    output = kempf("history", "--vessel", VESSEL, "--warehouse", place, "--json").json
    assert isinstance(output, list) and len(output) == 24
    assert asked(place, "--json").json["history"] == output


def test_wrong_requests(place: Path, tmp_path: Path) -> None:
    put(place, *made_sets(4))
    plain = kempf("history", "--vessel", VESSEL, "--figure", tmp_path / "f.png", "--warehouse", place, "--json")
    refused(plain, 2, "figure_without_changes")
    refused(asked(place, "--figure", tmp_path / "f.txt", "--json"), 2, "figure_format")
    refused(asked(place, "--figure", tmp_path / "no" / "f.png", "--json"), 2, "cannot_write")
    (tmp_path / "f.png").write_bytes(b"hers")
    refused(asked(place, "--figure", tmp_path / "f.png", "--json"), 2, "cannot_write")
    assert (tmp_path / "f.png").read_bytes() == b"hers"
    refused(asked(place, "--occasion", "-1", "--json"), 2, "usage")
