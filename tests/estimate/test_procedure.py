"""The procedure for any linear vehicle: against the equations written out, on an underwater vehicle, its verdicts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from kempf.pipeline.estimate.paper.least_squares import Regression, regress
from kempf.pipeline.estimate.paper.procedure import ProcedureCourse, ProcedurePass, ProcedureSettings, iterate, judge
from kempf.pipeline.estimate.paper.vehicle import LinearVehicle, SlowDisturbance
from kempf.schemas.errors import DataRejected, UsageError
from tests.estimate.depth_channel import DEPTH_STATE, DepthChannel, DepthRecord, sail_depth

FORCE = SlowDisturbance("force", (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), 0.02)
MOMENT = SlowDisturbance("moment", (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), 0.02)
GYRO = SlowDisturbance("gyro bias", (0.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), 0.01)
#: usual instruments of such a vehicle: m/s, rad/s, rad, m
NOISE = np.array([0.01, 0.002, 0.002, 0.02])


def diver(step_s: float) -> LinearVehicle:
    return LinearVehicle(DEPTH_STATE, ("planes",), (0.5, 0.2, 0.3, 5.0), step_s, (FORCE, MOMENT, GYRO))


def dive(share: float) -> tuple[DepthChannel, DepthRecord, ProcedureCourse]:
    settings = DepthChannel(noise=tuple(share * NOISE))
    sailed = sail_depth(settings)
    R = np.diag(np.square(max(share, 1e-3) * NOISE))
    course = iterate(diver(settings.step_s), sailed.measured, sailed.planes[:, None], R, ProcedureSettings())
    return settings, sailed, course


def off(found: Regression, settings: DepthChannel, sailed: DepthRecord) -> float:
    """Largest error of an element of [A B] by what it makes of the increments, rms over rms."""
    block = np.zeros((5, 5))
    block[:4, :4], block[:4, 4:] = sailed.A * settings.step_s, sailed.B * settings.step_s
    truth = expm(block)[:4]
    regressors = np.sqrt(np.mean(np.square(np.column_stack([sailed.state, sailed.planes])), axis=0))
    increments = np.sqrt(np.mean(np.square(np.diff(sailed.state, axis=0)), axis=0))
    return float(np.max(np.abs(np.hstack([found.A, found.B]) - truth) * regressors / increments[:, None]))


def test_the_simulated_dive_solves_its_equations_and_its_step_is_fine_enough() -> None:
    # no change of side, whose instant would hang on the step
    coarse, fine = (sail_depth(DepthChannel(duration_s=5.0, pitch_rad=9.0, substeps=n)) for n in (10, 40))
    np.testing.assert_allclose(coarse.state, fine.state, atol=1e-8)
    settings = DepthChannel(duration_s=2.0, pitch_rad=1.0, plane_rate_rad_s=1e9)  # planes over at once, and no further
    still = sail_depth(settings)
    # closed form: x = A^-1 (e^{At} - 1) f, with the kinematic states' integrals by an augmented exponential
    f = still.B[:, 0] * settings.planes_rad + np.array([settings.force_m_s2, settings.moment_rad_s2, 0.0, 0.0])
    block = np.zeros((5, 5))
    block[:4, :4], block[:4, 4] = still.A, f
    exact = np.array([expm(block * t)[:4, 4] for t in still.time_s])
    # the first small step is the ramp to the full angle
    np.testing.assert_allclose(still.state[1:], exact[1:], atol=3e-3)


@pytest.mark.parametrize("share", [0.0, 0.01])
def test_an_underwater_vehicle_is_found_where_noise_is_small(share: float) -> None:
    settings, sailed, course = dive(share)
    assert course.end == "converged" and course.hidden == ()
    first, last = (off(course.passes[k].regression, settings, sailed) for k in (0, -1))
    assert first > 0.15
    assert last < 0.02  # 0.009: the planes held over each step, and the filter's settling
    assert course.last is not None
    found = course.last.updated[-1, 4:]
    truth = [settings.force_m_s2, settings.moment_rad_s2, settings.gyro_bias_rad_s]
    np.testing.assert_allclose(found, truth, rtol=0.03)


def test_noise_in_the_regressors_bends_what_it_finds() -> None:
    settings, sailed, course = dive(0.1)
    quiet = dive(0.01)[2]
    loud, still = (off(c.passes[-1].regression, settings, sailed) for c in (course, quiet))
    assert loud > 5.0 * still


def test_one_pass_is_the_equations_written_out() -> None:
    random = np.random.default_rng(1)
    wind = SlowDisturbance("wind", (1.0, 0.5), (0.0, 0.0), 0.3, 0.01)
    error = SlowDisturbance("error", (0.0, 0.0), (1.0, -1.0), 0.2)
    dt = 0.5
    vehicle = LinearVehicle(("a", "b"), ("u1", "u2"), (1.0, 2.0), dt, (wind, error))
    u = random.standard_normal((60, 2))
    Y = np.cumsum(random.standard_normal((60, 2)), axis=0)
    R = np.array([[0.04, 0.01], [0.01, 0.09]])
    course = iterate(vehicle, Y, u, R, ProcedureSettings(iterations=1, floor=False))
    # (14) as printed, columns the samples
    Z0, YN = np.vstack([Y[:-1].T, u[:-1].T]), Y[1:].T
    AB = YN @ Z0.T @ np.linalg.inv(Z0 @ Z0.T)
    np.testing.assert_allclose(np.hstack([course.passes[0].regression.A, course.passes[0].regression.B]), AB, rtol=1e-9)
    # (3)-(5) with the augmented matrices, one-step-predictor form
    A, B = AB[:, :2], AB[:, 2:]
    enters = 0.5 * dt * (np.eye(2) + A) @ np.array([[1.0, 0.0], [0.5, 0.0]])
    H1 = np.array([[0.0, 1.0], [0.0, -1.0]])
    F = np.block([[A, enters], [np.zeros((2, 2)), np.diag([np.exp(-0.01 * dt), 1.0])]])
    H = np.hstack([np.eye(2), H1])
    Q = np.zeros((4, 4))
    Q[2, 2] = 0.3**2 * (1.0 - np.exp(-0.02 * dt))
    x, P, W = np.zeros(4), np.diag([1.0, 4.0, 0.09, 0.04]), np.empty((60, 2))
    for k in range(60):
        gain = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        W[k] = (x + gain @ (Y[k] - H @ x))[2:]
        K = F @ gain
        x = F @ x + np.concatenate([B @ u[k], [0.0, 0.0]]) + K @ (Y[k] - H @ x)
        P = F @ P @ F.T + Q - K @ H @ P @ F.T
    # (15), and the force off the dynamics
    X = Y - W @ H1.T
    Z1, XN = np.vstack([X[:-1].T, u[:-1].T]), (X[1:] - W[:-1] @ enters.T).T
    expected = XN @ Z1.T @ np.linalg.inv(Z1 @ Z1.T)
    found = course.passes[1].regression
    np.testing.assert_allclose(np.hstack([found.A, found.B]), expected, rtol=1e-7)


def test_without_disturbances_the_first_approximation_stands() -> None:
    sailed = sail_depth(DepthChannel(duration_s=20.0))
    bare = replace(diver(0.05), disturbances=())
    course = iterate(bare, sailed.measured, sailed.planes[:, None], np.diag(NOISE**2), ProcedureSettings())
    assert course.end == "converged" and len(course.passes) == 2
    np.testing.assert_array_equal(course.passes[0].regression.A, course.passes[1].regression.A)


def test_singular_regressors_give_the_minimum_norm_solution_in_every_pass() -> None:
    sailed = sail_depth(DepthChannel(duration_s=30.0))
    twice = np.column_stack([sailed.planes, sailed.planes])
    vehicle = replace(diver(0.05), inputs=("planes", "planes again"))
    course = iterate(vehicle, sailed.measured, twice, np.diag((0.01 * NOISE) ** 2), ProcedureSettings(iterations=3))
    for one in course.passes:
        assert one.regression.rank == 5
        np.testing.assert_allclose(one.regression.B[:, 0], one.regression.B[:, 1], rtol=1e-6)


def test_a_row_that_was_not_measured_is_left_out_and_bridged() -> None:
    sailed = sail_depth(DepthChannel(duration_s=80.0))
    holed = sailed.measured.copy()
    holed[300:310, 2] = np.nan
    R = np.diag((0.01 * NOISE) ** 2)
    whole, other = (
        iterate(diver(0.05), Y, sailed.planes[:, None], R, ProcedureSettings()) for Y in (sailed.measured, holed)
    )
    assert other.end == "converged"
    np.testing.assert_allclose(other.passes[-1].regression.A, whole.passes[-1].regression.A, atol=2e-3)
    assert other.last is not None and np.all(np.isfinite(other.last.updated))


def test_too_few_rows_are_refused() -> None:
    with pytest.raises(DataRejected, match="unknowns") as refusal:
        iterate(diver(0.05), np.zeros((6, 4)), np.zeros((6, 1)), np.eye(4), ProcedureSettings())
    assert refusal.value.code == "segment_too_short"


def test_what_nothing_measures_is_named() -> None:
    rate_error = SlowDisturbance("depth error", (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), 1.0)
    # a constant error of the depth is a depth: nothing else depends on z
    vehicle = replace(diver(0.05), disturbances=(FORCE, rate_error))
    sailed = sail_depth(DepthChannel(duration_s=20.0))
    A = expm(sailed.A * 0.05)
    assert vehicle.hidden(A) == ("z", "depth error")
    assert diver(0.05).hidden(A) == ()


@pytest.mark.parametrize(
    "change",
    [
        {"state_std": (1.0,)},
        {"step_s": 0.0},
        {"disturbances": (replace(FORCE, enters=(1.0,)),)},
        {"disturbances": (replace(FORCE, rate_per_s=-1.0),)},
        {"disturbances": (replace(FORCE, std=float("nan")),)},
    ],
)
def test_an_impossible_vehicle_is_refused(change: dict[str, object]) -> None:
    with pytest.raises(UsageError) as refusal:
        replace(diver(0.05), **change)
    assert refusal.value.code == "vehicle_invalid"


def test_a_filter_that_overflows_is_a_divergence_with_its_reason() -> None:
    # tenfold a step; then nothing measured, and the prediction's covariance grows a hundredfold a step
    Y = np.concatenate([10.0 ** np.arange(100.0), np.full(200, np.nan), [1.0]])[:, None]
    wild = LinearVehicle(("x",), ("u",), (1.0,), 1.0, (SlowDisturbance("w", (1.0,), (0.0,), 1.0),))
    course = iterate(wild, Y, np.zeros((301, 1)), np.eye(1), ProcedureSettings())
    assert course.end == "diverged" and "does not exist" in course.reason
    assert course.last is None and len(course.passes) == 1


def passes(values: list[float]) -> list[ProcedurePass]:
    def one(value: float) -> Regression:
        matrix = np.array([[value]])
        return Regression(matrix, np.zeros((1, 1)), matrix, matrix, 2)

    return [ProcedurePass(one(value), np.nan, np.eye(1), None) for value in values]


@pytest.mark.parametrize("period", [2, 3, 5])
def test_a_cycle_is_named_with_its_period(period: int) -> None:
    ring = np.cos(2.0 * np.pi * np.arange(25) / period)
    end, reason, found = judge(passes(list(ring)), np.ones((1, 2)))
    assert (end, found) == ("cycling", period)
    assert f"period {period}" in reason


@pytest.mark.parametrize(
    "values",
    [
        list(np.linspace(0.0, 1.0, 25)),
        list((-0.9) ** np.arange(25.0)),  # swings, but towards a point
        list(0.5 * np.random.default_rng(5).uniform(-1.0, 1.0, 25)),
    ],
    ids=["drift", "damped", "erratic"],
)
def test_what_does_not_repeat_is_no_cycle(values: list[float]) -> None:
    end, reason, period = judge(passes(values), np.ones((1, 2)))
    assert (end, period) == ("still moving", None)
    assert "still moved" in reason


def test_strides_that_grow_beyond_the_increments_are_a_divergence() -> None:
    end, reason, period = judge(passes(list(1.5 ** np.arange(25.0))), np.ones((1, 2)))
    assert (end, period) == ("diverged", None)
    assert "more than the first" in reason


def test_attenuation_is_the_textbook_one() -> None:
    # Fuller, Measurement Error Models, 1987, section 2.2: [A B] M (M + R)^-1
    random = np.random.default_rng(7)
    A, B, n = np.array([[0.9, 0.1], [0.0, 0.7]]), np.array([[0.2], [0.5]]), 200_000
    X, u = random.standard_normal((n, 2)) @ np.array([[1.0, 0.8], [0.0, 0.3]]), random.standard_normal((n, 1))
    R = np.diag([0.05, 0.02])
    Y = X @ A.T + u @ B.T + random.standard_normal((n, 2)) @ np.sqrt(R)
    found = regress(X + random.standard_normal((n, 2)) @ np.sqrt(R), u, Y)
    Z = np.column_stack([X, u])
    M, noise = Z.T @ Z / n, np.zeros((3, 3))
    noise[:2, :2] = R
    expected = np.hstack([A, B]) @ M @ np.linalg.inv(M + noise)
    np.testing.assert_allclose(np.hstack([found.A, found.B]), expected, atol=6e-3)
    assert abs(expected[0, 0] - A[0, 0]) > 0.05
