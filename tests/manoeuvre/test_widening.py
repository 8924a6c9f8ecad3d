"""By how much the errors of a set are wider than independent prediction errors make them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.channels.instant_errors import InstantErrors
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filtered import Passed, RunFilter
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.manoeuvre import widening as widening_job
from kempf.pipeline.manoeuvre.widening import widening
from kempf.pipeline.model.effect_model import EffectModel
from tests.estimate.test_plain_fit import SPEC, fitted, run


@pytest.fixture(scope="module")
def three() -> PooledFit:
    return fitted(*(run(seed) for seed in (21, 22, 23))).fit


def factor(fit: PooledFit, late_s: float = 0.0, errors: InstantErrors | None = None, *, drift: bool = False) -> float:
    """Return the factor of a fit, its headings later than they are taken to be, or with a slow error of the drift."""
    filters = []
    for one in fit.runs:
        own = one.run
        measured, offset = own.measured.copy(), own.offset_s.copy()
        offset[:, 1] -= late_s
        offset[:, 2] -= late_s
        if drift:
            measured[:, 0] += 0.1 * np.sin(2.0 * np.pi * own.time_s / 97.0)
        known = own.instant_errors if errors is None else errors
        filters.append(
            RunFilter(replace(own, measured=measured, offset_s=offset, instant_errors=known), EffectModel(), SPEC)
        )
    levels = [np.exp(one) for one in fit.levels]
    return widening(filters, levels, fit.hull, np.zeros(0), fit.std)


def test_errors_of_a_model_that_lacks_nothing_are_as_they_are(three: PooledFit) -> None:
    assert 1.0 <= factor(three) < 1.35


def test_what_lasts_over_a_leg_widens_them(three: PooledFit) -> None:
    assert factor(three, drift=True) > 2.0


def test_an_instant_that_is_not_known_pulls_every_leg_one_way_and_is_in_the_covariance_already(
    three: PooledFit,
) -> None:
    """The covariance of unsure instants has what one of them does to the hull; legs show it again."""
    taken_for_known = factor(three, 0.15)
    assert taken_for_known > 2.0
    unsure = factor(three, 0.15, InstantErrors(heading_s=0.1, yaw_rate_s=0.1))
    assert unsure < 1.0 + 0.3 * (taken_for_known - 1.0)
    # what lasts is seen beside it all the same
    assert factor(three, 0.15, InstantErrors(heading_s=0.1, yaw_rate_s=0.1), drift=True) > 1.5


def test_a_few_legs_say_nothing(three: PooledFit) -> None:
    one = three.runs[0]
    short = replace(
        one.run, measured=np.where(np.arange(one.run.measured.shape[0])[:, None] < 30, one.run.measured, np.nan)
    )
    still = replace(short, inputs=np.where(np.arange(short.inputs.shape[1]) == 1, 0.1, short.inputs))
    filters = [RunFilter(still, EffectModel(), SPEC)]
    assert widening(filters, [np.exp(three.levels[0])], three.hull, np.zeros(0), three.std) == 1.0


def test_a_filter_that_runs_away_is_moved_less_and_else_says_nothing(
    three: PooledFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, read, moves = factor(three), widening_job._log_likelihoods, 0

    def runs_away(passed: Passed) -> Float:
        nonlocal moves
        moves += 1
        # the first of the manoeuvres at the first step alone
        return np.full(len(passed.innovation), np.nan) if moves <= 12 else read(passed)

    monkeypatch.setattr(widening_job, "_log_likelihoods", runs_away)
    assert factor(three) == pytest.approx(whole, rel=0.05)
    monkeypatch.setattr(widening_job, "_log_likelihoods", lambda passed: np.full(len(passed.innovation), np.nan))
    assert factor(three) == 1.0
