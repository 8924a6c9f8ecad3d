"""Predictions ahead: their intervals cover what they should, and they use nothing that was withheld."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.identify.linear_ahead import predict_ahead
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings, search
from kempf.schemas.model_spec import ModelSpec
from tests.estimate.simulated import record_of, sailed

SETTINGS = MaximumLikelihoodSettings()


def test_intervals_cover_their_share_and_widen_with_the_horizon() -> None:
    trial = sailed("ferry", seed=4, duration_s=600.0)
    objective, best, _, _, _ = search(record_of(trial), ModelSpec(), trial.truth.wind_arm_per_m, SETTINGS)
    widths = []
    for horizon in (4.0, 12.0, 40.0):
        found = predict_ahead(objective, best.theta, horizon)
        for name, (inside, of) in found.inside().items():
            # predictions of one window share their error: few windows, a wide allowance
            assert of > 100 and 0.80 < inside / of <= 1.0, (horizon, name)
        widths.append(np.nanmedian(found.std, axis=0))
    assert np.all(np.diff(np.array(widths), axis=0)[:, [0, 2]] > 0.0)


def test_what_is_withheld_is_not_used() -> None:
    trial = sailed("ferry", seed=4, duration_s=600.0)
    record = record_of(trial)
    objective, best, _, _, _ = search(record, ModelSpec(), trial.truth.wind_arm_per_m, SETTINGS)
    first = predict_ahead(objective, best.theta, 20.0)
    # a window that one of both passes withholds is spoilt: its own predictions do not move
    spoilt = (record.time_s >= 60.0) & (record.time_s < 80.0)
    other = SETTINGS.bind(
        replace(record, measured=np.where(spoilt[:, None], record.measured + 1.0, record.measured)),
        ModelSpec(),
        trial.truth.wind_arm_per_m,
    )
    second = predict_ahead(other, best.theta, 20.0)
    same = spoilt & np.isfinite(first.error[:, 1])
    np.testing.assert_allclose(second.error[same, 1], first.error[same, 1] + 1.0, atol=1e-9)
    np.testing.assert_array_equal(second.std[same], first.std[same])
