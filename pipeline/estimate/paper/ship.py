"""The paper's procedure for the ship of eq. (17): one vehicle of `kempf.pipeline.estimate.paper.procedure`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.paper.least_squares import estimate_from_discrete
from kempf.pipeline.estimate.paper.procedure import ProcedureCourse, ProcedurePass, ProcedureSettings, iterate
from kempf.pipeline.estimate.paper.vehicle import LinearVehicle, SlowDisturbance
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.record.sampled import Sampled, sample
from kempf.pipeline.estimate.result import Estimate
from kempf.pipeline.model.ship import Hull, continuous_from_discrete
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec

#: What the paper reports after 25 iterations: errors in percent of the true values.
REPORTED_PERCENT: dict[str, float] = {"a11": 10.0, "a12": 10.0, "a21": 25.0, "a22": 20.0, "b1": 20.0, "b2": 5.0}


@dataclass(frozen=True)
class PaperSettings:
    """Settings of the procedure."""

    #: The paper shows 25.
    iterations: int = 25
    #: Step of eq. (17), s; None takes the GNSS period.
    step_s: float | None = None
    #: force_std_m_s2, current_std_m_s: sigma_F and sigma_V of eq. (16); the paper's simulated trial has a force of 5e-3
    #: m/s^2 and a current of 0.3 m/s.
    force_std_m_s2: float = 5e-3
    current_std_m_s: float = 0.3
    #: wind_rate_per_s, current_rate_per_s: mu_F and mu_V of eq. (16), which belong to these levels; None takes those of
    #: the model specification.
    wind_rate_per_s: float | None = 1 / 300
    current_rate_per_s: float | None = 1 / 1800
    #: See `kempf.pipeline.estimate.paper.procedure.ProcedureSettings`.
    tolerance: float = 1e-4
    #: Force and current are constants, states with zero derivative, as in the paper's simulated trial; no rates are
    #: used.
    constant: bool = False
    #: floor, run_on: See `kempf.pipeline.estimate.paper.procedure.ProcedureSettings`.
    floor: bool = True
    run_on: bool = False

    def rates(self, spec: ModelSpec) -> tuple[float, float]:
        """Return mu_F and mu_V, 1/s."""
        wind, current = self.wind_rate_per_s, self.current_rate_per_s
        return (
            spec.wind_correlation_rate_per_s if wind is None else wind,
            spec.current_correlation_rate_per_s if current is None else current,
        )


def ship(step_s: float, *disturbances: SlowDisturbance) -> LinearVehicle:
    """Return the ship as a linear vehicle: sway and yaw, the rudder, and what acts on her.

    Parameters
    ----------
    *disturbances : SlowDisturbance
        Made by `wind_force` and `lateral_current`.
    """
    return LinearVehicle(("v", "r"), ("rudder",), (1.0, 0.1), step_s, disturbances)


def wind_force(std_m_s2: float, arm_per_m: float, rate_per_s: float = 0.0) -> SlowDisturbance:
    """Return F of eq. (16) with its moment l F: standard deviation, l, correlation rate (0: constant)."""
    return SlowDisturbance("F", (1.0, arm_per_m), (0.0, 0.0), std_m_s2, rate_per_s)


def lateral_current(std_m_s: float, rate_per_s: float = 0.0) -> SlowDisturbance:
    """Return V_T of eq. (16), which is measured with the lateral speed and does not act."""
    return SlowDisturbance("V_T", (0.0, 0.0), (1.0, 0.0), std_m_s, rate_per_s)


def noise_covariance(record: Record, step_s: float) -> Float:
    """Return R for lateral speed and yaw rate from the noise levels found in the record, shape (2, 2)."""
    lateral, yaw, heading = record.noise_start
    turning = yaw if np.isfinite(yaw) else heading / step_s
    return np.diag([max(lateral, 1e-6) ** 2, max(turning, 1e-8) ** 2])


def run(record: Record, spec: ModelSpec, arm_per_m: float, settings: PaperSettings) -> tuple[Sampled, ProcedureCourse]:
    """Run the procedure and return it whole, states and disturbances of every pass included.

    Parameters
    ----------
    spec : ModelSpec
        Correlation rates of the disturbances where the settings leave them open.
    arm_per_m : float
        l of eq. (16), 1/m.

    Returns
    -------
    sampled : Sampled
        The record on the grid of eq. (17).
    course : ProcedureCourse
    """
    sampled = sample(record, settings.step_s)
    wind_rate, current_rate = (0.0, 0.0) if settings.constant else settings.rates(spec)
    vehicle = ship(
        sampled.step_s,
        wind_force(settings.force_std_m_s2, arm_per_m, wind_rate),
        lateral_current(settings.current_std_m_s, current_rate),
    )
    R = noise_covariance(record, sampled.step_s)
    procedure_settings = ProcedureSettings(settings.iterations, settings.tolerance, settings.floor, settings.run_on)
    return sampled, iterate(vehicle, sampled.measured, sampled.rudder[:, None], R, procedure_settings)


def percent_off(hull: Hull, truth: Hull) -> dict[str, float]:
    """Return the errors of the six parameters in percent of the true ones, NaN where nothing was found."""
    errors = 100.0 * (hull.array() / truth.array() - 1.0)
    return dict(zip(HULL_PARAMETERS, (float(e) for e in errors), strict=True))


def percent_std(estimate: Estimate, truth: Hull) -> dict[str, float]:
    """Return the standard errors of the six parameters in percent of the true ones."""
    return {p.name: 100.0 * p.std / abs(float(t)) for p, t in zip(estimate.parameters, truth.array(), strict=True)}


def hull_of(iteration: ProcedurePass, sampled: Sampled) -> Hull:
    """Return the continuous parameters of a pass; NaN where its matrices belong to no continuous ship."""
    regression = iteration.regression
    hull = continuous_from_discrete(regression.A, regression.B, sampled.speed_m_s, sampled.step_s)
    return hull if hull is not None else Hull(*[float("nan")] * 6)


def identify(record: Record, spec: ModelSpec, arm_per_m: float, settings: PaperSettings) -> Estimate:
    """Run the procedure on one segment.

    Parameters
    ----------
    spec : ModelSpec
        Correlation rates of the disturbances where the settings leave them open.
    arm_per_m : float
        l of eq. (16), 1/m.

    Returns
    -------
    Estimate
        ``report["reason"]`` says converged, cycling, diverged or still moving; ``iterations`` holds [A B], the
        continuous parameters and the mean disturbances of every pass, the first approximation as number 0.
    """
    return estimate_of(record, *run(record, spec, arm_per_m, settings))


def estimate_of(record: Record, sampled: Sampled, course: ProcedureCourse) -> Estimate:
    """Turn what `run` returned into the estimate of its last pass."""
    warnings = list(record.warnings)
    if course.hidden:
        warnings.append(f"the measurements do not determine {' and '.join(course.hidden)}: the model is not observable")
    return estimate_from_discrete(
        "paper",
        sampled,
        course.passes[-1].regression,
        tuple(warnings),
        converged=course.end == "converged",
        reason=course.reason,
        iterations=tuple(_entry(count, iteration, sampled) for count, iteration in enumerate(course.passes)),
    )


def _entry(count: int, iteration: ProcedurePass, sampled: Sampled) -> dict[str, object]:
    regression = iteration.regression
    values = [float(x) if np.isfinite(x) else None for x in hull_of(iteration, sampled).array()]
    means = (
        [None, None]
        if iteration.filtered is None
        else [float(x) for x in np.mean(iteration.filtered.updated[:, 2:4], axis=0)]
    )
    return {
        "iteration": count,
        "A": [[float(x) for x in row] for row in regression.A],
        "B": [float(x) for x in regression.B[:, 0]],
        **dict(zip(HULL_PARAMETERS, values, strict=True)),
        "mean_force_m_s2": means[0],
        "mean_current_m_s": means[1],
        "change": None if count == 0 else iteration.change,
    }
