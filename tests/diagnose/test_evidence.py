"""What a report shows of a diagnosis: means, quartiles, smoothed motions; stored and read without a change."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.diagnose.evidence.added_variable import binned_means
from kempf.pipeline.diagnose.evidence.unmodelled_acceleration import quartiles
from kempf.pipeline.predict import smoothed_states
from kempf.schemas.diagnosis_evidence import Quartiles, evidence_from_json


def test_binned_means_lie_on_the_line_within_their_intervals():
    rng = np.random.default_rng(7)
    x = rng.standard_normal(5000)
    middle, mean, half = binned_means(x, x + rng.standard_normal(5000))
    assert middle.size == 14 and np.all(np.diff(middle) > 0)
    assert np.all(np.abs(mean - middle) < 2.5 * half)


def test_quartiles_over_bins_of_equal_width():
    x = np.repeat([0.0, 12.0], 100)
    y = np.concatenate([np.arange(100.0), np.full(100, 5.0)])
    found = quartiles(x, y)
    assert found.middle.tolist() == [0.5, 11.5] and found.median.tolist() == [49.5, 5.0]
    assert (found.low[0], found.high[0]) == (24.75, 74.25)
    assert quartiles(np.zeros(0), np.zeros(0)).median.size == 0


def test_transitions_of_the_smoother_are_exact_exponentials():
    """Two half steps make a whole one."""
    A = np.array([[[-0.1, -2.0], [0.001, -0.05]]])
    W = np.array([[[1e-3, 1e-4], [1e-4, 2e-3]]])
    Phi, Q = smoothed_states._sampled(A, W, 2.0)
    half, q = smoothed_states._sampled(A, W, 1.0)
    assert Phi[0] == pytest.approx(half[0] @ half[0], rel=1e-12)
    assert Q[0] == pytest.approx(half[0] @ q[0] @ half[0].T + q[0], rel=1e-12)


def test_curves_keep_six_digits_and_what_is_unknown():
    middle = np.array([1.0 / 3.0, np.nan, -np.inf, 0.0])
    one = Quartiles(middle=middle, low=middle, median=middle, high=np.zeros((2, 0)))
    back = Quartiles.model_validate_json(one.model_dump_json())
    assert back.middle[0] == 0.333333 and np.isnan(back.middle[1:3]).all() and back.middle[3] == 0.0
    assert back.high.shape == (2, 0)
    assert back.model_dump_json() == one.model_dump_json()


def test_evidence_in_another_form_is_none():
    assert evidence_from_json('{"models": []}') is None and evidence_from_json("") is None
