"""Monte Carlo at the information limit: the errors of maximum likelihood beside the Cramer-Rao bound.

Each run sails a zigzag of twenty minutes (a boat of 3 m: of her own time) in the paper's wind and stream, reads it by
instruments with one common clock, and fits it. Two bounds are held against the errors: the bound at the truth, from the
expected information at the simulator's own parameters, noise levels and disturbances, and the bound that the estimator
reports. From bytes on: `benchmarks.identify.monte_carlo`.
"""

from __future__ import annotations

import argparse
import pickle
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from math import radians
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.identify.information_bound import information_at
from benchmarks.identify.information_page import write_page
from benchmarks.identify.information_result import Case, Run
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings, identify
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.simulate.disturbances import CALM, Disturbance, Environment
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.instruments import Instrument
from kempf.pipeline.simulate.trial import (
    PAPER_ENVIRONMENT,
    Trial,
    TrialSettings,
    simulate_trial,
    zigzag_settings,
)
from kempf.schemas.channels import CHANNELS
from kempf.schemas.errors import KempfError
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.units import SECOND_NS

SCALES = (0.3, 1.0, 3.0)
VELOCITY, YAW_RATE, HEADING, RUDDER, LOG = 0.05, radians(0.03), radians(0.05), radians(0.1), 0.05
#: fast enough that how the rudder moved between its readings does not matter
RUDDER_HZ = 4.0
#: the boat lives so many times faster than a Mariner, by V / L: her instruments are read faster, her trial is shorter
HASTE = {"usv": 12.0}
SPEC = ModelSpec()
#: disturbances that forget as the simulator's slow parts do, where the default ones hardly forget within a trial
FORGETTING = SPEC.model_copy(
    update={"wind_correlation_rate_per_s": 1 / 300, "current_correlation_rate_per_s": 1 / 1800},
)
#: force and stream drawn from eq. (16) itself, of the paper's sizes: there the model is exactly true
DRAWN = Environment(
    wind_force=Disturbance(0.0, 5e-3, FORGETTING.wind_correlation_rate_per_s),
    current_north=Disturbance(0.0, 0.2, FORGETTING.current_correlation_rate_per_s),
    current_east=Disturbance(0.0, 0.2, FORGETTING.current_correlation_rate_per_s),
)
ENVIRONMENTS: dict[str, Environment] = {
    "paper": PAPER_ENVIRONMENT,
    "drawn": DRAWN,
    "constant": replace(PAPER_ENVIRONMENT, wind_force=replace(PAPER_ENVIRONMENT.wind_force, std=0.0)),
    "calm": CALM,
}
#: the bound at the truth is averaged over the first runs of a cell: it hardly differs from run to run
BOUNDED = 40
#: a level that is nothing in the truth stands at the lower bound of the search
_LOW = MaximumLikelihoodSettings().sigma_low
_CHANNEL_OF = {channel.column: channel for channel in CHANNELS.values()}


def instruments(case: Case) -> tuple[Instrument, ...]:
    """Return what she carries, all on one clock: every second, the boat every twelfth of one; the rudder faster."""
    rate = HASTE.get(case.hull, 1.0)
    # a boat of 3 m whose noise is as small beside her motion as a ship's is: velocities by V, rates by V / L
    slow, fast = (0.25, HASTE["usv"]) if case.control == "noise of her size" else (1.0, 1.0)
    exact = 0.0 if case.control == "exact rudder and log" else 1.0
    readings = 2.0 if case.control == "rudder at 2 Hz" else RUDDER_HZ
    return tuple(
        Instrument(name, rate * per, 0.0, 0.0, noise={quantity: std})
        for name, per, quantity, std in (
            ("gnss", 1.0, "velocity", slow * VELOCITY),
            ("heading", 1.0, "heading", HEADING),
            ("yaw_rate", 1.0, "yaw_rate", fast * YAW_RATE),
            ("rudder", readings, "rudder_angle", exact * RUDDER),
            ("log", 1.0, "speed_through_water", exact * slow * LOG),
        )
    )


def _seed(case: Case, number: int) -> int:
    """Every ship and noise level has draws of its own; what is compared with a cell of the grid has the same draws."""
    return number + 10_000 * (len(SCALES) * list(HULLS).index(case.hull) + SCALES.index(case.scale))


def settings_of(case: Case, number: int) -> TrialSettings:
    """Return the settings of one run; base headings all round, first sides in turn."""
    haste = HASTE.get(case.hull, 1.0)
    settings = zigzag_settings(
        case.hull,
        seed=_seed(case, number),
        first_side="starboard" if number % 2 == 0 else "port",
        duration_s=1200.0 / haste,
        steady_s=120.0 / haste,
        environment=ENVIRONMENTS[case.environment],
        noise_scale=case.scale,
    )
    # the golden angle spreads the base headings over the stream's direction
    return replace(settings, heading_deg=(137.508 * number) % 360.0, instruments=instruments(case))


