"""Eqs. (16) and (17) and the way between them."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import logm
from scipy.signal import cont2discrete

from kempf.pipeline.model.ship import Hull, continuous_from_discrete, discrete_from_continuous, mariner_like

PARTICULARS = st.tuples(st.floats(1.5, 400.0), st.floats(0.5, 15.0), st.floats(0.02, 1.0))
PRIME = st.tuples(
    st.floats(-1.5, -0.3),
    st.floats(-0.6, 0.1),
    st.floats(-6.0, -0.5),
    st.floats(-4.0, -0.8),
    st.floats(-0.4, -0.02),
    st.floats(0.2, 4.0),
)


def scaled(prime: tuple[float, ...], length_m: float) -> Hull:
    a11, a12, a21, a22, b1, b2 = prime
    L = length_m
    return Hull(a11 / L, a12, a21 / L**2, a22 / L, b1 / L, b2 / L**2)


@given(prime=PRIME, particulars=PARTICULARS)
def test_round_trip_through_the_discrete_form(
    prime: tuple[float, ...], particulars: tuple[float, float, float]
) -> None:
    length_m, speed_m_s, ship_lengths = particulars
    # the step in times the ship needs for her length: stable and unstable hulls alike
    step_s = ship_lengths * length_m / speed_m_s
    hull = scaled(prime, length_m)
    back = continuous_from_discrete(*discrete_from_continuous(hull, speed_m_s, step_s), speed_m_s, step_s)
    assert back is not None
    unit = np.array([1 / length_m, 1.0, length_m**-2, 1 / length_m, 1 / length_m, length_m**-2])
    np.testing.assert_allclose(back.array() / unit, hull.array() / unit, rtol=1e-9, atol=1e-9)


@given(prime=PRIME, particulars=PARTICULARS)
def test_discrete_form_is_the_zero_order_hold(
    prime: tuple[float, ...], particulars: tuple[float, float, float]
) -> None:
    length_m, speed_m_s, ship_lengths = particulars
    hull, step_s = scaled(prime, length_m), ship_lengths * length_m / speed_m_s
    V = speed_m_s
    A = np.array([[hull.a11 * V, hull.a12 * V], [hull.a21 * V, hull.a22 * V]])
    B = np.array([[hull.b1 * V**2], [hull.b2 * V**2]])
    expected = cont2discrete((A, B, np.eye(2), np.zeros((2, 1))), step_s)
    found = discrete_from_continuous(hull, V, step_s)
    np.testing.assert_allclose(found[0], expected[0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found[1], expected[1], rtol=1e-9, atol=1e-12)


def test_discrete_step_is_the_solution_of_the_differential_equation() -> None:
    hull, V, step_s, delta = mariner_like(100.0), 7.0, 3.0, 0.2
    start = np.array([0.4, -0.01])

    def slope(_: float, x: np.ndarray) -> list[float]:
        return [
            hull.a11 * V * x[0] + hull.a12 * V * x[1] + hull.b1 * V**2 * delta,
            hull.a21 * V * x[0] + hull.a22 * V * x[1] + hull.b2 * V**2 * delta,
        ]

    path = solve_ivp(slope, (0.0, step_s), start, rtol=1e-11, atol=1e-13)
    A, B = discrete_from_continuous(hull, V, step_s)
    np.testing.assert_allclose(A @ start + B[:, 0] * delta, path.y[:, -1], rtol=1e-8)


@pytest.mark.parametrize(
    "A",
    [
        [[-0.5, 0.0], [0.0, 0.8]],  # one eigenvalue negative
        [[-0.5, 0.1], [0.02, -0.3]],  # both
        [[0.5, 1.0], [0.25, 0.5]],  # one zero
        [[0.0, 0.0], [0.0, 0.0]],
        [[np.nan, 0.0], [0.0, 0.5]],
        [[np.inf, 0.0], [0.0, 0.5]],
    ],
)
def test_matrices_of_no_continuous_ship_give_none(A: list[list[float]]) -> None:
    assert continuous_from_discrete(np.array(A), np.array([[0.1], [0.01]]), 7.0, 1.0) is None


def test_circling_eigenvalues_have_a_ship() -> None:
    angle = 0.7
    A = 0.9 * np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    hull = continuous_from_discrete(A, np.array([[0.1], [0.01]]), 5.0, 0.5)
    assert hull is not None
    assert hull.a12 * 5.0 * 0.5 == pytest.approx(angle)
    assert hull.a11 * 5.0 * 0.5 == pytest.approx(np.log(0.9))
    again_A, again_B = discrete_from_continuous(hull, 5.0, 0.5)
    np.testing.assert_allclose(again_A, A, atol=1e-12)
    np.testing.assert_allclose(again_B[:, 0], [0.1, 0.01], atol=1e-12)


def test_the_scaled_mariner_keeps_her_shape() -> None:
    short, long = mariner_like(10.0), mariner_like(200.0)
    # the same ship in her own time: L/V steps give the same eigenvalues
    small, large = (
        discrete_from_continuous(short, 2.0, 10.0 / 2.0)[0],
        discrete_from_continuous(long, 8.0, 200.0 / 8.0)[0],
    )
    np.testing.assert_allclose(np.sort(np.linalg.eigvals(small)), np.sort(np.linalg.eigvals(large)), rtol=1e-12)


@pytest.mark.parametrize(
    "A",
    [
        [[0.9, 0.0], [0.0, 0.9]],
        [[0.9, 0.3], [0.0, 0.9]],  # no two eigenvectors
        [[0.9, 0.3], [1e-20, 0.9]],
        [[1.0, 0.5], [0.0, 0.8]],  # an eigenvalue of 1: she does not answer in one direction
        [[0.999999999, 1e-3], [1e-7, 0.99]],
        [[30.0, 5.0], [2.0, 40.0]],
        [[-0.3, 0.9], [-0.9, -0.3]],  # half turns in a step and more, still on the principal branch
    ],
)
def test_the_logarithm_is_the_one_of_scipy(A: list[list[float]]) -> None:
    block = np.eye(3)
    block[:2, :2], block[:2, 2] = A, [0.2, 0.03]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its own doubt about the last digits
        expected = np.real(logm(block))
    hull = continuous_from_discrete(np.array(A), np.array([[0.2], [0.03]]), 1.0, 1.0)
    assert hull is not None
    found = [[hull.a11, hull.a12, hull.b1], [hull.a21, hull.a22, hull.b2]]
    np.testing.assert_allclose(found, expected[:2], rtol=1e-7, atol=1e-9)
