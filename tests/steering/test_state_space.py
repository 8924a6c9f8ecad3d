"""State space against the model's own discretisation, a fine integration, and the noise it should have."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from kempf.pipeline.model.ship import discrete_from_continuous
from kempf.pipeline.steering.state_space import NoiseLevels, continuous, discretised
from kempf.schemas.errors import UsageError
from kempf.schemas.model_spec import ModelSpec
from tests.steering.ships import hull_of

V, ARM = 7.5, 0.004
HULL = hull_of("mariner")


@pytest.mark.parametrize(
    ("wind", "current", "states"),
    [
        ("force", "earth", ["v", "r", "psi", "F", "c_N", "c_E"]),
        ("force", "lateral", ["v", "r", "psi", "F", "V_T"]),
        ("none", "none", ["v", "r", "psi"]),
        ("none", "earth", ["v", "r", "psi", "c_N", "c_E"]),
    ],
)
def test_states_follow_the_specification(wind, current, states):
    model = continuous(HULL, ModelSpec(wind=wind, current=current), V)
    assert list(model.states) == states
    n = len(states)
    assert [m.shape for m in (model.A, model.B, model.C, model.D, model.Q, model.R)] == [
        (n, n), (n, 1), (4, n), (4, 1), (n, n), (3, 3)
    ]  # fmt: skip
    assert set(model.outputs) == {"lateral_speed", "yaw_rate", "heading", "cross_track_speed"}


def test_ship_part_is_eq_17():
    sampled = discretised(continuous(HULL, ModelSpec(), V, arm_per_m=ARM), 0.7)
    A, B = discrete_from_continuous(HULL, V, 0.7)
    assert sampled.A[:2, :2] == pytest.approx(A, rel=1e-12) and sampled.B[:2] == pytest.approx(B, rel=1e-12)


def test_a_step_is_the_integral_of_eq_16():
    # written out here once more, and integrated: no matrix of the code under test
    spec = ModelSpec()
    course, rudder, h = 0.7, 0.1, 3.0
    x0 = np.array([0.3, 0.01, -0.05, 4e-3, 0.2, -0.3])

    def slope(_, x):
        v, r, _, F, c_N, c_E = x
        mu_F, mu_V = spec.wind_correlation_rate_per_s, spec.current_correlation_rate_per_s
        return [
            HULL.a11 * V * v + HULL.a12 * V * r + HULL.b1 * V**2 * rudder + F,
            HULL.a21 * V * v + HULL.a22 * V * r + HULL.b2 * V**2 * rudder + ARM * F,
            r,
            -mu_F * F,
            -mu_V * c_N,
            -mu_V * c_E,
        ]

    end = solve_ivp(slope, (0, h), x0, rtol=1e-11, atol=1e-13).y[:, -1]
    model = discretised(continuous(HULL, spec, V, arm_per_m=ARM, course_rad=course), h)
    x = model.A @ x0 + model.B[:, 0] * rudder
    assert x == pytest.approx(end, rel=1e-8, abs=1e-12)
    y = model.C @ x
    lateral = x[0] - x[4] * np.sin(course) + x[5] * np.cos(course)
    assert y == pytest.approx([lateral, x[1], x[2], lateral + V * x[2]])


def test_noise_of_a_step_keeps_the_disturbances_stationary():
    noise, spec = NoiseLevels(wind_m_s2=2e-3, current_m_s=0.1), ModelSpec(current="lateral")
    model = discretised(continuous(HULL, spec, V, arm_per_m=ARM, noise=noise), 5.0)
    for i, std in ((3, 2e-3), (4, 0.1)):
        assert model.A[i, i] ** 2 * std**2 + model.Q[i, i] == pytest.approx(std**2, rel=1e-10)
    # the whole of it against a sum of fine steps
    fine, total, power = discretised(continuous(HULL, spec, V, arm_per_m=ARM, noise=noise), 0.005), 0.0, np.eye(5)
    for _ in range(1000):
        total = total + power @ fine.Q @ power.T
        power = fine.A @ power
    assert np.allclose(model.Q, total, rtol=1e-8, atol=1e-24)


def test_constant_disturbances_do_not_decay_but_may_wander():
    spec = ModelSpec(current="lateral")
    model = discretised(continuous(HULL, spec, V, constant_disturbances=True), 1.0)
    assert model.A[3, 3] == 1.0 and model.A[4, 4] == 1.0 and model.Q[3, 3] > 0.0


@pytest.mark.parametrize("step", [0.0, -1.0, np.nan])
def test_an_impossible_step_is_refused(step):
    with pytest.raises(UsageError):
        discretised(continuous(HULL, ModelSpec(), V), step)
    with pytest.raises(UsageError):
        continuous(HULL, ModelSpec(), V, course_rad=np.nan)
