"""The paper's own experiment: a zigzag simulated under constant wind force and current, identified its way and ours.

What the paper does not state (ship, noise, sampling, length) is chosen here, openly: see `_conditions`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import radians
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Series
from kempf.pipeline.estimate import maximum_likelihood
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings
from kempf.pipeline.estimate.paper import ship as paper
from kempf.pipeline.estimate.paper.procedure import ProcedureCourse
from kempf.pipeline.estimate.paper.ship import (
    REPORTED_PERCENT,
    PaperSettings,
    hull_of,
    percent_off,
    percent_std,
)
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.sampled import Sampled
from kempf.pipeline.estimate.result import Estimate, Value
from kempf.pipeline.model.ship import Hull, discrete_from_continuous
from kempf.pipeline.simulate.disturbances import Disturbance, Environment
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.instruments import Instrument
from kempf.pipeline.simulate.trial import Trial, TrialSettings, simulate_trial, zigzag_settings
from kempf.schemas.channels import CHANNELS
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec
from kempf.schemas.units import SECOND_NS

Float = NDArray[np.float64]

FORCE_M_S2, CURRENT_M_S, ITERATIONS = 5e-3, 0.3, 25
#: Usual instruments: GNSS velocity, yaw rate, heading; all are multiplied by the noise factor.
NOISE_M_S, NOISE_RAD_S, NOISE_RAD = 0.05, radians(0.03), radians(0.05)
#: Factors shown: small enough for the procedure, and usual instruments.
NOISE_FACTORS = (0.1, 1.0)
_HULL, _LENGTH_S, _LEAD_S, _RATE_HZ, _SEED = "mariner", 1200.0, 20.0, 1.0, 0
#: The rudder is read faster than the rest, or its corners are rounded; the procedure itself works at 1 Hz.
_RUDDER_HZ = 2.0


@dataclass(frozen=True, eq=False)
class Experiment:
    """The experiment at one level of noise."""

    #: On `NOISE_M_S`, `NOISE_RAD_S` and `NOISE_RAD`.
    noise_factor: float
    #: Shape (n,). Since the first execute.
    time_s: Float
    #: true, first, last: Shape (n, 4). v, r, F, V_T: as they were; as the filter has them with the first approximation;
    #: with the last iteration's parameters.
    true: Float
    first: Float
    last: Float
    #: Shape (n, 2). y_v and y_r.
    measured: Float
    #: Every iteration.
    course: ProcedureCourse
    #: After the last one.
    procedure: Estimate
    #: first_error, last_error, ml_error: Errors in percent of the true parameter.
    first_error: dict[str, float]
    last_error: dict[str, float]
    ml_error: dict[str, float]
    #: Standard errors of maximum likelihood, likewise.
    ml_std: dict[str, float]
    #: Of the same record.
    maximum_likelihood: Estimate

    def as_json(self) -> dict[str, Any]:
        """Return the JSON content."""
        accuracy = {
            p.name: {
                "paper_percent": REPORTED_PERCENT[p.name],
                "first_percent": self.first_error[p.name],
                "last_percent": self.last_error[p.name],
                "ml_percent": self.ml_error[p.name],
                "ml_std_percent": self.ml_std[p.name],
            }
            for p in self.maximum_likelihood.parameters
        }
        disturbances = {
            name: {"true": self.true[-1, k], "first": self.first[-1, k], "last": self.last[-1, k]}
            for name, k in (("force_m_s2", 2), ("current_m_s", 3))
        }
        return {
            "noise_factor": self.noise_factor,
            "end": self.course.end,
            "reason": self.course.reason,
            "accuracy": accuracy,
            "disturbances_at_the_end": disturbances,
            "iterations": list(self.procedure.iterations),
            "maximum_likelihood": {
                "converged": self.maximum_likelihood.converged,
                "reason": self.maximum_likelihood.report["reason"],
                "warnings": list(self.maximum_likelihood.warnings),
            },
        }


@dataclass(frozen=True, eq=False)
class Reproduction:
    """The experiment at every level of noise, and what is true of all."""

    #: What holds: its value, and who stated it, "paper" or "ours".
    conditions: dict[str, tuple[str, str]]
    #: The six parameters of eq. (16).
    truth: dict[str, float]
    #: The matrices of eq. (17) that belong to them; no errors.
    discrete: tuple[Value, ...]
    experiments: tuple[Experiment, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the JSON content."""
        return {
            "conditions": {name: {"value": v, "stated_by": by} for name, (v, by) in self.conditions.items()},
            "truth": self.truth,
            "discrete": {v.name: {"value": v.value, "unit": v.unit} for v in self.discrete},
            "experiments": [experiment.as_json() for experiment in self.experiments],
        }


def reproduce_paper(progress: Progress = silent) -> Reproduction:
    """Sail the paper's zigzag at every level of noise and identify the ship from it."""
    experiments = []
    for done, factor in enumerate(NOISE_FACTORS):
        progress(done, len(NOISE_FACTORS), f"the zigzag with {factor:g} times the usual noise")
        experiments.append(_experiment(factor))
    ship = HULLS[_HULL]
    truth = {name: float(getattr(ship.parameters, name)) for name in HULL_PARAMETERS}
    A, B = discrete_from_continuous(Hull(**truth), ship.trial_speed_m_s, 1.0 / _RATE_HZ)
    flat = [float(x) for x in (*A.ravel(), *B.ravel())]
    discrete = tuple(
        Value(v.name, x, 0.0, v.unit) for v, x in zip(experiments[0].procedure.discrete, flat, strict=True)
    )
    return Reproduction(_conditions(), truth, discrete, tuple(experiments))


