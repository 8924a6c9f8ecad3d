"""Every effect in the filter that runs it: without its parameters the plain model, with them another one."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.filters.ekf import ROWS
from kempf.pipeline.estimate.record.grid_run import GridRun, ShipConstants
from kempf.pipeline.estimate.record.speed_readings import SpeedReadings
from kempf.pipeline.model.dynamics import N_INPUT
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.rudder_line import RudderLine
from kempf.pipeline.model.ship import mariner_like
from kempf.schemas.effect import Effect
from kempf.schemas.effects import catalogue
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.symbols import CHANNEL_SYMBOLS

HULL = mariner_like(100.0).array()
LEVELS = np.array([1e-4, 1e-5, 1e-3, 0.05, 5e-4, 2e-3])
SPEC = ModelSpec(moment="gauss-markov")
ALL = catalogue()


@lru_cache(maxsize=1)
def run() -> GridRun:
    """Three minutes of a turn to both sides, every channel logged; what is measured is made up."""
    n, step = 180, 1.0
    fine = step / ROWS * np.arange(ROWS * (n - 1) + 1)
    inputs = np.zeros((fine.size, N_INPUT))
    inputs[:, 0] = 7.0 - 0.01 * fine
    inputs[:, 1] = np.interp(fine, [0, 20, 27, 80, 94, 150, 164, 180], [0, 0, 0.35, 0.35, -0.35, -0.35, 0.35, 0.35])
    for k, value in enumerate((8.0, 0.7, 1.8, 15.0, 0.05)):
        inputs[:, 2 + k] = value * (1.0 + 0.1 * np.sin(0.05 * fine))
    heading = 0.4 + 0.6 * np.sin(0.03 * fine)
    inputs[:, -4], inputs[:, -3], inputs[:, -2] = heading, fine, 1.0
    coarse = heading[::ROWS]
    measured = np.column_stack(
        [0.3 * np.cos(0.03 * fine[::ROWS]), 0.018 * np.cos(0.03 * fine[::ROWS]), coarse - coarse[0]]
    )
    return GridRun(
        name="made",
        start_utc_ns=0,
        step_s=step,
        inputs=inputs,
        rudder_line=RudderLine.through(fine, inputs[:, 1], fine),
        speed_readings=SpeedReadings(fine[::ROWS], inputs[::ROWS, 0]),
        rudder_noise=np.zeros(n),
        speed_error_std_m_s=0.0,
        speed_error_rate_per_s=0.0,
        measured=measured,
        offset_s=np.zeros((n, 3)),
        noise_start=np.full(3, np.nan),
        current_row=np.column_stack([-np.sin(coarse), np.cos(coarse)]),
        heading_rad=coarse,
        approach_m_s=7.0,
        approach_per_s=1.8,
        channels=frozenset(CHANNEL_SYMBOLS.values()),
        ship=ShipConstants(100.0, 6.0, 0.0),
        day=1,
    )


def innovations(effects: tuple[Effect, ...], values: list[float]) -> np.ndarray:
    passed = RunFilter(run(), EffectModel(effects), SPEC).run_filter(HULL, LEVELS, np.array(values))
    assert np.isfinite(passed.log_likelihood)
    return np.asarray(passed.innovation / np.sqrt(passed.variance))


@pytest.mark.parametrize("effect", ALL.values(), ids=list(ALL))
def test_absent_it_changes_no_bit_and_present_it_is_felt(effect: Effect) -> None:
    plain = innovations((), [])
    # states that it brings along reorder sums, no more
    absent = innovations((effect,), [p.absent for p in effect.parameters])
    assert np.array_equal(absent, plain) if not effect.states else np.allclose(absent, plain, rtol=0, atol=1e-9)
    # the furthest step: this rudder turns too slowly for the first of a rate limit
    there = innovations((effect,), [p.steps[-1] for p in effect.parameters])
    assert np.linalg.norm(there - plain) > 1e-3


@pytest.mark.parametrize("effect", ALL.values(), ids=list(ALL))
def test_at_its_bounds_the_filter_gives_a_number_or_a_plain_no(effect: Effect) -> None:
    for end in ("low", "high"):
        values = [getattr(p, end) for p in effect.parameters]
        passed = RunFilter(run(), EffectModel((effect,)), SPEC).run_filter(HULL, LEVELS, np.array(values))
        # a model far from the ship fits badly, but what it says is a number, or a plain no
        assert np.isfinite(passed.log_likelihood) or passed.log_likelihood == -np.inf
