"""Nomoto's constants against published ones, the transfer function itself, and draws from the covariance."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.pipeline.model.ship import Hull
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.steering.nomoto import nomoto
from kempf.schemas.errors import DataRejected, UsageError
from tests.steering.ships import covariance_of, draws_of, hull_of

NONE = np.full((6, 6), np.nan)
#: a yaw damping so small that the two motions swing together
COMPLEX = Hull(-0.005, 0.4, -2e-4, -0.004, -0.001, 6e-5)


def value(result, name):
    return result.constants[name].value


def test_mariner_has_the_published_constants():
    # Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control, section 7.2, from Chislett and
    # Stroem-Tejsen (1965): T1 = 118 s, T2 = 7.8 s, T3 = 18.5 s, K = 0.185 1/s at 15 knots
    ship = HULLS["mariner"]
    result = nomoto(hull_of("mariner"), NONE, ship.trial_speed_m_s, ship.length_m)
    digits = (("T1", 0), ("T2", 1), ("T3", 1), ("K", 3))
    assert [round(value(result, n), d) for n, d in digits] == [118, 7.8, 18.5, 0.185]
    assert value(result, "K'") == pytest.approx(value(result, "K") * ship.length_m / ship.trial_speed_m_s)
    assert value(result, "T'") == pytest.approx(value(result, "T") * ship.trial_speed_m_s / ship.length_m)


@pytest.mark.parametrize("hull", [*map(hull_of, HULLS), COMPLEX])
def test_they_are_the_transfer_function(hull):
    V = 6.0
    result = nomoto(hull, NONE, V)
    A, B = hull.continuous(V)
    for s in (0.3j, 0.01j, 0.05 + 0.2j):
        exact = np.linalg.solve(s * np.eye(2) - A, B)[1, 0]
        if result.poles == "real":
            poles = (1 + value(result, "T1") * s) * (1 + value(result, "T2") * s)
        else:
            w, z = value(result, "natural_frequency"), value(result, "damping")
            poles = (s * s + 2 * z * w * s + w * w) / (w * w)
        assert value(result, "K") * (1 + value(result, "T3") * s) / poles == pytest.approx(exact, rel=1e-9)


def test_steady_turn_is_that_of_the_simulator():
    ship = HULLS["ferry"]
    p, V, delta = ship.parameters, 9.0, 0.01
    _, r = np.linalg.solve(
        [[p.a11 * V, p.a12 * V], [p.a21 * V, p.a22 * V]], [-p.b1 * V**2 * delta, -p.b2 * V**2 * delta]
    )
    assert value(nomoto(hull_of("ferry"), NONE, 9.0), "K") * 0.01 == pytest.approx(r, rel=1e-12)


@pytest.mark.parametrize("hull", [hull_of("mariner"), hull_of("ferry"), COMPLEX])
def test_standard_errors_are_those_of_draws(hull):
    V, covariance = 8.0, covariance_of(hull) * 0.01
    result = nomoto(hull, covariance, V, 150.0)
    drawn = [nomoto(Hull(*p), NONE, V, 150.0) for p in draws_of(hull, covariance, 4000)]
    for name, one in result.constants.items():
        spread = np.std([value(d, name) for d in drawn])
        assert one.std == pytest.approx(spread, rel=0.06), name


def test_intervals_cover_where_the_standard_error_does_not():
    # the tanker is barely stable: K divides by a determinant a few standard errors from zero
    hull, V = hull_of("tanker"), 7.5
    covariance = covariance_of(hull, np.array([0.02, 0.02, 0.02, 0.02, 0.02, 0.01]))
    truth = {n: value(nomoto(hull, NONE, V), n) for n in ("K", "T", "T1", "T2", "T3")}
    inside = dict.fromkeys(truth, 0)
    n = 1500
    for p in draws_of(hull, covariance, n, seed=3):
        result = nomoto(Hull(*p), covariance, V)
        for name, exact in truth.items():
            interval = result.constants[name].interval_95
            inside[name] += interval is None or interval[0] <= exact <= interval[1]
    assert all(0.925 < count / n < 0.98 for count in inside.values()), inside


def test_an_unstable_ship_says_so():
    p = hull_of("tanker").array()
    p[3] *= 0.6
    result = nomoto(Hull(*p), covariance_of(Hull(*p)), 7.5)
    assert value(result, "K") < 0 and value(result, "T1") < 0 < value(result, "T2")
    assert any("unstable" in w for w in result.warnings)


def test_complex_poles_have_no_time_constants():
    result = nomoto(COMPLEX, covariance_of(COMPLEX), 8.0)
    assert result.poles == "complex" and not {"T1", "T2"} & set(result.constants)
    assert 0 < value(result, "damping") < 1


def test_poles_that_are_as_good_as_equal_are_reported():
    hull = Hull(-0.010, 0.05, -1e-6, -0.0101, -0.001, 6e-5)
    result = nomoto(hull, covariance_of(hull), 8.0)
    assert any("cannot be separated" in w for w in result.warnings)


def test_poles_far_apart_are_separate_however_badly_the_faster_one_is_known():
    p = hull_of("mariner").array()
    p[3] *= 12.0
    covariance = np.zeros((6, 6))
    covariance[3, 3] = (p[3] / 6.0) ** 2
    result = nomoto(Hull(*p), covariance, 8.0)
    assert abs(value(result, "T1")) > 8.0 * abs(value(result, "T2"))
    assert not any("cannot be separated" in w for w in result.warnings)


def test_an_unbounded_interval_is_none():
    p = hull_of("tanker").array()
    result = nomoto(Hull(*p), covariance_of(Hull(*p), np.full(6, 0.3)), 7.5)
    assert result.constants["K"].interval_95 is None and np.isfinite(result.constants["K"].std)
    assert any("read the interval" in w for w in result.warnings)


def test_without_a_covariance_there_are_no_standard_errors():
    result = nomoto(hull_of("mariner"), NONE, 7.7)
    assert all(np.isnan(c.std) and c.interval_95 is None for c in result.constants.values())
    assert any("no covariance" in w for w in result.warnings)


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan, np.inf])
def test_a_ship_at_rest_has_none(speed):
    with pytest.raises(UsageError) as caught:
        nomoto(hull_of("mariner"), NONE, speed)
    assert caught.value.code == "speed_not_positive"


@pytest.mark.parametrize(("p", "code"), [([np.nan] * 6, "no_hull_parameters"), ([0.0] * 6, "no_nomoto_model")])
def test_what_is_no_ship_is_refused(p, code):
    with pytest.raises(DataRejected) as caught:
        nomoto(Hull(*p), NONE, 7.0)
    assert caught.value.code == code