def _conditions() -> dict[str, tuple[str, str]]:
    """Return the conditions of the experiment, each with who stated it."""
    ship = HULLS[_HULL]
    noise = f"{NOISE_M_S:g} m/s, {np.rad2deg(NOISE_RAD_S):.2g} deg/s and {np.rad2deg(NOISE_RAD):.2g} deg heading"
    return {
        "manoeuvre": ("zigzag", "paper"),
        "wind force": (f"{FORCE_M_S2:g} m/s^2, constant", "paper"),
        "current": (f"{CURRENT_M_S:g} m/s, constant, lateral (V_T)", "paper"),
        "iterations": (f"{ITERATIONS}", "paper"),
        "its angles and length": (f"20/20 to starboard, {_LENGTH_S / 60.0:g} min and {_LEAD_S:g} s before", "ours"),
        "ship": (f"{ship.name}, {ship.length_m:g} m, {ship.trial_speed_m_s:g} m/s, speed held", "ours"),
        "arm of the wind force": (f"one over the length, {ship.wind_arm_per_m:.3g} 1/m", "ours"),
        "sampling": (f"{_RATE_HZ:g} Hz, instruments in step; rudder {_RUDDER_HZ:g} Hz", "ours"),
        "noise": (f"{' and '.join(f'{f:g}' for f in NOISE_FACTORS)} times ({noise})", "ours"),
        "disturbances": (f"constants, {FORCE_M_S2:g} m/s^2 and {CURRENT_M_S:g} m/s about zero beforehand", "ours"),
        "R of the filter": ("the record's noise, no less than half the regression's residual variance", "ours"),
    }


def _settings(factor: float) -> TrialSettings:
    acting = Environment(wind_force=Disturbance(FORCE_M_S2), lateral_current=Disturbance(CURRENT_M_S))
    noises: dict[str, dict[str, float]] = {
        "gnss": {"velocity": NOISE_M_S},
        "heading": {"heading": NOISE_RAD},
        "yaw_rate": {"yaw_rate": NOISE_RAD_S},
        "rudder": {},
        "log": {},
    }
    carried = tuple(
        Instrument(
            name,
            _RUDDER_HZ if name == "rudder" else _RATE_HZ,
            jitter_s=0.0,
            latency_s=0.0,
            latency_jitter_s=0.0,
            noise=noise,
        )
        for name, noise in noises.items()
    )
    settings = zigzag_settings(_HULL, environment=acting, duration_s=_LENGTH_S, noise_scale=factor, seed=_SEED)
    return replace(settings, hull=replace(settings.hull, speed_loss=0.0), instruments=carried)


def _instruments(trial: Trial) -> Instruments:
    of_column = {channel.column: channel for channel in CHANNELS.values()}
    series = {}
    for record in trial.instruments:
        for column, value in record.values.items():
            channel = of_column[column]
            held = np.unwrap(value) if channel.wrap == "circle" else value
            series[channel.name] = Series(record.measured_utc_ns, held)
    return Instruments(series, dict.fromkeys(series, "simulated"), ())


def _experiment(factor: float) -> Experiment:
    settings = _settings(factor)
    trial = simulate_trial(settings)
    zigzag = trial.truth.zigzags[0]
    begin, end = zigzag.start_s - _LEAD_S, zigzag.end_s
    bounds = (settings.start_utc_ns + round(t * SECOND_NS) for t in (begin, end))
    record = make_record(_instruments(trial), *bounds)
    arm, spec = trial.truth.wind_arm_per_m, ModelSpec(name="paper", current="lateral")
    # all 25 iterations are made, as the paper's Fig. 2 shows them
    paper_settings = PaperSettings(iterations=ITERATIONS, constant=True, run_on=True)
    sampled, course = paper.run(record, spec, arm, paper_settings)
    likely = maximum_likelihood.identify(record, spec, arm, MaximumLikelihoodSettings())
    truth = Hull(*(getattr(trial.truth.parameters, name) for name in HULL_PARAMETERS))
    since_start = (record.start_utc_ns - settings.start_utc_ns) / SECOND_NS
    time = since_start + sampled.step_s * np.arange(sampled.measured.shape[0], dtype=np.float64)
    sample = trial.truth.trajectory.at(time)
    first, last = _states(course, sampled)
    return Experiment(
        noise_factor=factor,
        time_s=time - zigzag.start_s,
        true=np.column_stack([sample.state[:, :2], sample.forcing[:, 0], sample.forcing[:, 3]]),
        first=first,
        last=last,
        measured=sampled.measured,
        course=course,
        procedure=paper.estimate_of(record, sampled, course),
        first_error=percent_off(hull_of(course.passes[0], sampled), truth),
        last_error=percent_off(hull_of(course.passes[-1], sampled), truth),
        ml_error=percent_off(likely.hull, truth),
        ml_std=percent_std(likely, truth),
        maximum_likelihood=likely,
    )


def _states(course: ProcedureCourse, sampled: Sampled) -> tuple[Float, Float]:
    """States and disturbances with the parameters of the first approximation and of the last iteration."""
    nothing = np.full((sampled.measured.shape[0], 4), np.nan)
    after = course.passes[1].filtered if len(course.passes) > 1 else None
    return (
        nothing if after is None else after.updated,
        nothing if course.last is None else course.last.updated,
    )
