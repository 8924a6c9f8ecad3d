"""What parameters are worth at the helm: ``python -m benchmarks.identify.course_keeping``.

Each run identifies a ship from one simulated 20-minute 20/20 zigzag, twice: by maximum likelihood and by the paper's
first approximation (14). Course-keeping laws are made from both, from the true parameters and from another ship's, and
each steers the true ship, of the independent simulator, through the same wind, stream and noise.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import astuple, dataclass, replace
from math import radians

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

from benchmarks import result_page
from kempf.flows.jobs.steering.steered_ship import SteeredShip
from kempf.pipeline.estimate import maximum_likelihood
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings
from kempf.pipeline.estimate.paper import least_squares
from kempf.pipeline.estimate.paper.least_squares import LeastSquaresSettings
from kempf.pipeline.estimate.result import Estimate
from kempf.pipeline.model.ship import Hull
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT
from kempf.pipeline.steering.course_keeping import LawSettings, course_law
from kempf.pipeline.steering.robustness import ClosedLoop, closed_loop
from kempf.pipeline.steering.state_space import NoiseLevels, usual_levels
from kempf.pipeline.steering.track import (
    CourseChangeResponse,
    Performance,
    Track,
    course_change,
    keep_course,
    performance,
)
from kempf.schemas.errors import KempfError
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec
from kempf.workbench.figures.course_keeping import draw_course_keeping
from tests.estimate.simulated import record_of, sailed

SHIPS = ("mariner", "ferry", "tanker")
#: whose parameters are the wrong ones of another ship
OTHER = {"mariner": "tanker", "ferry": "mariner", "tanker": "ferry"}
TRUE, ML, OWN, FIRST, ANOTHER = (
    "true parameters",
    "maximum likelihood",
    "maximum likelihood, its own noise levels",
    "first approximation (14)",
    "another ship's",
)
LAWS = (TRUE, ML, OWN, FIRST, ANOTHER)
LEG_S, SETTLE_S, CHANGE_RAD = 1200.0, 300.0, radians(10.0)
#: what really is: the simulator's instruments and weather; the stream is constant, the usual level lets it wander
LEVELS = replace(usual_levels(ModelSpec()), yaw_rate_rad_s=radians(0.03), heading_rad=radians(0.05))


@dataclass(frozen=True, eq=False)
class Steered:
    """One law on one ship: what came of it, or why there is no law."""

    ship: str
    seed: int
    law: str
    track: Track | None = None
    performance: Performance | None = None
    change: CourseChangeResponse | None = None
    loop: ClosedLoop | None = None
    failure: str = ""

    @property
    def good(self) -> bool:
        """A loop that is stable and a course that was kept."""
        return self.loop is not None and self.loop.stable and self.performance is not None and self.performance.kept


@dataclass(frozen=True, eq=False)
class Run:
    """One zigzag: errors of both estimates in percent, shape (6,), and the laws."""

    ship: str
    seed: int
    percent: dict[str, np.ndarray]
    steered: list[Steered]


def noise_of(estimate: Estimate) -> NoiseLevels:
    level = {v.name: v.value for v in estimate.noise}
    names = ("sigma_F", "sigma_V", "sigma_v", "sigma_r", "sigma_psi")
    usual = astuple(usual_levels(ModelSpec()))
    return NoiseLevels(
        *(max(level.get(n, u), (1.0 if n in names[:2] else 0.02) * u) for n, u in zip(names, usual, strict=True))
    )


def run(ship: str, seed: int) -> Run:
    """Sail, fit, make the laws, steer."""
    hull = HULLS[ship]
    truth = Hull(*astuple(hull.parameters))
    record = record_of(sailed(ship, seed=seed, heading_deg=(137.508 * seed) % 360.0))
    likely = maximum_likelihood.identify(record, ModelSpec(), hull.wind_arm_per_m, MaximumLikelihoodSettings())
    first = least_squares.identify(record, LeastSquaresSettings())
    other = HULLS[OTHER[ship]].parameters
    makings = {
        TRUE: (truth, LEVELS),
        ML: (likely.hull, LEVELS),
        OWN: (likely.hull, noise_of(likely)),
        FIRST: (first.hull, LEVELS),
        ANOTHER: (Hull(*astuple(other)), LEVELS),
    }
    percent = {n: 100.0 * (e.hull.array() / truth.array() - 1.0) for n, e in ((ML, likely), (FIRST, first))}
    return Run(ship, seed, percent, [steer(ship, seed, name, *made) for name, made in makings.items()])


def steer(ship: str, seed: int, name: str, hull: Hull, noise: NoiseLevels) -> Steered:
    """Make one law and let it steer the true ship."""
    plant = HULLS[ship]
    truth, V = Hull(*astuple(plant.parameters)), plant.trial_speed_m_s
    settings = LawSettings(
        step_s=1.0, rudder_rate_rad_s=plant.rudder_rate_rad_s, rudder_limit_rad=plant.rudder_limit_rad
    )
    try:
        law = course_law(hull, V, arm_per_m=plant.wind_arm_per_m, noise=noise, settings=settings)
        loop = closed_loop(law, truth, V)
        sea = SteeredShip(plant, PAPER_ENVIRONMENT, 2.0 * LEG_S + 5.0, seed=1000 + seed)
        track = keep_course(sea, law, 2.0 * LEG_S, 0.0, ((LEG_S, CHANGE_RAD),))
    except KempfError as error:
        return Steered(ship, seed, name, failure=error.code)
    return Steered(ship, seed, name, track, performance(track, SETTLE_S, LEG_S), course_change(track), loop)


def spread(values: list[float], digits: int = 2) -> str:
    """Median with the smallest and the largest."""
    if not values:
        return "-"
    return f"{np.median(values):.{digits}f} ({min(values):.{digits}f} to {max(values):.{digits}f})"


COLUMNS: dict[str, Callable[[Steered], float]] = {
    "heading rms, deg": lambda s: np.degrees(s.performance.heading_rms_rad),
    "heading mean, deg": lambda s: np.degrees(s.performance.heading_mean_rad),
    "rudder rms, deg": lambda s: np.degrees(s.performance.rudder_rms_rad),
    "rudder travel, deg/min": lambda s: 60.0 * np.degrees(s.performance.rudder_travel_rad_s),
    "drift, m/s": lambda s: s.performance.drift_m_s,
    "beside the drift line, m": lambda s: s.performance.cross_track_rms_m,
    "overshoot of a change of 10 deg, deg": lambda s: np.degrees(s.change.overshoot_rad),
    "modulus margin": lambda s: s.loop.modulus_margin,
    "slowest pole, s": lambda s: s.loop.slowest_s,
}


def tables(runs: list[Run]) -> list[str]:
    """One table a ship."""
    lines: list[str] = []
    for ship in SHIPS:
        of_ship = [s for r in runs if r.ship == ship for s in r.steered]
        rows = []
        for name in LAWS:
            tried = [s for s in of_ship if s.law == name]
            good = [s for s in tried if s.good]
            counts = [str(len(tried)), str(sum(not s.failure for s in tried)), str(len(good))]
            settled = [s.change.settled_s for s in good]
            inside = [t for t in settled if t is not None]
            numbers = [spread([float(f(s)) for s in good]) for f in COLUMNS.values()]
            rows.append([name, *counts, *numbers, f"{spread(inside, 0)}; never: {len(settled) - len(inside)}"])
        head = [
            "law from",
            "runs",
            "law exists",
            "loop stable and course kept",
            *COLUMNS,
            "settled within 1 deg after, s",
        ]
        title = f"## {ship}, {HULLS[ship].trial_speed_m_s:g} m/s; another ship: {OTHER[ship]}"
        lines += [title, "", *result_page.table(head, rows), ""]
    return lines


def parameter_errors(runs: list[Run]) -> list[str]:
    """Table of rms errors of the two estimates, percent."""
    rows = []
    for ship in SHIPS:
        for name in (ML, FIRST):
            errors = np.array([r.percent[name] for r in runs if r.ship == ship])
            kept = errors[np.all(np.isfinite(errors), axis=1)]
            rms = np.sqrt(np.mean(kept**2, axis=0)) if kept.size else np.full(6, np.nan)
            rows.append([ship, name, f"{len(kept)} of {len(errors)}", *(f"{x:.1f}" for x in rms)])
    return result_page.table(["ship", "estimate", "runs with an estimate", *HULL_PARAMETERS], rows)


def headline(runs: list[Run]) -> str:
    """The result in two sentences, computed."""
    every = [s for r in runs for s in r.steered]
    by_key = {(s.ship, s.seed, s.law): s for s in every}

    def ratios(law: str, number: Callable[[Steered], float]) -> list[float]:
        pairs = [(s, by_key[s.ship, s.seed, TRUE]) for s in every if s.law == law and s.good]
        return [float(number(s) / number(t)) for s, t in pairs]

    said = []
    for law in (ML, OWN, FIRST, ANOTHER):
        tried, good = [s for s in every if s.law == law], [s for s in every if s.law == law and s.good]
        heading = ratios(law, COLUMNS["heading rms, deg"])
        margin = ratios(law, COLUMNS["modulus margin"])
        said.append(
            f"{law[0].upper()}{law[1:]}: {len(good)} of {len(tried)} keep the course in a stable loop; their heading "
            f"rms is {spread(heading)} times that of the law from the true parameters, their modulus margin "
            f"{spread(margin)} times"
        )
    return "**" + ". ".join(said) + "** (median, smallest and largest over all runs)."


def draw(runs: list[Run]) -> list[str]:
    """Draw one run's tracks, and heading rms and margin of every run; return the names of the files."""
    folder = result_page.RESULTS / "course_keeping"
    folder.mkdir(parents=True, exist_ok=True)
    first = next(r for r in runs if r.ship == SHIPS[0])
    shown = [(s.law, s.track) for s in first.steered if s.track is not None and s.law != OWN]
    draw_course_keeping(shown, folder / "track.png", f"{first.ship}, seed {first.seed}: law from")
    figure, axes = plt.subplots(2, len(SHIPS), figsize=(12, 6.5), layout="constrained", sharex=True, sharey="row")
    for column, ship in enumerate(SHIPS):
        for k, law in enumerate(LAWS):
            of_ship = [s for r in runs if r.ship == ship for s in r.steered if s.law == law and s.loop is not None]
            for row, name in enumerate(("heading rms, deg", "modulus margin")):
                for s, x in zip(of_ship, k + np.linspace(-0.2, 0.2, len(of_ship)), strict=True):
                    style = {"color": f"C{k}", "marker": "o" if s.good else "x", "ms": 5, "ls": ""}
                    axes[row, column].plot(x, COLUMNS[name](s), **style)
        axes[0, column].set(title=ship, yscale="log")
        axes[1, column].set_xticks(
            range(len(LAWS)), [law.replace(", ", ",\n") for law in LAWS], rotation=60, ha="right"
        )
    axes[0, 0].set_ylabel("heading rms, deg")
    axes[1, 0].set_ylabel("modulus margin")
    for panel in axes.flat:
        panel.grid(lw=0.3)
    figure.savefig(folder / "laws.png", dpi=90, metadata={"Software": None})
    plt.close(figure)
    return ["course_keeping/track.png", "course_keeping/laws.png"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=8)
    seeds = parser.parse_args().seeds
    runs = [run(ship, seed) for ship in SHIPS for seed in range(1, seeds + 1)]
    track, laws = draw(runs)
    failures = [s for r in runs for s in r.steered if s.failure]
    wind = PAPER_ENVIRONMENT.wind_force
    lines = [
        f"{seeds} runs a ship: identify from one 20-minute 20/20 zigzag, make the laws, hold a course for {LEG_S:g} s "
        f"(numbers without the first {SETTLE_S:g} s), change it by {np.degrees(CHANGE_RAD):.0f} deg and hold it again. "
        f"Wind force {wind.mean:g} m/s2 with a Gauss-Markov part of {wind.std:g}, stream "
        f"{np.hypot(PAPER_ENVIRONMENT.current_north.mean, PAPER_ENVIRONMENT.current_east.mean):.1f} m/s, noise of the "
        "instruments as in the trials, rudder with its rate and limit. All laws by the same method (LQR, psi^2 + "
        "delta^2) at the trial speed, with one stated set of noise levels unless the law says otherwise, so that they "
        "differ by their parameters alone. Poles and margin are those on the true ship. A law that steers harder has "
        "the smaller heading error and the greater rudder travel, whatever its parameters; the margin says how near it "
        "is to losing her.",
        "",
        headline(runs),
        "",
        f"![Tracks of one run.]({track})",
        "",
        f"![Heading rms and modulus margin of every run; a cross is a loop that is not stable.]({laws})",
        "",
        *tables(runs),
        "## Errors of the parameters, rms, percent of the truth",
        "",
        *parameter_errors(runs),
    ]
    if failures:
        lines += ["", "No law:", "", *(f"- {s.ship}, seed {s.seed}, {s.law}: {s.failure}" for s in failures)]
    path = result_page.write(
        "identify.course_keeping", "Course keeping by identified parameters and by wrong ones", lines
    )
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
