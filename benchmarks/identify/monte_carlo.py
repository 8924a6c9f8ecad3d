"""Coverage of the default estimator, from raw log bytes to six parameters, over many simulated trials.

Each run sails a 20-minute 20/20 zigzag in wind and stream and writes a logger's file, which is taken in and identified
as `kempf ingest` and `kempf identify` do it. Counted is what the standard errors promise: all six parameters within
three of them, 95 % intervals that cover 95 %. The file written holds no times of the clock, so that equal code writes
equal bytes.
"""

from __future__ import annotations

import argparse
import platform
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from kempf.flows.jobs.identify.identify_vessel import identify_vessel
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.nmea_log import to_nmea
from kempf.pipeline.simulate.trial import Trial, simulate_trial, zigzag_settings
from kempf.schemas.errors import KempfError
from kempf.schemas.model_spec import HULL_PARAMETERS
from kempf.warehouse.storage.store import Warehouse

#: The ships that the count is made of.
HULLS = ("mariner", "container", "tanker", "ferry")
#: Too quick for these instruments (she answers her rudder within a sample or two); run and listed, but not counted.
TOO_QUICK, TOO_QUICK_RUNS = "usv", 6
FORMATS: dict[str, Callable[[Trial], bytes]] = {"nmea.gz": to_nmea, "mcap": to_mcap, "csv.gz": to_csv}
PARAMETERS = tuple(HULL_PARAMETERS)
#: Errors after 25 iterations that the paper reports of its simulated trial, percent.
PAPER_PERCENT = dict(zip(PARAMETERS, (10, 10, 25, 20, 20, 5), strict=True))
RESULTS = Path(__file__).parents[1] / "results" / "monte_carlo.md"
LIBRARIES = ("numpy", "scipy", "numba", "polars")


@dataclass(frozen=True)
class Run:
    """One run: estimates, standard errors and truths of the six parameters, or why there are none."""

    number: int
    hull: str
    log: str
    value: tuple[float, ...] = ()
    std: tuple[float, ...] = ()
    truth: tuple[float, ...] = ()
    converged: bool = False
    failure: str = ""

    @property
    def z(self) -> np.ndarray:
        """Errors in standard errors, shape (6,)."""
        z: np.ndarray = (np.array(self.value) - np.array(self.truth)) / np.array(self.std)
        return z

    @property
    def within_three(self) -> bool:
        """All six within three standard errors; a run without estimates or standard errors is not."""
        return bool(self.value) and bool(np.all(np.abs(self.z) <= 3.0))


