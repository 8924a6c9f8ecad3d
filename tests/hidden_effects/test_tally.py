"""The score of made-up answers whose counts are known by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.diagnose.hidden_effects.draw import draw_confusion
from benchmarks.diagnose.hidden_effects.score import page
from benchmarks.diagnose.hidden_effects.tally import Judged, Share, targets


def judged(
    kind: str,
    effect: str,
    verdict: str,
    sets: list[list[str]],
    ratio: float = 100.0,
    value: float = 1.0,
    last: float = 2.0,
    immaterial: str | None = None,
):
    parameters = {"c": {"value": value, "std": 0.1, "unit": "1"}}
    named = [{"effects": s, "refits": [{"effect": n, "parameters": parameters} for n in s]} for s in sets]
    first, then = (
        {"fitted_misfit": 0.1 + one, "left_out_misfit": 0.2 + one, "held_out_misfit": one} for one in (3.0, last)
    )
    then["beside_the_rung_below"] = {
        "fitted": {"falls_by": 0.2, "in_std": 5.0},
        "held_out": {"falls_by": 1.0 - last / 3.0, "in_std": 10.0 * (3.0 - last)},
    }
    ladder = [{"held_out_error": 0.4, "one_leg_ahead": first}, {"held_out_error": 0.22, "one_leg_ahead": then}]
    aside = (
        [{"effects": [immaterial], "refits": [{"effect": immaterial, "parameters": parameters}]}] if immaterial else []
    )
    stated = {"verdict": verdict, "sets": named, "immaterial": aside, "ladder": ladder, "candidates": []}
    truth = {"kind": kind, "effect": effect, "hull": "ferry", "noise": 1.0, "disturbance": "calm", "strength": 1}
    truth |= {"parameters": {"c": 1.0}, "sold": verdict == "ambiguous"}
    oracle = {"likelihood_ratio": ratio, "held_out": 0.21} if kind == "catalogue" else {}
    return Judged(truth, {"diagnosis": stated, "seconds": {"diagnose": 3.0}}, oracle)


CASES = [
    judged("none", "none", "adequate", []),
    judged("none", "none", "explained", [["backlash"]]),
    judged("outsider", "bank_shear", "unexplained", [["waves"]]),
    judged("outsider", "bank_shear", "explained", [["waves"]]),
    judged("catalogue", "rudder_lag", "explained", [["rudder_lag"]]),
    judged("catalogue", "rudder_lag", "ambiguous", [["dead_time", "rudder_lag"]], value=1.3),
    judged("catalogue", "rudder_lag", "explained", [["rate_limit"]], last=3.3),
    judged("catalogue", "rudder_lag", "adequate", [], ratio=20.0),
    judged("catalogue", "waves", "adequate", [], value=1.1, immaterial="waves"),
    judged("none", "none", "adequate", [], immaterial="waves"),
]


def test_every_target_counts_what_it_says() -> None:
    found = {asked: stated for asked, _, stated in targets(CASES)}
    begins = {
        "true effect in a named set": "75 % (3 of 4",
        "of these claimed": "50 % (2 of 4",
        "named with the 3 m boat": "no case",
        "named with instruments": "100 % (1 of 1",
        "every ladder falls": "90 % (9 of 10",
        "no step of a ladder rises": "90 % (9 of 10",
        "exact name": "50 % (1 of 2",
        "mean size": "1.33",
        "any claim": "33 % (1 of 3",
        "anything certain": "33 % (1 of 3",
        "outside the catalogue: refused": "50 % (1 of 2",
        "outside the catalogue: a confident": "50 % (1 of 2",
        "present though": "0 % (0 of 10",
        "held-out error": "100 % (4 of 4",
        "95 % interval": "67 % (2 of 3",
    }
    for asked, stated in begins.items():
        (line,) = [text for name, text in found.items() if name.startswith(asked)]
        assert line.startswith(stated), asked


@pytest.mark.parametrize(("effect", "value"), [("rudder_stall", 1.02**-2), ("backlash", 1.02), ("gyro_bias", 1.0)])
def test_a_rudder_that_is_off_is_true_of_its_own_log(effect: str, value: float) -> None:
    stated = {"effect": effect, "parameters": {"c": {"value": value, "std": 1e-4, "unit": "1"}}}
    said = {"diagnosis": {"sets": [{"effects": [effect], "refits": [stated]}], "immaterial": []}}
    truth = {"effect": effect, "parameters": {"c": 1.0}}
    assert Judged({**truth, "sold": True}, said, {}).covered
    assert Judged({**truth, "sold": False}, said, {}).covered == (value == 1.0)


def test_the_interval_of_a_share_is_wilsons() -> None:
    # its ends are where the distance from what was found is 1.96 standard errors of the true share
    z2 = 1.96**2
    low, high = sorted(np.roots([1 + z2 / 10, -(2 * 0.1 + z2 / 10), 0.1**2]))
    assert str(Share(1, 10)) == f"10 % (1 of 10; 95 %: {100 * low:.0f} to {100 * high:.0f} %)"
    assert str(Share(0, 0)) == "no case"


def test_the_page_and_its_picture_are_made(tmp_path: Path) -> None:
    lines = page(CASES, 336)
    assert lines[0].startswith("10 of 336 cases were diagnosed: 5 catalogue, 3 none, 2 outsider.")
    assert next(line for line in lines if line.startswith("| rudder_lag")).startswith("| rudder_lag | 4 | 3 | 2 | 2 |")
    draw_confusion(CASES, tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 5000
    assert judged("catalogue", "x", "explained", []).against_plain == pytest.approx(0.55)
