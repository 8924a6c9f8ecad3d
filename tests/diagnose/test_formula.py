"""The formula search on columns whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.diagnose.screening.formula_search import search
from kempf.pipeline.diagnose.screening.ridge_reference import TERMS


def test_the_terms_that_made_the_force_are_proposed_with_their_sizes():
    random = np.random.default_rng(1)
    X = random.normal(0.0, 1.0, (4000, len(TERMS)))
    u = 0.4 * X[:, 7] - 0.2 * X[:, 40] + random.normal(0.0, 1.0, 4000)
    parts = [slice(1000 * k, 1000 * (k + 1)) for k in range(4)]
    found = search(X, u, parts, TERMS)
    assert [one.target for one in found[:2]] == [next(iter(TERMS[k].terms)) for k in (7, 40)]
    for one, k, size in zip(found, (7, 40), (0.4, -0.2), strict=False):
        text = next(iter(TERMS[k].terms.values()))
        before, after = text.split("*c")
        assert one.expression.startswith(f"{before}*") and one.expression.endswith(after)
        stated = float(one.expression[len(before) + 1 : len(one.expression) - len(after)])
        assert stated == pytest.approx(size, abs=0.06)
    assert found[0].gain > found[1].gain > 20.0


def test_noise_proposes_nothing():
    random = np.random.default_rng(2)
    X = random.normal(0.0, 1.0, (4000, len(TERMS)))
    parts = [slice(1000 * k, 1000 * (k + 1)) for k in range(4)]
    formulas = [search(X, random.normal(0.0, 1.0, 4000), parts, TERMS) for _ in range(5)]
    assert sum(bool(one) for one in formulas) <= 1
