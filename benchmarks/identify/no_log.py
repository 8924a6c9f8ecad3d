"""What it costs to have no log: ``python -m benchmarks.identify.no_log``.

Simulated zigzags in streams of several strengths, base headings all round, each identified with the log, with the GNSS
speed along the bow taken for the speed through the water, and with the speed estimated from the longitudinal equation:
alone, with a trial speed, and with a second zigzag on the opposite heading. Compared are errors, standard errors and
how often the 95 % intervals hold the truth. Then what the method does not know of: a wind force that follows the
heading, and a speed that wanders.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from benchmarks import result_page
from benchmarks.identify import no_log_fleet
from benchmarks.identify.no_log_fleet import Found
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Series
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings, identify
from kempf.pipeline.estimate.no_log.identify import NoLogSettings, identify_without_log
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.result import Estimate
from kempf.pipeline.simulate.disturbances import Disturbance, Environment
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.instruments import DEFAULT_INSTRUMENTS
from kempf.pipeline.simulate.manoeuvre import SteadyCourse, ZigzagTest
from kempf.pipeline.simulate.plant import STATE
from kempf.pipeline.simulate.programme import GRID_S
from kempf.pipeline.simulate.trial import Trial, TrialSettings, simulate_trial
from kempf.schemas.channels import CHANNELS
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec
from kempf.schemas.units import SECOND_NS

SHIPS = ("mariner", "container", "tanker", "ferry")
CURRENTS = (0.0, 0.3, 0.6)
#: psi0 and delta0 in degrees, and duration in s, of the two kinds of run
KINDS = {"10 minutes of 20/20": (20.0, 600.0), "5 minutes of 10/10": (10.0, 300.0)}
#: of the trial speed that is given, relative
TRIAL_SPEED_STD = 0.02
WAYS = {
    "log": "with the log",
    "gnss": "GNSS speed for V",
    "none": "no log: V estimated",
    "trial": f"no log, trial speed known to {100 * TRIAL_SPEED_STD:.0f} %",
    "pair": "no log, second zigzag on the opposite heading",
}
COLOURS = {"log": "#222222", "gnss": "#c44e52", "none": "#4c72b0", "trial": "#dd8452", "pair": "#55a868"}
PARAMETERS = tuple(HULL_PARAMETERS)
#: what the simulated ships carry: the usual, but a compass that is read twice a second and not five times
INSTRUMENTS = tuple(replace(i, rate_hz=2.0) if i.name == "heading" else i for i in DEFAULT_INSTRUMENTS)
_COLUMN = {channel.column: channel for channel in CHANNELS.values()}


@dataclass(frozen=True)
class Case:
    """One simulated trial: two zigzags on opposite headings."""

    kind: str
    number: int
    current_m_s: float
    surge_wander: bool = False
    veering_m_s2: float = 0.0

    @property
    def ship(self) -> str:
        return SHIPS[self.number % len(SHIPS)]


@dataclass(frozen=True)
class Result:
    """One identification: relative errors and standard errors of six parameters and of the mean speed, shape (7,)."""

    case: Case
    way: str
    error: np.ndarray
    std: np.ndarray
    converged: bool
    rounds: int


class Veering(Environment):
    """A wind force given point by point of the fine grid, beside the environment's streams."""

    def __init__(self, base: Environment, force: np.ndarray) -> None:
        super().__init__(current_north=base.current_north, current_east=base.current_east)
        object.__setattr__(self, "force", force)

    def forcing(self, n: int, step_s: float, seed: int) -> np.ndarray:
        table = super().forcing(n, step_s, seed)
        force: np.ndarray = self.force  # type: ignore[attr-defined]
        table[:, 0] = np.concatenate([force, np.full(max(0, n - force.size), force[-1])])[:n]
        return table


