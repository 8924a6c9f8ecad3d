"""Whether runs share one set of parameters, asked of the end of a fit."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from kempf.pipeline.diagnose.screening.unsure_instants import WithInstants
from kempf.pipeline.estimate.agreement import LEVEL, Agreement, agreement_of
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.pooled_fit import PooledFit, fit
from kempf.pipeline.model.effect_model import EffectModel
from kempf.schemas.effects import get
from tests.estimate.test_plain_fit import SPEC, fitted, run, with_rudder


def with_neutral_angle(*offset_rad: float) -> PooledFit:
    """Fit hull and neutral angle to runs whose logs show a rudder that stands off by so much."""
    runs = [with_rudder(run(seed), 1.0, -offset) for seed, offset in zip((21, 22, 23), offset_rad, strict=True)]
    plain = fitted(*runs).fit
    model = EffectModel((get("neutral_angle"),))
    with ThreadPoolExecutor(2) as workers:
        filters = [RunFilter(one.run, model, SPEC) for one in plain.runs]
        return fit(filters, plain.hull, plain.levels, np.zeros(1), workers)


def stated(fit: PooledFit) -> WithInstants:
    """Her fit as a diagnosis states it, all instants known."""
    return WithInstants(fit, np.zeros_like(fit.covariance))


def test_runs_of_one_ship_agree() -> None:
    same = with_neutral_angle(0.02, 0.02, 0.02)
    found = agreement_of(same)
    assert found.degrees_of_freedom == 14 and 2.0 < found.statistic < 35.0
    assert found.p_value > LEVEL and found.widened == np.sqrt(max(found.statistic / 14.0, 1.0)) < 1.5
    np.testing.assert_allclose(stated(same).std(7), found.widened * same.std, rtol=1e-12)


def test_an_effect_that_changes_from_run_to_run_has_wider_errors() -> None:
    other = with_neutral_angle(0.0, 0.04, 0.0)
    found = agreement_of(other)
    assert found.p_value < 1e-6 and found.widened > 1.5
    # the two angles differ from their mean by more than the errors that would hold for one angle
    assert abs(other.values[0] - 0.04) > 3.0 * other.std[6]
    assert stated(other).std(1)[0] == pytest.approx(found.widened * other.std[6])


def test_to_first_order_it_is_the_likelihood_ratio_of_separate_hulls() -> None:
    plain = fitted(run(21), run(22), run(23))
    assert agreement_of(plain.fit).statistic == pytest.approx(plain.agreement.statistic, rel=0.3)
    assert agreement_of(plain.fit).degrees_of_freedom == plain.agreement.degrees_of_freedom


def test_one_run_agrees_with_itself() -> None:
    assert Agreement(0.0, 0).widened == 1.0 and Agreement(0.0, 0).p_value == 1.0
