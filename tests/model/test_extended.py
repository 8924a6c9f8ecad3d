"""The extended filter against the kernel that it shares no code with, and against an integrator of another kind."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.filters.ekf import ROWS
from kempf.pipeline.estimate.filters.linear_kernel import N_STATE, likelihood, no_trace
from kempf.pipeline.estimate.likelihood import INITIAL_STD
from kempf.pipeline.estimate.record.grid_run import GridRun, ShipConstants
from kempf.pipeline.estimate.record.speed_readings import SpeedReadings
from kempf.pipeline.model.discretise import LONGEST
from kempf.pipeline.model.dynamics import N_INPUT, SPEED_ERROR_GAIN, E
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.rudder_line import RudderLine
from kempf.pipeline.model.terms.own import from_expression
from kempf.schemas.effect import Effect, ExtraState, Parameter
from kempf.schemas.errors import UsageError
from kempf.schemas.instrument_noise import NAMES, lasting_noise
from kempf.schemas.model_spec import ModelSpec

HULL = np.array([-4.4e-3, -0.29, -1.7e-4, -2.66e-2, -2.4e-3, 1.19e-4])
LEVELS = np.array([2e-4, 2e-6, 1e-3, 0.05, 6e-4, 1.5e-3])
SPEC = ModelSpec(moment="gauss-markov", rate_bias=True)
STEP, N = 1.0, 240


def run_of(step: float = STEP, n: int = N, *, seed: int = 0) -> GridRun:
    """A zigzag of rudder, a speed that varies, a heading that swings, measurements that are only noise around it."""
    random = np.random.default_rng(seed)
    fine = step / ROWS * np.arange(ROWS * (n - 1) + 1)
    inputs = np.zeros((fine.size, N_INPUT))
    # nodes at the instants only, linear in between: what the kernel takes for the inputs' course
    coarse = step * np.arange(n)
    inputs[:, 0] = np.interp(fine, coarse, 9.0 - 0.5 * np.sin(coarse / 50.0))
    inputs[:, 1] = np.interp(fine, coarse, np.clip(0.6 * np.sin(coarse / 17.0), -0.35, 0.35))
    heading = 0.3 + 0.3 * np.sin(coarse / 40.0)
    inputs[:, -4] = np.interp(fine, coarse, heading)
    inputs[:, -3] = fine
    inputs[:, SPEED_ERROR_GAIN] = 2.0 * inputs[:, 1] / inputs[:, 0]
    run = GridRun(
        name="made",
        start_utc_ns=0,
        step_s=step,
        inputs=inputs,
        rudder_line=RudderLine.through(fine, inputs[:, 1], fine),
        speed_readings=SpeedReadings(fine[::ROWS], inputs[::ROWS, 0]),
        rudder_noise=np.full(n, 2e-3),
        speed_error_std_m_s=0.1,
        speed_error_rate_per_s=0.2,
        measured=np.zeros((n, 3)),
        offset_s=np.zeros((n, 3)),
        noise_start=np.full(3, np.nan),
        current_row=np.column_stack([-np.sin(heading), np.cos(heading)]),
        heading_rad=heading,
        approach_m_s=9.0,
        approach_per_s=2.0,
        channels=frozenset(),
        ship=ShipConstants(150.0, 6.0, 0.0067),
        day=0,
    )
    start = np.array([0.2, 0.003, 0.1, 2e-3, 0.0, 0.2, 0.1, 1e-4])
    measured = RunFilter(run, EffectModel(), SPEC).free(HULL, np.zeros(0), start)
    measured = measured + random.normal(0.0, LEVELS[3:], (n, 3))
    measured[random.random((n, 3)) < 0.3] = np.nan
    return replace(run, measured=measured)


def test_without_effects_it_is_the_kernel():
    run = run_of()
    passed = RunFilter(run, EffectModel(), SPEC).run_filter(HULL, LEVELS, np.zeros(0))
    rates = SPEC.wind_correlation_rate_per_s, SPEC.moment_correlation_rate_per_s, SPEC.current_correlation_rate_per_s
    stationary = LEVELS[:3] / np.sqrt(2.0 * np.array(rates))
    theta = np.concatenate([HULL, np.log(stationary), np.log(LEVELS[3:])])
    P0 = np.diag(np.insert(INITIAL_STD, E, run.speed_error_std_m_s) ** 2)
    gain = run.inputs[::ROWS, SPEED_ERROR_GAIN]
    innovation, variance = np.full((N, 3), np.nan), np.full((N, 3), np.nan)
    trace = (innovation, variance, *no_trace()[2:])
    value, _, _ = likelihood(
        *(theta, False, run.time_s, run.speed_m_s, run.rudder_rad, run.rudder_noise, gain, run.measured),
        *(
            np.zeros(N, dtype=np.bool_),
            run.current_row,
            run.ship.arm_per_m,
            *rates,
            run.speed_error_rate_per_s,
            LONGEST,
            np.zeros(N_STATE),
            P0,
            trace,
        ),
    )
    # the kernel holds the speed over a step at its mean and takes the noise of the current for stationary; the filter
    # carries the covariance over a step as the equations are at its middle, which adds a tenth of that
    assert passed.log_likelihood == pytest.approx(value, abs=2.5e-2)
    made = np.isfinite(run.measured)
    std = np.sqrt(variance[made])
    assert np.max(np.abs(passed.innovation[made] - innovation[made]) / std) < 4e-3
    assert passed.variance[made] == pytest.approx(variance[made], rel=2e-3)


def test_a_step_of_the_covariance_is_as_good_as_two_halves():
    whole, fine = run_of(), run_of(0.5 * STEP, 2 * N)
    measured = np.full((2 * N, 3), np.nan)
    measured[::2] = whole.measured
    halves = replace(fine, measured=measured)

    def passed(run: GridRun) -> float:
        return RunFilter(run, EffectModel(), SPEC).run_filter(HULL, LEVELS, np.zeros(0)).log_likelihood

    # the inputs are straight lines between whole instants in the one and between halves in the other
    inputs = halves.inputs.copy()
    inputs[: whole.inputs.shape[0] * 2 - 1] = _doubled(whole.inputs)
    heading = _doubled(whole.heading_rad[:, None])[:, 0]
    row = np.column_stack([-np.sin(heading), np.cos(heading)])
    line = RudderLine.through(halves.fine_time_s, inputs[:, 1], halves.fine_time_s)
    halves = replace(halves, inputs=inputs, rudder_line=line, current_row=np.vstack([row, row[-1:]]))
    assert passed(halves) == pytest.approx(passed(whole), abs=5e-3)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("step", [0.05, 1.0])
def test_noise_of_next_to_nothing_changes_next_to_nothing_however_short_it_lasts(name: str, step: float) -> None:
    run, model = run_of(step), EffectModel((lasting_noise()[name],))
    _, shortest = model.low_on(step)
    filtered = RunFilter(run, model, SPEC)
    none, little = (filtered.run_filter(HULL, LEVELS, np.array([c, shortest])).log_likelihood for c in (0.0, 1e-9))
    assert little == pytest.approx(none, abs=1e-4)


def _doubled(column: np.ndarray) -> np.ndarray:
    """Rows of a table at twice its rate, linear in between."""
    made = np.empty((2 * column.shape[0] - 1, column.shape[1]))
    made[::2], made[1::2] = column, 0.5 * (column[:-1] + column[1:])
    return made


def drag(x: np.ndarray, speed: float, rudder: float, c: float) -> list[float]:
    """Eq. (16) with v|v| in sway and r|r| in yaw, written once more for the other integrator."""
    v, r, _ = x
    a11, a12, a21, a22, b1, b2 = HULL
    sway = a11 * speed * v + a12 * speed * r + b1 * speed**2 * rudder - c * v * abs(v) / 150.0
    yaw = a21 * speed * v + a22 * speed * r + b2 * speed**2 * rudder - c * r * abs(r)
    return [sway, yaw, r]


def test_a_free_run_with_drag_is_that_of_another_integrator():
    run = run_of()
    effect = from_expression(["sway: -c*v*abs(v)/L; yaw: -c*r*abs(r)"])
    start = np.array([0.2, 0.003, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    found = RunFilter(run, EffectModel((effect,)), SPEC).free(HULL, np.array([1.7]), start)

    def slope(t: float, x: np.ndarray) -> list[float]:
        return drag(x, np.interp(t, run.time_s, run.speed_m_s), np.interp(t, run.time_s, run.rudder_rad), 1.7)

    span = (0.0, run.time_s[-1])
    solution = solve_ivp(slope, span, start[:3], t_eval=run.time_s, rtol=1e-10, atol=1e-12, max_step=0.25)
    assert found == pytest.approx(solution.y.T, abs=2e-5)
    plain = RunFilter(run, EffectModel(), SPEC).free(HULL, np.zeros(0), start)
    assert np.max(np.abs(plain - found)) > 0.05  # the term is no rounding


def test_a_measurement_off_the_grid_is_predicted_at_its_own_instant():
    run = run_of()
    late = replace(run, offset_s=np.full((N, 3), 0.25))
    start = np.array([0.2, 0.003, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    on, off = (RunFilter(one, EffectModel(), SPEC).free(HULL, np.zeros(0), start) for one in (run, late))
    fine = solve_ivp(
        lambda t, x: drag(x, np.interp(t, run.time_s, run.speed_m_s), np.interp(t, run.time_s, run.rudder_rad), 0.0),
        *((0.0, run.time_s[-1]), start[:3]),
        t_eval=run.time_s[:-1] + 0.25,
        rtol=1e-10,
        atol=1e-12,
        max_step=0.25,
    ).y.T
    error, ignored = np.abs(off[:-1] - fine).max(axis=0), np.abs(on[:-1] - fine).max(axis=0)
    assert np.all(error < 0.06 * ignored)


def test_an_effect_with_a_state_of_its_own_remembers():
    run = run_of()
    memory = Effect(
        name="memory_of_v",
        title="m",
        group="own",
        plain="m",
        equation="m",
        reference="m",
        parameters=(Parameter(name="c", unit="1/s", low=-1.0, high=1.0, steps=(0.01,), meaning="m"),),
        terms={"sway": "-c*m1"},
        states=(ExtraState(name="m1", derivative="(v - m1)/20"),),
    )
    start = np.array([0.2, 0.003, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    found = RunFilter(run, EffectModel((memory,)), SPEC).free(HULL, np.array([0.02]), start)

    def slope(t: float, x: np.ndarray) -> list[float]:
        speed, rudder = np.interp(t, run.time_s, run.speed_m_s), np.interp(t, run.time_s, run.rudder_rad)
        dv, dr, dpsi = drag(x[:3], speed, rudder, 0.0)
        return [dv - 0.02 * x[3], dr, dpsi, (x[0] - x[3]) / 20.0]

    solution = solve_ivp(
        slope, (0.0, run.time_s[-1]), [*start[:3], 0.0], t_eval=run.time_s, rtol=1e-10, atol=1e-12, max_step=0.25
    )
    assert found == pytest.approx(solution.y.T[:, :3], abs=2e-5)


def test_effects_are_absent_at_nothing_and_named_once():
    run = run_of()
    one, other = from_expression(["yaw: r*abs(r)"], "one"), from_expression(["sway: v**3"], "other")
    plain = RunFilter(run, EffectModel(), SPEC).run_filter(HULL, LEVELS, np.zeros(0))
    both = RunFilter(run, EffectModel((one, other)), SPEC).run_filter(HULL, LEVELS, np.zeros(2))
    assert both.log_likelihood == pytest.approx(plain.log_likelihood, rel=1e-13)
    with pytest.raises(UsageError, match="holds 'one' twice"):
        EffectModel((one, one))