def settings_of(case: Case) -> TrialSettings:
    """Base headings, stream directions and seeds follow from the number of the case."""
    psi0, duration = KINDS[case.kind]
    random = np.random.default_rng([case.number, 7])
    heading, towards = random.uniform(0.0, 360.0, 2)
    zigzag = ZigzagTest(psi0, psi0, duration_s=duration)
    programme = (SteadyCourse(120.0), zigzag, SteadyCourse(420.0, (heading + 180.0) % 360.0), zigzag)
    # the stream runs along the course in a half of the cases, anywhere in the others
    towards = heading + (180.0 if case.number % 4 < 2 else 0.0) if case.number % 2 else towards
    north, east = case.current_m_s * np.cos(np.deg2rad(towards)), case.current_m_s * np.sin(np.deg2rad(towards))
    slow = 0.02 if case.current_m_s else 0.0
    environment = Environment(
        wind_force=Disturbance(5e-3, 1e-3, 1.0 / 300.0),
        current_north=Disturbance(float(north), slow, 1.0 / 1800.0),
        current_east=Disturbance(float(east), slow, 1.0 / 1800.0),
    )
    return TrialSettings(
        HULLS[case.ship], programme, environment, INSTRUMENTS, seed=case.number, heading_deg=float(heading)
    )


def sail(case: Case) -> Trial:
    """Simulate the case; a wind from one side is the same force again and again until the heading agrees with it."""
    settings = settings_of(case)
    trial = simulate_trial(settings)
    for _ in range(8 if case.veering_m_s2 else 0):
        path = trial.truth.trajectory
        # the force of a wind that stands square to the course at the beginning and a quarter ahead of it
        angle = np.deg2rad(settings.heading_deg) + np.deg2rad(45.0) - path.column("psi")
        force = case.veering_m_s2 * np.sin(angle)
        trial = simulate_trial(replace(settings, environment=Veering(settings.environment, force)))
    return trial


def instruments_of(case: Case, trial: Trial) -> Instruments:
    """Every reading at its instant; a wandering speed is put on the log and on the GNSS alike."""
    series = {}
    for record in trial.instruments:
        for column, value in record.values.items():
            channel = _COLUMN[column]
            held = np.unwrap(value) if channel.wrap == "circle" else value
            series[channel.name] = Series(record.measured_utc_ns, held)
    if case.surge_wander:
        series = _with_wander(series, trial)
    return Instruments(series, dict.fromkeys(series, "simulated"), ())


def wander(trial: Trial) -> np.ndarray:
    """A speed of its own on the fine grid: 1 % of the trial speed, forgotten in 60 s."""
    ship = trial.settings.hull
    random = np.random.default_rng([trial.settings.seed, 11])
    n = trial.truth.trajectory.state.shape[0]
    slow = Disturbance(0.0, 0.01 * ship.trial_speed_m_s, 1.0 / 60.0)
    return slow.path(n, GRID_S, random)


def _with_wander(series: dict[str, Series], trial: Trial) -> dict[str, Series]:
    path, extra, start = trial.truth.trajectory, wander(trial), trial.settings.start_utc_ns

    def at(s: Series, column: np.ndarray) -> np.ndarray:
        return np.interp((s.time_utc_ns - start) / SECOND_NS, path.time_s, column)

    speed, course, log = (series[n] for n in ("speed_over_ground", "course_over_ground", "speed_through_water"))
    more, psi = at(speed, extra), at(speed, path.column("psi"))
    north = speed.value * np.cos(course.value) + more * np.cos(psi)
    east = speed.value * np.sin(course.value) + more * np.sin(psi)
    return {
        **series,
        "speed_over_ground": Series(speed.time_utc_ns, np.hypot(north, east)),
        "course_over_ground": Series(course.time_utc_ns, np.unwrap(np.arctan2(east, north))),
        "speed_through_water": Series(log.time_utc_ns, log.value + at(log, extra)),
    }


def records(case: Case, trial: Trial) -> tuple[Record, Record, Record]:
    """The first zigzag with the log and without, the second without."""
    instruments = instruments_of(case, trial)
    blind = replace(instruments, series={n: s for n, s in instruments.series.items() if n != "speed_through_water"})
    start = trial.settings.start_utc_ns
    first, second = (
        (start + round((z.start_s - 20.0) * SECOND_NS), start + round(z.end_s * SECOND_NS)) for z in trial.truth.zigzags
    )
    return make_record(instruments, *first), make_record(blind, *first), make_record(blind, *second)


