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


def value(told, name):
    return told.constants[name].value


def test_mariner_has_the_published_constants():
    # Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control, section 7.2, from Chislett and
    # Stroem-Tejsen (1965): T1 = 118 s, T2 = 7.8 s, T3 = 18.5 s, K = 0.185 1/s at 15 knots
    ship = HULLS["mariner"]
    told = nomoto(hull_of("mariner"), NONE, ship.trial_speed_m_s, ship.length_m)
    assert [round(value(told, n), d) for n, d in (("T1", 0), ("T2", 1), ("T3", 1), ("K", 3))] == [118, 7.8, 18.5, 0.185]
    assert value(told, "K'") == pytest.approx(value(told, "K") * ship.length_m / ship.trial_speed_m_s)
    assert value(told, "T'") == pytest.approx(value(told, "T") * ship.trial_speed_m_s / ship.length_m)


@pytest.mark.parametrize("hull", [*map(hull_of, HULLS), COMPLEX])
def test_they_are_the_transfer_function(hull):
    V = 6.0
    told = nomoto(hull, NONE, V)
    A, B = hull.continuous(V)
    for s in (0.3j, 0.01j, 0.05 + 0.2j):
        exact = np.linalg.solve(s * np.eye(2) - A, B)[1, 0]
        if told.poles == "real":
            poles = (1 + value(told, "T1") * s) * (1 + value(told, "T2") * s)
        else:
            w, z = value(told, "natural_frequency"), value(told, "damping")
            poles = (s * s + 2 * z * w * s + w * w) / (w * w)
        assert value(told, "K") * (1 + value(told, "T3") * s) / poles == pytest.approx(exact, rel=1e-9)


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
    told = nomoto(hull, covariance, V, 150.0)
    drawn = [nomoto(Hull(*p), NONE, V, 150.0) for p in draws_of(hull, covariance, 4000)]
    for name, one in told.constants.items():
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
        told = nomoto(Hull(*p), covariance, V)
        for name, exact in truth.items():
            interval = told.constants[name].interval_95
            inside[name] += interval is None or interval[0] <= exact <= interval[1]
    assert all(0.925 < count / n < 0.98 for count in inside.values()), inside


def test_an_unstable_ship_says_so():
    p = hull_of("tanker").array()
    p[3] *= 0.6
    told = nomoto(Hull(*p), covariance_of(Hull(*p)), 7.5)
    assert value(told, "K") < 0 and value(told, "T1") < 0 < value(told, "T2")
    assert any("unstable" in w for w in told.warnings)


def test_complex_poles_have_no_time_constants():
    told = nomoto(COMPLEX, covariance_of(COMPLEX), 8.0)
    assert told.poles == "complex" and not {"T1", "T2"} & set(told.constants)
    assert 0 < value(told, "damping") < 1


def test_poles_that_are_as_good_as_equal_are_told():
    hull = Hull(-0.010, 0.05, -1e-6, -0.0101, -0.001, 6e-5)
    told = nomoto(hull, covariance_of(hull), 8.0)
    assert any("as good as equal" in w for w in told.warnings)


def test_an_unbounded_interval_is_none():
    p = hull_of("tanker").array()
    told = nomoto(Hull(*p), covariance_of(Hull(*p), np.full(6, 0.3)), 7.5)
    assert told.constants["K"].interval_95 is None and np.isfinite(told.constants["K"].std)
    assert any("read the interval" in w for w in told.warnings)


def test_without_a_covariance_there_are_no_standard_errors():
    told = nomoto(hull_of("mariner"), NONE, 7.7)
    assert all(np.isnan(c.std) and c.interval_95 is None for c in told.constants.values())
    assert any("no covariance" in w for w in told.warnings)


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
