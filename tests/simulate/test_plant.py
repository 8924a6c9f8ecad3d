"""The plant against closed forms and against another integrator."""

from __future__ import annotations

import ast
from dataclasses import replace
from math import cos, radians, sin
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import kempf.pipeline.simulate
from kempf.pipeline.simulate.disturbances import CALM, Disturbance, Environment
from kempf.pipeline.simulate.hulls import HULLS, SimulatedHull
from kempf.pipeline.simulate.manoeuvre import HandSteering, SteadyCourse, TurningCircle, ZigzagTest
from kempf.pipeline.simulate.programme import sail

CONSTANT_SPEED = replace(HULLS["ferry"], speed_loss=0.0)
STEADY_WEATHER = Environment(Disturbance(5e-3), Disturbance(0.2), Disturbance(-0.1), Disturbance(0.15))


@pytest.mark.parametrize("rudder_deg", [-10.0, 5.0, 20.0])
@pytest.mark.parametrize("force", [0.0, 5e-3])
def test_constant_rudder_ends_in_the_steady_turn_of_the_linear_equations(rudder_deg: float, force: float) -> None:
    hull = CONSTANT_SPEED
    environment = Environment(wind_force=Disturbance(force))
    circle = TurningCircle(rudder_deg, change_deg=1e9, duration_s=1500.0)
    path, _ = sail(hull, (circle,), environment, seed=0)
    p, V, delta = hull.parameters, hull.trial_speed_m_s, radians(rudder_deg)
    # Cramer's rule, without the code of the hull
    e, g = p.b1 * V**2 * delta + force, p.b2 * V**2 * delta + hull.wind_arm_per_m * force
    determinant = (p.a11 * p.a22 - p.a12 * p.a21) * V**2
    v, r = (p.a12 * V * g - p.a22 * V * e) / determinant, (p.a21 * V * e - p.a11 * V * g) / determinant
    assert path.column("v")[-1] == pytest.approx(v, rel=1e-9)
    assert path.column("r")[-1] == pytest.approx(r, rel=1e-9)
    np.testing.assert_array_equal(path.column("V"), V)


def reference_rate(hull: SimulatedHull, environment: Environment, t: float, y: np.ndarray, delta: float) -> list[float]:
    p = hull.parameters
    F, cn, ce, vt = (
        d.mean
        for d in (
            environment.wind_force,
            environment.current_north,
            environment.current_east,
            environment.lateral_current,
        )
    )
    v, r, psi, _, _, V = y
    return [
        p.a11 * V * v + p.a12 * V * r + p.b1 * V**2 * delta + F,
        p.a21 * V * v + p.a22 * V * r + p.b2 * V**2 * delta + hull.wind_arm_per_m * F,
        r,
        V * cos(psi) - (v + vt) * sin(psi) + cn,
        V * sin(psi) + (v + vt) * cos(psi) + ce,
        (hull.trial_speed_m_s * (1 - hull.speed_loss * (r * hull.length_m / hull.trial_speed_m_s) ** 2) - V)
        / hull.surge_time_s,
    ]


@pytest.mark.parametrize("name", sorted(HULLS))
def test_step_response_agrees_with_another_integrator(name: str) -> None:
    hull, heading = HULLS[name], 30.0
    angle, rate = radians(15.0), hull.rudder_rate_rad_s
    end = 20.0 * hull.length_m / hull.trial_speed_m_s
    circle = TurningCircle(15.0, change_deg=1e9, duration_s=end)
    path, _ = sail(hull, (circle,), STEADY_WEATHER, seed=0, heading_deg=heading)
    # the corner where the rudder arrives is where the reference is cut
    corner = angle / rate
    start = [0.0, 0.0, radians(heading), 0.0, 0.0, hull.trial_speed_m_s]
    # off the grid on purpose: the interpolation is tested too
    instants = np.linspace(corner + 0.013, path.duration_s - 0.007, 57)
    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
    ramp = solve_ivp(lambda t, y: reference_rate(hull, STEADY_WEATHER, t, y, rate * t), (0, corner), start, **options)
    hold = solve_ivp(
        lambda t, y: reference_rate(hull, STEADY_WEATHER, t, y, angle),
        (corner, float(instants[-1])),
        ramp.y[:, -1],
        t_eval=instants,
        **options,
    )
    np.testing.assert_allclose(path.at(instants).state, hold.y.T, rtol=1e-9, atol=1e-9)


def test_halving_the_step_changes_nothing_to_speak_of() -> None:
    weather = Environment(
        Disturbance(5e-3, 2e-3, 1 / 60),
        Disturbance(0.2, 0.1, 1 / 100),
        Disturbance(0.1, 0.1, 1 / 100),
        Disturbance(0.0, 0.1, 1 / 200),
    )
    programme = (SteadyCourse(100.0), ZigzagTest(20, 20, legs=4), SteadyCourse(100.0), HandSteering(200.0))
    coarse, coarse_record = sail(HULLS["usv"], programme, weather, seed=4)
    fine, fine_record = sail(HULLS["usv"], programme, weather, seed=4, substeps=2)
    scale = np.abs(fine.state).max(axis=0)
    assert np.max(np.abs(coarse.state - fine.state) / scale) < 1e-6
    np.testing.assert_allclose(coarse_record[1].executes_s, fine_record[1].executes_s, rtol=1e-6)
    np.testing.assert_array_equal(coarse.forcing, fine.forcing)


def test_the_speed_falls_in_the_turn_and_recovers() -> None:
    hull = HULLS["container"]
    path, record = sail(hull, (TurningCircle(35.0), SteadyCourse(900.0)), CALM, seed=0)
    speed = path.column("V")
    lowest = speed[round(record[0].end_s / path.step_s)]
    assert 0.5 < lowest / hull.trial_speed_m_s < 0.9
    assert speed[-1] > 0.98 * hull.trial_speed_m_s


@pytest.mark.parametrize("name", sorted(HULLS))
def test_hulls_are_stable_and_signed_like_ships(name: str) -> None:
    hull = HULLS[name]
    p = hull.parameters
    assert p.a11 * p.a22 > p.a12 * p.a21 and p.a11 < 0 and p.a22 < 0
    assert p.b1 < 0 < p.b2, "positive rudder turns to starboard and pushes the stern to port"
    assert hull.source


def test_mariner_follows_from_the_published_derivatives() -> None:
    p, L = HULLS["mariner"].parameters, 160.93
    mass = np.array([[1546e-5, 798e-5 * -0.023 + 9.354e-5], [798e-5 * -0.023 - 4.646e-5, 83e-5]])
    A = np.linalg.solve(mass, np.array([[-1160e-5, -499e-5], [-264e-5, -166e-5]]))
    B = np.linalg.solve(mass, np.array([-278e-5, 139e-5]))
    found = [p.a11 * L, p.a12, p.a21 * L**2, p.a22 * L, p.b1 * L, p.b2 * L**2]
    np.testing.assert_allclose(found, [A[0, 0], A[0, 1], A[1, 0], A[1, 1], B[0], B[1]], rtol=1e-12)


def test_the_simulator_shares_no_code_with_the_estimator() -> None:
    folder = Path(kempf.pipeline.simulate.__path__[0])
    files = sorted(folder.glob("*.py"))
    assert len(files) > 10
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            own = [n for n in names if n.startswith(("pipeline", "warehouse", "flows", "workbench"))]
            assert all(n.startswith("kempf.pipeline.simulate") for n in own), (file.name, own)