def run(case: Case, ways: tuple[str, ...]) -> list[Result]:
    """Sail one case and identify it in every way."""
    trial = sail(case)
    logged, blind, opposite = records(case, trial)
    hull, arm, spec, settings = (
        trial.settings.hull,
        trial.truth.wind_arm_per_m,
        ModelSpec(),
        MaximumLikelihoodSettings(),
    )
    since = (blind.start_utc_ns - trial.settings.start_utc_ns) / SECOND_NS + blind.time_s
    speed = float(np.mean(trial.truth.trajectory.at(since).state[:, STATE.index("V")]))
    if case.surge_wander:
        speed += float(np.mean(np.interp(since, trial.truth.trajectory.time_s, wander(trial))))
    truth = np.array([*(getattr(trial.truth.parameters, name) for name in PARAMETERS), speed])
    stated = hull.trial_speed_m_s * (1.0 + TRIAL_SPEED_STD * np.random.default_rng([case.number, 13]).standard_normal())
    known = NoLogSettings(trial_speed_m_s=float(stated), trial_speed_std_m_s=TRIAL_SPEED_STD * hull.trial_speed_m_s)
    found: dict[str, Estimate] = {}
    for way in ways:
        if way in ("log", "gnss"):
            found[way] = identify(logged if way == "log" else blind, spec, arm, settings)
        elif way == "pair":
            found[way] = identify_without_log(blind, spec, arm, settings, companions=(opposite,))
        else:
            found[way] = identify_without_log(blind, spec, arm, settings, known if way == "trial" else None)
    return [_result(case, way, estimate, truth) for way, estimate in found.items()]


def _result(case: Case, way: str, estimate: Estimate, truth: np.ndarray) -> Result:
    stated = estimate.report.get("speed", {"mean_m_s": estimate.report["speed_m_s"], "std_m_s": np.nan, "rounds": [0]})
    value = np.array([*(p.value for p in estimate.parameters), stated["mean_m_s"]])
    std = np.array([*(p.std for p in estimate.parameters), stated["std_m_s"]])
    return Result(case, way, value / truth - 1.0, std / np.abs(truth), estimate.converged, len(stated["rounds"]))


