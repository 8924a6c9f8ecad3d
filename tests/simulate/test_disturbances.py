"""The Gauss-Markov processes against their closed-form statistics."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.simulate.disturbances import FORCING, Disturbance, Environment
from kempf.pipeline.simulate.random_streams import stream

N_SEEDS = 3000


@pytest.mark.parametrize(("rate", "step"), [(1 / 300, 30.0), (0.05, 0.02), (1.0, 0.5)])
def test_variance_and_autocorrelation_over_many_seeds(rate: float, step: float) -> None:
    disturbance = Disturbance(0.7, 2.0, rate)
    lags = (1, 5, 20)
    paths = np.array([disturbance.path(21, step, stream(seed, "test")) for seed in range(N_SEEDS)]) - 0.7
    # standard error of a variance and of a correlation from N independent pairs
    allowed = 4.0 / np.sqrt(N_SEEDS)
    for k in (0, 1, 20):
        assert paths[:, k].var() / 4.0 == pytest.approx(1.0, abs=allowed * np.sqrt(2.0))
        assert paths[:, k].mean() == pytest.approx(0.0, abs=2.0 * allowed)
    for lag in lags:
        correlation = np.mean(paths[:, 0] * paths[:, lag]) / 4.0
        assert correlation == pytest.approx(np.exp(-rate * step * lag), abs=allowed * np.sqrt(2.0))


def test_increments_are_exact_and_not_euler() -> None:
    # a coarse step of three correlation times: Euler would blow up, the exact process keeps its variance
    x = Disturbance(0.0, 1.0, 1.0).path(20_000, 3.0, stream(0, "test"))
    innovation = x[1:] - np.exp(-3.0) * x[:-1]
    assert innovation.std() == pytest.approx(np.sqrt(1 - np.exp(-6.0)), rel=0.02)
    assert np.corrcoef(innovation[1:], x[1:-1])[0, 1] == pytest.approx(0.0, abs=0.03)


def test_without_a_slow_part_the_path_is_the_constant() -> None:
    np.testing.assert_array_equal(Disturbance(0.3).path(5, 0.02, stream(0, "x")), 0.3)


def test_the_forcing_has_one_independent_stream_a_column() -> None:
    quiet = Environment(wind_force=Disturbance(0.0, 1.0, 1.0))
    both = Environment(wind_force=Disturbance(0.0, 1.0, 1.0), lateral_current=Disturbance(0.0, 1.0, 1.0))
    one, two = quiet.forcing(5000, 1.0, 3), both.forcing(5000, 1.0, 3)
    np.testing.assert_array_equal(one[:, 0], two[:, 0])
    assert abs(np.corrcoef(two[:, 0], two[:, FORCING.index("lateral_current")])[0, 1]) < 0.1
    assert not np.array_equal(one[:, 0], quiet.forcing(5000, 1.0, 4)[:, 0])


def test_scaling_scales_force_and_streams() -> None:
    environment = Environment(Disturbance(1.0, 2.0), Disturbance(3.0), Disturbance(4.0), Disturbance(5.0, 6.0))
    np.testing.assert_allclose(environment.scaled(0.1).forcing(50, 0.5, 1), 0.1 * environment.forcing(50, 0.5, 1))