def record_of(trial: Trial, case: Case) -> Record:
    """Return the zigzag as the estimator gets it, from 20 s (of a ship) before the first execute."""
    series = {}
    for record in trial.instruments:
        for column, value in record.values.items():
            channel = _CHANNEL_OF[column]
            held = np.unwrap(value) if channel.wrap == "circle" else value
            series[channel.name] = Series(record.measured_utc_ns, held)
    log = Instruments(series, dict.fromkeys(series, "simulated"), ())
    zigzag, start = trial.truth.zigzags[0], trial.settings.start_utc_ns
    lead = 20.0 / HASTE.get(case.hull, 1.0)
    cut = (start + round((zigzag.start_s - lead) * SECOND_NS), start + round(zigzag.end_s * SECOND_NS))
    made = make_record(log, *cut)
    measured = made.measured.copy()
    if case.control == "y_v from the exact heading":
        psi = trial.truth.trajectory.at((log.series["heading"].time_utc_ns - start) / SECOND_NS).state[:, 2]
        exact = replace(log, series={**series, "heading": Series(series["heading"].time_utc_ns, psi)})
        other = make_record(exact, *cut)
        measured[:, 0] = other.measured[:, 0]
        made = replace(made, heading_rad=other.heading_rad)
    if not case.with_heading:
        measured[:, 2] = np.nan
    return replace(made, measured=measured)


def true_theta(case: Case) -> Float:
    """Return hull parameters and logarithms of the noise levels as the simulator has them, shape (12,)."""
    hull, environment = HULLS[case.hull], ENVIRONMENTS[case.environment]
    p, noise = hull.parameters, {k: v for i in instruments(case) for k, v in i.noise.items()}
    # eq. (18) turns the heading's noise into speed
    across = np.hypot(noise["velocity"], hull.trial_speed_m_s * noise["heading"])
    measurement = case.scale * np.array([across, noise["yaw_rate"], noise["heading"]])
    sigma = np.array([environment.wind_force.std, 0.0, environment.current_north.std, *measurement])
    return np.concatenate(
        [[p.a11, p.a12, p.a21, p.a22, p.b1, p.b2], np.log(np.maximum(sigma, np.array(_LOW)))],
    )


def run(case: Case, number: int) -> Run:
    """Sail, read, fit, and take the information at the truth."""
    trial = simulate_trial(settings_of(case, number))
    arm, settings, theta = trial.truth.wind_arm_per_m, MaximumLikelihoodSettings(), true_theta(case)
    spec = FORGETTING if case.control == "forgetting" else SPEC
    try:
        record = record_of(trial, case)
        found = identify(record, spec.with_arm(arm), arm, settings)
    except KempfError as error:
        return Run(case, number, failure=error.code)
    # the bound is that of the simulator's disturbances, whatever was fitted; only drawn streams change
    acting = ENVIRONMENTS[case.environment]
    rates = {} if acting.current_north.std else {"current_correlation_rate_per_s": SPEC.current_correlation_rate_per_s}
    true_spec = FORGETTING.model_copy(update=rates).with_arm(arm)
    bounds: dict[str, Any] = {}
    if number < BOUNDED:
        information, free = information_at(record, true_spec, arm, theta, acting.wind_force.mean)
        bounds = {"information": information, "free": free}
    return Run(
        case,
        number,
        value=found.hull.array(),
        std=np.array([p.std for p in found.parameters]),
        truth=theta[:6],
        levels={n.name: n.value for n in found.noise},
        converged=found.converged,
        widened=found.report["standard_errors"] != "information",
        gross=sum(found.report["gross_errors"].values()),
        **bounds,
    )


def cases() -> list[Case]:
    """Return all cells: the grid, the paper's two measurements, disturbances of eq. (16), one source off at a time."""
    grid = [Case(hull, scale) for hull in HULLS for scale in SCALES]
    two = [Case(hull, 1.0, with_heading=False) for hull in HULLS]
    drawn = [Case(hull, 1.0, environment="drawn") for hull in HULLS]
    walks = [Case(hull, 1.0, control="forgetting") for hull in HULLS]
    controls = [
        Case("mariner", 1.0, environment="drawn", control="forgetting"),
        Case("mariner", 1.0, environment="constant"),
        Case("mariner", 1.0, environment="calm"),
        Case("mariner", 1.0, control="exact rudder and log"),
        Case("mariner", 1.0, control="y_v from the exact heading"),
        Case("ferry", 0.3, control="rudder at 2 Hz"),
        Case("usv", 1.0, control="exact rudder and log"),
        *[Case("usv", scale, control="noise of her size") for scale in SCALES],
    ]
    return [*grid, *two, *drawn, *walks, *controls]


def wanted(runs: int) -> list[tuple[Case, int]]:
    """Return all runs, ``runs`` of a cell of the grid and a share of them of the other cells.

    Cells take turns, so that an early stop would leave all of them equally far.
    """
    return [(case, number) for number in range(runs) for case in cases() if number < max(1, runs // case.share)]


def sail_all(tasks: Sequence[tuple[Case, int]], processes: int, keep: Path | None = None) -> list[Run]:
    """Do all runs, in any order; return them sorted. A file given keeps what is done, for a run broken off."""
    order = {case: k for k, case in enumerate(dict.fromkeys(case for case, _ in tasks))}
    done: list[Run] = pickle.loads(keep.read_bytes()) if keep is not None and keep.exists() else []  # noqa: S301 - own
    there = {(one.case, one.number) for one in done}
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        for one in as_completed([pool.submit(run, *task) for task in tasks if task not in there]):
            done.append(one.result())
            if len(done) % 50 == 0:
                if keep is not None:
                    keep.write_bytes(pickle.dumps(done))
                print(f"{len(done)}/{len(tasks)}", file=sys.stderr, flush=True)
    return sorted(done, key=lambda r: (order[r.case], r.number))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--keep", type=Path, help="file that keeps what is done between broken-off runs")
    options = parser.parse_args()
    runs = sail_all(wanted(options.runs), options.processes, options.keep)
    print(write_page(runs, f"--runs {options.runs}").read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