def rms(results: list[Result]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Root mean squares of errors and standard errors, percent, and the share of 95 % intervals that hold the truth."""
    error, std = (np.array([getattr(r, part) for r in results]) for part in ("error", "std"))
    with np.errstate(invalid="ignore"):
        held = np.where(np.isfinite(std), np.abs(error) < 1.96 * std, np.nan)
    covered = 100.0 * held.mean(axis=0)
    return 100.0 * np.sqrt(np.mean(error**2, axis=0)), 100.0 * np.sqrt(np.mean(std**2, axis=0)), covered


def chosen(results: list[Result], **wanted: object) -> list[Result]:
    """Results whose case and way are as wanted."""
    return [r for r in results if all(getattr(r if key == "way" else r.case, key) == v for key, v in wanted.items())]


def accuracy(results: list[Result], kind: str) -> list[str]:
    """Lines of the tables of one kind of run."""
    lines = [f"## {kind}", ""]
    head = ["stream", "way", *PARAMETERS, "V", "intervals that hold, %", "converged"]
    rows = []
    for current in CURRENTS:
        for way, name in WAYS.items():
            group = chosen(results, kind=kind, current_m_s=current, way=way, surge_wander=False, veering_m_s2=0.0)
            if not group:
                continue
            error, std, covered = rms(group)
            cells = [f"{e:.2g} ({s:.2g})" for e, s in zip(error[:6], std[:6], strict=True)]
            cells.append(f"{error[6]:.2g}" + (f" ({std[6]:.2g})" if np.isfinite(std[6]) else ""))
            count = f"{sum(r.converged for r in group)} of {len(group)}"
            rows.append([f"{current:g} m/s", name, *cells, f"{np.mean(covered[:6]):.0f}", count])
    lines += ["Rms error, and in brackets rms standard error, percent of the truth.", ""]
    return [*lines, *result_page.table(head, rows), ""]


def cost(results: list[Result], kind: str) -> list[str]:
    """What the missing log costs: standard errors over those with the log, all streams together."""
    rows = []
    with_log = rms(chosen(results, kind=kind, way="log", surge_wander=False, veering_m_s2=0.0))[1]
    for way in ("none", "trial", "pair"):
        group = chosen(results, kind=kind, way=way, surge_wander=False, veering_m_s2=0.0)
        error, std, covered = rms(group)
        ratio = [f"{s / w:.2f}" for s, w in zip(std[:6], with_log[:6], strict=True)]
        z = np.array([r.error[6] / r.std[6] for r in group])
        speed = f"{error[6]:.2g} / {std[6]:.2g} / {covered[6]:.0f} / {np.sqrt(np.mean(z**2)):.2f}"
        rows.append([kind, WAYS[way], *ratio, speed])
    return rows


def limits(results: list[Result]) -> list[str]:
    """Lines on what the method does not know of."""
    head = ["what acts", "way", *PARAMETERS, "V", "intervals that hold, %"]
    rows = []
    groups = {
        "nothing beside (stream 0.3 m/s)": {"surge_wander": False, "veering_m_s2": 0.0},
        "V wanders by 1 %, forgotten in 60 s": {"surge_wander": True},
        **{
            f"wind force of {f:g} m/s2 from a fixed direction, 45 degrees off the bow": {"veering_m_s2": f}
            for f in VEERING
        },
    }
    numbers = {r.case.number for r in results if r.case.surge_wander}
    for name, wanted in groups.items():
        for way in ("log", "none"):
            group = chosen(results, kind=FIRST, current_m_s=0.3, way=way, **wanted)
            error, std, covered = rms([r for r in group if r.case.number in numbers])
            cells = [f"{e:.2g} ({s:.2g})" for e, s in zip(error, std, strict=True)]
            rows.append([name, WAYS[way], *cells, f"{np.mean(covered[:6]):.0f}"])
    return result_page.table(head, rows)


def draw(results: list[Result]) -> None:
    """Errors of b2 and V of every run against the current along the bow that GNSS adds to V; bars of all parameters."""
    figure, axes = plt.subplots(2, 2, figsize=(12, 8), layout="constrained")
    for row, kind in enumerate(KINDS):
        for way in ("log", "gnss", "none"):
            group = chosen(results, kind=kind, way=way, surge_wander=False, veering_m_s2=0.0)
            gnss = {(r.case.number, r.case.current_m_s): r.error[6] for r in chosen(results, kind=kind, way="gnss")}
            x = [100.0 * gnss[r.case.number, r.case.current_m_s] for r in group]
            y, bar = ([100.0 * getattr(r, part)[5] for r in group] for part in ("error", "std"))
            style = {"fmt": "o", "ms": 3, "lw": 1, "color": COLOURS[way], "label": WAYS[way]}
            axes[row, 0].errorbar(x, y, np.array(bar), **style)
        axes[row, 0].set(xlabel="stream along the bow, % of V", ylabel="error of b2, %", title=kind)
        axes[row, 0].axhline(0.0, color="0.6", lw=0.8)
        for k, way in enumerate(WAYS):
            group = chosen(results, kind=kind, way=way, current_m_s=CURRENTS[-1], surge_wander=False, veering_m_s2=0.0)
            error, std, _ = rms(group)
            where = np.arange(7) + 0.16 * (k - 2)
            axes[row, 1].bar(where, error, 0.15, color=COLOURS[way], label=WAYS[way])
            axes[row, 1].plot(where, std, "k_", ms=9, label="rms standard error" if k == len(WAYS) - 1 else None)
        axes[row, 1].set_xticks(range(7), [*PARAMETERS, "V"])
        axes[row, 1].set(ylabel="rms error, %", title=f"{kind}, stream {CURRENTS[-1]:g} m/s", yscale="log")
        for panel in axes[row]:
            panel.grid(lw=0.3)
    figure.legend(*axes[0, 1].get_legend_handles_labels(), fontsize=8, ncols=3, loc="outside lower center")
    figure.savefig(result_page.RESULTS / "no_log.png", dpi=90, metadata={"Software": None})
    plt.close(figure)


def cases(runs: int) -> list[tuple[Case, tuple[str, ...]]]:
    """Everything that is run, with its ways."""
    wanted = [
        (Case(kind, number, current), tuple(WAYS)) for kind in KINDS for current in CURRENTS for number in range(runs)
    ]
    few = range(min(runs, 4))
    wanted += [(Case(FIRST, number, 0.3, surge_wander=True), ("log", "none")) for number in few]
    return wanted + [(Case(FIRST, n, 0.3, veering_m_s2=f), ("log", "none")) for f in VEERING for n in few]


#: the kind of run that the limits are shown on, and the wind forces that follow the heading, m/s^2
FIRST = next(iter(KINDS))
VEERING = (2e-3, 1e-2)


def page(results: list[Result], ships: list[Found]) -> list[str]:
    """Lines of the results page."""
    head = ["run", "way", *PARAMETERS, "V: rms error, % / std, % / held, % / rms z"]
    alone = chosen(results, way="none", surge_wander=False, veering_m_s2=0.0)
    lines = [
        f"Simulated zigzags of {', '.join(SHIPS)}; 1 Hz GNSS velocity with 0.05 m/s, 1 Hz yaw rate with 0.03 deg/s; "
        "wind force 5e-3 m/s2 plus a Gauss-Markov part of 1e-3; a stream fixed over ground with a slow part of 0.02 "
        "m/s in either direction, along the course in a half of the runs; base headings all round. The simulator's "
        "speed is first order with a loss by r^2, as the model that is fitted; nothing else moves it.",
        "",
        "![Left: error of b2 against the stream along the bow, with bars of one standard error; right: rms error of "
        "every parameter by method, with the rms standard error as a dash](no_log.png)",
        "",
        "Standard errors over those with the log:",
        "",
        *result_page.table(head, [row for kind in KINDS for row in cost(results, kind)]),
        "",
        f"Fits until the speed stayed: {np.mean([r.rounds for r in alone]):.1f} on average, at most "
        f"{max(r.rounds for r in alone)}.",
        "",
    ]
    for kind in KINDS:
        lines += accuracy(results, kind)
    lines += ["## What the method does not know of", "", f"{FIRST}; rms error (rms standard error), percent.", ""]
    lines += [*limits(results), "", "## Ships that eq. (16) does not hold", ""]
    lines += [
        "The trial logs of eight ships, simulated by another plant with physics that the model lacks, surge among it: "
        "the mean speed of each zigzag less that of the log, which was kept from the estimator, and b2 less that of "
        "the fit with the log.",
        "",
    ]
    return [*lines, *no_log_fleet.lines(ships)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=6, help="runs a kind and stream")
    parser.add_argument("--days", type=int, default=2, help="trial days a ship of the measured ones, one log each")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    options = parser.parse_args()
    results: list[Result] = []
    ships: list[Found] = []
    wanted = cases(options.runs)
    with ProcessPoolExecutor(options.processes, mp_context=get_context("spawn")) as pool:
        jobs = [pool.submit(run, *one) for one in wanted]
        every = no_log_fleet.zigzags(options.data, options.days)
        voyages = [pool.submit(no_log_fleet.compare, one, no_log_fleet.companions(one, every)) for one in every]
        for number, job in enumerate(jobs):
            results += job.result()
            case = wanted[number][0]
            print(f"{number + 1}/{len(wanted)} {case.kind}, {case.ship}, {case.current_m_s:g} m/s", file=sys.stderr)
        for number, voyage in enumerate(voyages):
            ships += voyage.result()
            print(f"{number + 1}/{len(voyages)} {every[number].ship} {every[number].day}", file=sys.stderr)
    draw(results)
    stated = f"--runs {options.runs} --days {options.days}"
    result_page.write("identify.no_log", "What it costs to have no log", page(results, ships), options=stated)


if __name__ == "__main__":
    main()
