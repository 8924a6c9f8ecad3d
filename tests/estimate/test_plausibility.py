"""What is said against an estimate, and that nothing is said against a good one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from kempf.pipeline.estimate.one_step_fit import fit_percent
from kempf.pipeline.estimate.plausibility import plausibility_warnings
from kempf.pipeline.model.ship import mariner_like

GOOD = mariner_like(100.0).array()
SURE = 0.05 * np.abs(GOOD)


def fit(lag: float = 0.02, inside: float = 0.95) -> dict[str, Any]:
    return {"channels": {"yaw_rate": {"lag1_autocorrelation": lag, "inside_95_percent": inside}}}


def test_a_plausible_ship_with_white_errors_raises_no_doubt() -> None:
    assert plausibility_warnings(GOOD, SURE, fit()) == ()
    assert plausibility_warnings(GOOD, SURE, {}) == ()


WRONG = [(0, "a11 > 0"), (2, "a21 > 0"), (3, "a22 > 0"), (4, "b1 > 0")]


@pytest.mark.parametrize(("index", "word"), WRONG)
def test_a_wrong_sign_is_named(index: int, word: str) -> None:
    hull = GOOD.copy()
    hull[index] *= -1.0
    said = plausibility_warnings(hull, SURE, fit())
    assert len(said) == 1 and said[0].startswith(word)


def test_a_rudder_of_the_wrong_sign_is_named_once() -> None:
    said = plausibility_warnings(GOOD * [1, 1, 1, 1, -1, -1], SURE, fit())
    assert len(said) == 1 and "sign of the rudder channel" in said[0]


def test_a_parameter_lost_in_its_error_is_named() -> None:
    said = plausibility_warnings(GOOD, SURE * [1, 1, 30, 1, 1, 1], fit())
    assert len(said) == 1 and said[0].endswith("a21")
    assert plausibility_warnings(GOOD, np.full(6, np.nan), fit()) == ()


def test_coloured_errors_and_narrow_intervals_are_named() -> None:
    said = plausibility_warnings(GOOD, SURE, fit(lag=0.6, inside=0.7))
    assert len(said) == 2
    assert "0.60" in said[0] and "70 %" in said[1]


def test_fit_percent_is_the_one_of_matlab() -> None:
    measured = np.array([1.0, 2.0, 4.0, 7.0])
    error = np.array([0.1, -0.2, 0.0, 0.3])
    expected = 100 * (1 - np.sqrt(0.14) / np.sqrt(np.sum((measured - 3.5) ** 2)))
    assert fit_percent(measured, error) == pytest.approx(expected)
    assert fit_percent(measured, measured - 3.5) == pytest.approx(0.0)
    assert np.isnan(fit_percent(np.ones(4), error))