def run(number: int, hull: str = "") -> Run:
    """Sail, log, read, find, fit."""
    hull = hull or HULLS[number % len(HULLS)]
    log = tuple(FORMATS)[(number // len(HULLS)) % len(FORMATS)]
    settings = zigzag_settings(hull, seed=number, first_side="starboard" if number % 2 == 0 else "port")
    # the golden angle spreads the base headings over the stream's direction
    settings = replace(settings, heading_deg=(137.508 * number) % 360.0)
    trial = simulate_trial(settings)
    with TemporaryDirectory() as folder:
        warehouse, path = Warehouse(str(Path(folder) / "warehouse")), Path(folder) / f"trial.{log}"
        path.write_bytes(FORMATS[log](trial))
        try:
            ingest(warehouse, [path], hull, logger_profile(settings))
            found = identify_vessel(warehouse, hull)
        except KempfError as error:
            return Run(number, hull, log, failure=error.code)
    longest = max(found, key=lambda one: one.segment.end_utc_ns - one.segment.start_utc_ns)
    made = longest.parameter_set
    if made is None:
        return Run(number, hull, log, failure=longest.error.code if longest.error else "no set")
    return Run(
        number,
        hull,
        log,
        tuple(p.value for p in made.parameters),
        tuple(np.nan if p.std is None else p.std for p in made.parameters),
        tuple(getattr(trial.truth.parameters, name) for name in PARAMETERS),
        longest.converged,
    )


def table(runs: list[Run]) -> list[str]:
    """Lines of the table with one row a parameter."""
    good = [r for r in runs if r.value]
    z = np.array([r.z for r in good])
    relative = np.array([np.array(r.value) / np.array(r.truth) - 1.0 for r in good])
    error = np.array([np.array(r.value) - np.array(r.truth) for r in good])
    std = np.array([r.std for r in good])
    truth = np.abs(np.array([r.truth for r in good]))
    lines = [
        "| parameter | within 3 std, % | covered by the 95 % interval, % | rms error / mean std | mean z (bias / std) |"
        " rms error, % | mean std, % | the paper's error, % |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for i, name in enumerate(PARAMETERS):
        # relative to the truth, as the hulls differ by orders of magnitude
        ratio = np.sqrt(np.mean((error[:, i] / truth[:, i]) ** 2)) / np.mean(std[:, i] / truth[:, i])
        lines.append(
            f"| {name} | {100 * np.mean(np.abs(z[:, i]) <= 3.0):.1f} | {100 * np.mean(np.abs(z[:, i]) <= 1.96):.1f} "
            f"| {ratio:.2f} | {np.mean(z[:, i]):+.2f} | {100 * np.sqrt(np.mean(relative[:, i] ** 2)):.1f} "
            f"| {100 * np.mean(std[:, i] / truth[:, i]):.1f} | {PAPER_PERCENT[name]} |"
        )
    return lines


def report(runs: list[Run], quick: list[Run], command: str) -> str:
    """The result as Markdown."""
    versions = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    within = sum(r.within_three for r in runs)
    failed = [r for r in runs if r.failure]
    loose = [r for r in runs if r.value and not r.converged]
    blind = [r for r in runs if r.value and not np.all(np.isfinite(r.std))]
    lines = [
        "# Coverage of maximum likelihood, from log bytes to parameters",
        "",
        f"`{command}`; Python {platform.python_version()}, {versions}.",
        "",
        f"{len(runs)} simulated 20-minute 20/20 zigzags of {', '.join(HULLS)}; 1 Hz GNSS velocity with 0.05 m/s, 1 Hz "
        "yaw rate with 0.03 deg/s, 2 Hz rudder with 0.1 deg, 1 Hz log with 0.05 m/s, 5 Hz heading with 0.05 deg; wind "
        "force 5e-3 m/s2 plus a Gauss-Markov part of 1e-3, stream 0.3 m/s, base headings all round; logs in turn "
        f"{', '.join(FORMATS)}, read and segmented by the code under test.",
        "",
        f"**All six parameters within 3 standard errors: {within} of {len(runs)}** (wanted: 95 of 100). "
        f"No estimate: {len(failed)}; not converged: {len(loose)}; without standard errors: {len(blind)}.",
        "",
        *table(runs),
        "",
        "| of | runs | all six within 3 std | covered by the 95 % interval, % | rms z |",
        "|---|---|---|---|---|",
    ]
    groups = [(h, [r for r in runs if r.hull == h]) for h in HULLS]
    groups += [(f, [r for r in runs if r.log == f]) for f in FORMATS]
    for name, group in groups:
        z = np.array([r.z for r in group if r.value])
        if z.size:
            lines.append(
                f"| {name} | {len(group)} | {sum(r.within_three for r in group)} "
                f"| {100 * np.mean(np.abs(z) <= 1.96):.1f} | {np.sqrt(np.mean(z**2)):.2f} |"
            )
    outside = [r for r in runs if not r.within_three]
    if outside:
        lines += ["", "Runs outside:", ""]
        for r in outside:
            said = r.failure or ", ".join(f"{n} {z:+.1f}" for n, z in zip(PARAMETERS, r.z, strict=True))
            lines.append(f"- {r.number} ({r.hull}, {r.log}): {said}")
    inside = sum(r.within_three for r in quick)
    worst = ", ".join("none" if r.failure else f"{np.max(np.abs(r.z)):.1f} ({r.log})" for r in quick)
    lines += [
        "",
        f"Not counted above: {TOO_QUICK}, a boat of 3 m that answers her rudder within a sample or two of these "
        f"instruments. All six within 3 standard errors: {inside} of {len(quick)} runs; largest |z|: {worst}. How the "
        "rudder moved between its samples is not known, and the standard errors do not say so: log such a boat faster.",
    ]
    return "\n".join([*lines, ""])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args()
    wanted = [(number, "") for number in range(options.runs)]
    wanted += [(4 * number, TOO_QUICK) for number in range(TOO_QUICK_RUNS)]  # 4: every format in turn
    everything: list[Run] = []
    with ProcessPoolExecutor(options.processes, mp_context=get_context("spawn")) as pool:
        for done in as_completed([pool.submit(run, *one) for one in wanted]):
            one = done.result()
            everything.append(one)
            said = one.failure or f"largest |z| {np.max(np.abs(one.z)):.2f}{'' if one.converged else ', not converged'}"
            print(f"{len(everything)}/{len(wanted)} run {one.number} {one.hull} {one.log}: {said}", file=sys.stderr)
    everything.sort(key=lambda r: r.number)
    runs, quick = ([r for r in everything if (r.hull == TOO_QUICK) == q] for q in (False, True))
    text = report(runs, quick, f"python -m benchmarks.identify.monte_carlo --runs {options.runs}")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
