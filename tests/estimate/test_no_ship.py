"""Where no ship explains the motion, the answer is that, not a number; and a ship at the limit says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from kempf.pipeline.estimate import maximum_likelihood as ml
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import ModelSpec
from tests.estimate.simulated import record_of, sailed

SETTINGS = ml.MaximumLikelihoodSettings(entries=2)


def test_an_impossible_speed_leaves_no_ship() -> None:
    record = record_of(sailed(seed=5, duration_s=600.0))
    rocket = replace(record, speed_m_s=record.speed_m_s * 1e4)
    with pytest.raises(DataRejected) as caught:
        ml.identify(rocket, ModelSpec(), 0.006, SETTINGS)
    assert caught.value.code == "no_ship_explains_it"
    assert caught.value.details["searches"]


def test_a_ship_that_answers_at_once_is_reported_as_at_the_limit() -> None:
    record = record_of(sailed(seed=5, duration_s=600.0))
    # time runs 60 times faster for this ship: her true rates lie beyond what is allowed
    quick = replace(
        record,
        time_s=record.time_s / 60.0,
        measured=record.measured * np.array([1.0, 60.0, 1.0]),
        speed_m_s=record.speed_m_s * 60.0,
    )
    found = ml.identify(quick, ModelSpec(), 0.006, SETTINGS)
    assert any("answers faster" in bound for bound in found.report["active_bounds"])
    assert not found.converged
