"""How long one maximum-likelihood fit takes, beside the same likelihood in statsmodels and beside EKF and regression.

Every time is that of the processor in this thread after a warm run, where nothing else is said, so that what else the
machine does counts little; ratios are formed from times measured in turn in one run. statsmodels is a development
dependency; for vessel-manoeuvring-models see benchmarks/baselines/vessel_models.py. Without them the page says so.
"""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from statistics import median
from typing import Any

import numpy as np

from benchmarks import result_page
from benchmarks.baselines import vessel_models
from benchmarks.identify.draw_estimator_speed import draw
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Series
from kempf.pipeline.estimate.likelihood import Likelihood
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings, identify
from kempf.pipeline.estimate.plain_fit import fit_plain
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.grid_run import plain_run
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.search.starts import starting_points
from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT, simulate_trial, zigzag_settings
from kempf.schemas.channels import CHANNELS
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.units import SECOND_NS

HULLS = ("mariner", "ferry", "container", "tanker")
SEEDS = (1, 2, 3)
SAMPLES = 1200
#: records on which the slow ones are measured
COMPARED = (("mariner", 1), ("mariner", 2), ("mariner", 3))
LENGTHS = tuple(300 * 2**k for k in range(8))
SEGMENTS = (1, 2, 4, 8, 16, 32, 64)
SEGMENT_SAMPLES = 300
SETTINGS = MaximumLikelihoodSettings()
TARGET_MS, TARGET_STATSMODELS, TARGET_EKF = 60.0, 50.0, 100.0
_COLUMNS = {channel.column: channel for channel in CHANNELS.values()}


@dataclass(frozen=True, eq=False)
class Sailed:
    """A record whose instants are all common, 1 Hz, without a heading measurement; l of eq. (16), the model."""

    record: Record
    arm_per_m: float
    spec: ModelSpec

    def fit(self) -> Any:
        return identify(self.record, self.spec, self.arm_per_m, SETTINGS)

    def bound(self) -> Likelihood:
        return SETTINGS.bind(self.record, self.spec, self.arm_per_m)


def rows_of(record: Record, rows: Any) -> Record:
    """The record at some of its instants."""
    n = record.time_s.size
    kept = {f.name: getattr(record, f.name) for f in fields(record)}
    taken = {k: v[rows] for k, v in kept.items() if isinstance(v, np.ndarray) and v.shape[0] == n}
    since = taken.pop("time_s") - record.time_s[rows][0]
    return replace(record, time_s=since, speed_error=record.speed_error.at(rows), **taken)


def sail(hull: str, seed: int, samples: int) -> Sailed:
    """Simulate a 20/20 zigzag, every instrument on the same instants, and keep those of the GNSS."""
    settings = zigzag_settings(hull, seed=seed, environment=PAPER_ENVIRONMENT, duration_s=float(samples))
    common = tuple(replace(i, phase_s=0.0, jitter_s=0.0) for i in settings.instruments)
    trial = simulate_trial(replace(settings, heading_deg=(137.508 * seed) % 360.0, instruments=common))
    series = {}
    for one in trial.instruments:
        for column, value in one.values.items():
            channel = _COLUMNS[column]
            held = np.unwrap(value) if channel.wrap == "circle" else value
            series[channel.name] = Series(one.measured_utc_ns, held)
    start = trial.settings.start_utc_ns + round(trial.truth.zigzags[0].start_s * SECOND_NS) - 20 * SECOND_NS
    instruments = Instruments(series, dict.fromkeys(series, "simulated"), ())
    record = make_record(instruments, start, start + (samples + 20) * SECOND_NS)
    record = rows_of(record, np.flatnonzero(np.isfinite(record.measured[:, 0]))[:samples])
    record.measured[:, 2] = np.nan
    arm = trial.truth.wind_arm_per_m
    return Sailed(record, arm, ModelSpec().with_arm(arm))


def seconds(work: Callable[[], Any], repeats: int) -> list[float]:
    """Time of the processor in this thread, after a warm run, s."""
    work()
    taken = []
    for _ in range(repeats):
        begin = time.thread_time()
        work()
        taken.append(time.thread_time() - begin)
    return taken


def started(sailed: Sailed) -> Any:
    """Theta that our own race takes for the likeliest start."""
    coarse = SETTINGS.coarse(sailed.record, sailed.spec, sailed.arm_per_m)
    return max((theta for _, theta in starting_points(sailed.record)), key=coarse.value)


def in_statsmodels(sailed: Sailed) -> tuple[float, int, float]:
    """Fit of the same likelihood by statsmodels' own L-BFGS: s, evaluations, log-likelihood."""
    from benchmarks.baselines.statsmodels_likelihood import ShipLikelihood

    start = started(sailed)
    model = ShipLikelihood(sailed.record, sailed.spec, sailed.arm_per_m, np.abs(start[:6]))
    first = model.theirs(start)
    model.loglike(first)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        begin = time.thread_time()
        # differences, which are faster here than its complex steps; no covariance, which would only add to the time
        options = {"optim_complex_step": False, "optim_score": "approx", "cov_type": "none", "disp": 0}
        # it stops at the gain of one step, relative to the mean: a tenth of what our search leaves in the sum
        limits = {"maxiter": 2000, "factr": 0.1 * SETTINGS.decrement / SAMPLES / np.finfo(float).eps, "pgtol": 1e-9}
        found = model.fit(first, method="lbfgs", **options, **limits)
        taken = time.thread_time() - begin
    return taken, int(found.mle_retvals["fcalls"]), float(found.llf)


def against_statsmodels(own: list[Sailed]) -> list[str]:
    """Lines of the page."""
    if find_spec("statsmodels") is None:
        return ["statsmodels is not installed here, so it was not measured."]
    rows, ratios = [], []
    for (hull, seed), sailed in zip(COMPARED, own, strict=True):
        taken, calls, reached = in_statsmodels(sailed)
        mine = median(seconds(sailed.fit, 7))
        gap = reached - sailed.fit().report["log_likelihood"]
        ratios.append(taken / mine)
        row = [f"{hull} {seed}", f"{1e3 * mine:.0f}", f"{taken:.2f}", str(calls), f"{gap:+.1e}"]
        rows.append([*row, f"{taken / mine:.0f}"])
    one = own[0]
    from benchmarks.baselines.statsmodels_likelihood import ShipLikelihood

    theta = started(one)
    model = ShipLikelihood(one.record, one.spec, one.arm_per_m, np.abs(theta[:6]))
    params, bound = model.theirs(theta), one.bound()
    whole = min(seconds(lambda: model.loglike(params), 15))
    filtering = min(seconds(model.ssm.loglike, 15))
    value, full = min(seconds(lambda: bound.value(theta), 30)), min(seconds(lambda: bound.full(theta), 30))
    head = ["record", "Kempf, ms", "statsmodels, s", "gradients", "log-likelihood beside ours", "times Kempf"]
    return [
        f"statsmodels {version('statsmodels')}: the same states, measurements and exact steps "
        "(benchmarks/baselines/statsmodels_likelihood.py; log-likelihoods agree: tests/estimate/test_statsmodels.py). "
        "Its own `.fit()` with L-BFGS and differences, from the start that our race takes for the likeliest, its "
        "parameters scaled by that start, no covariance; ours is the whole fit with race, gross errors and report.",
        "",
        *result_page.table(head, rows),
        "",
        f"Smallest ratio {min(ratios):.0f}, at least {TARGET_STATSMODELS:.0f} wanted: "
        f"{_met(min(ratios), TARGET_STATSMODELS)}. One log-likelihood takes statsmodels {1e3 * whole:.2f} ms, "
        f"{1e3 * filtering:.2f} of them in its compiled filter and the rest in numpy for the steps; our kernel "
        f"{1e3 * value:.2f} ms, with score and information {1e3 * full:.2f} ms.",
    ]


def against_ekf(own: list[Sailed]) -> list[str]:
    """Lines of the page."""
    if not vessel_models.importable():
        return ["The package vessel-manoeuvring-models is not importable here, so it was not measured."]
    rows, once, whole = [], [], []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from vessel_manoeuvring_models.extended_kalman_vmm import SystemMatrixes
        from vessel_manoeuvring_models.models.vmm_linear import vmm_linear

        matrices = SystemMatrixes(vmm_linear)
        for (hull, seed), sailed in zip(COMPARED, own, strict=True):
            begin = time.thread_time()
            vessel_models.run(sailed.record, matrices)
            taken = time.thread_time() - begin
            mine = median(seconds(sailed.fit, 7))
            whole.append(taken / mine)
            once.append(taken / mine / vessel_models.PASSES)
            times = [f"{1e3 * mine:.0f}", f"{taken / vessel_models.PASSES:.2f}", f"{taken:.2f}"]
            rows.append([f"{hull} {seed}", *times, f"{once[-1]:.0f}", f"{whole[-1]:.0f}"])
    try:
        number = version("vessel-manoeuvring-models")
    except PackageNotFoundError:
        number = "of unknown version"
    passes = vessel_models.PASSES
    head = ["record", "Kempf, ms", "one pass, s", f"{passes} passes, s", "one pass, times Kempf", f"{passes} passes"]
    return [
        f"vessel-manoeuvring-models {number}: its extended Kalman filter, smoother and regression on the same records, "
        f"one pass and the {passes} passes of benchmarks/baselines/vessel_models.py, every pass filters with the "
        "parameters of the one before; the symbolic preparation is not counted.",
        "",
        *result_page.table(head, rows),
        "",
        f"Smallest ratio for one pass {min(once):.0f}, at least {TARGET_EKF:.0f} wanted: "
        f"{_met(min(once), TARGET_EKF)}; for {passes} passes {min(whole):.0f}: {_met(min(whole), TARGET_EKF)}.",
    ]


def _met(ratio: float, target: float) -> str:
    return "met" if ratio >= target else "not met"


def one_fit() -> list[str]:
    """Lines of the page."""
    rows, medians = [], []
    for hull in HULLS:
        for seed in SEEDS:
            sailed = sail(hull, seed, SAMPLES)
            taken = seconds(sailed.fit, 15)
            found = sailed.fit()
            bound = sailed.bound()
            medians.append(1e3 * median(taken))
            steps = str(found.report["iterations"])
            times = [f"{1e3 * median(taken):.0f}", f"{1e3 * min(taken):.0f}"]
            free = str(int(np.count_nonzero(bound.active)))
            rows.append([f"{hull} {seed}", str(sailed.record.time_s.size), free, steps, *times, str(found.converged)])
    under = sum(m < TARGET_MS for m in medians)
    head = ["record", "samples", "free parameters", "last steps", "median, ms", "fastest, ms", "converged"]
    return [
        *result_page.table(head, rows),
        "",
        f"Median of the {len(rows)} medians {median(medians):.0f} ms, slowest {max(medians):.0f} ms; under "
        f"{TARGET_MS:.0f} ms: {under} of {len(rows)}.",
    ]


def by_samples() -> tuple[list[float], list[float]]:
    """Seconds of one evaluation with derivatives and of a whole fit, over `LENGTHS`."""
    longest = sail("mariner", 11, LENGTHS[-1])
    evaluations, fits = [], []
    for n in LENGTHS:
        part = replace(longest, record=rows_of(longest.record, slice(0, n)))
        bound, theta = part.bound(), started(part)
        evaluations.append(min(seconds(lambda b=bound, t=theta: b.full(t), max(3, 20000 // n))))  # type: ignore[misc]
        fits.append(min(seconds(part.fit, max(2, 4800 // n))))
        print(n, evaluations[-1], fits[-1], file=sys.stderr)
    return evaluations, fits


def by_segments() -> tuple[list[float], list[float], list[str]]:
    """Seconds of separate fits and of the pooled one over `SEGMENTS`; and lines on threads."""
    sailed = [sail("mariner", 100 + number, SEGMENT_SAMPLES) for number in range(SEGMENTS[-1])]
    runs = [plain_run(str(i), s.record, s.spec, s.arm_per_m, None) for i, s in enumerate(sailed)]
    separate, pooled = [], []
    for count in SEGMENTS:
        few, spec = sailed[:count], sailed[0].spec
        separate.append(min(seconds(lambda few=few: [s.fit() for s in few], 2 + 8 // count)))  # type: ignore[misc]
        if count == 1:
            pooled.append(float("nan"))
            continue
        with ThreadPoolExecutor(1) as workers:
            best = float("inf")
            for _ in range(1 + 8 // count):
                # the work is done in the worker's thread
                begin = time.process_time()
                fit_plain(runs[:count], spec, workers)
                best = min(best, time.process_time() - begin)
        pooled.append(best)
        print(count, separate[-1], pooled[-1], file=sys.stderr)
    return separate, pooled, threads(sailed[:32])


def threads(sailed: list[Sailed]) -> list[str]:
    """Fit them all on one thread and on two, by the clock, and tell what share of the work can overlap."""
    best: dict[int, tuple[float, float]] = {}
    for _ in range(8):
        for number in (1, 2):
            with ThreadPoolExecutor(number) as workers:
                begin, worked = time.perf_counter(), time.process_time()
                list(workers.map(Sailed.fit, sailed))
                taken, worked = time.perf_counter() - begin, time.process_time() - worked
            best[number] = min(best.get(number, (float("inf"), 0.0)), (taken, worked / taken))
    (single, of_one), (double, of_two) = best[1], best[2]
    compiled, whole = 0.0, 0.0
    for one in sailed:
        inside: list[float] = []
        settings = _Watched()
        settings.__dict__["inside"] = inside
        begin = time.thread_time()
        identify(one.record, one.spec, one.arm_per_m, settings)
        whole += time.thread_time() - begin
        compiled += sum(inside)
    return [
        f"{len(sailed)} separate fits by the clock, fastest of 8: one thread {single:.2f} s, two threads "
        f"{double:.2f} s, {single / double:.2f} times as fast. Of {os.cpu_count()} processors the process got "
        f"{of_one:.2f} with one thread and {of_two:.2f} with two; what it lacks to 1 and 2 went to others on the "
        f"machine or to waiting. "
        f"{100.0 * compiled / whole:.0f} % of a fit runs in the kernel, outside the interpreter's lock.",
    ]


class _Watched(MaximumLikelihoodSettings):
    """Settings whose likelihoods note the time they spend in the kernel."""

    def bind(self, record: Record, spec: ModelSpec, arm_per_m: float) -> Likelihood:
        return self._watched(super().bind(record, spec, arm_per_m))

    def coarse(self, record: Record, spec: ModelSpec, arm_per_m: float) -> Likelihood:
        return self._watched(super().coarse(record, spec, arm_per_m))

    def _watched(self, bound: Likelihood) -> Likelihood:
        noted: list[float] = self.__dict__["inside"]

        def watched(function: Callable[..., Any]) -> Callable[..., Any]:
            def call(*arguments: Any, **named: Any) -> Any:
                begin = time.thread_time()
                result = function(*arguments, **named)
                noted.append(time.thread_time() - begin)
                return result

            return call

        for name in ("full", "value", "trace"):
            setattr(bound, name, watched(getattr(bound, name)))
        return bound


def exponent(x: Sequence[float], y: Sequence[float]) -> float:
    """Slope of log y over log x, where y is known."""
    good = np.isfinite(y)
    return float(np.polyfit(np.log(np.asarray(x)[good]), np.log(np.asarray(y)[good]), 1)[0])


def growth() -> list[str]:
    """Measure, draw, and return lines of the page."""
    evaluations, fits = by_samples()
    separate, pooled, on_threads = by_segments()
    result_page.RESULTS.mkdir(exist_ok=True)
    draw(
        (LENGTHS, {"one fit": fits, "one likelihood with derivatives": evaluations}, "samples"),
        (
            SEGMENTS,
            {"separate fits": separate, "pooled, with the separate ones": pooled},
            f"segments of {SEGMENT_SAMPLES} samples",
        ),
        result_page.RESULTS / "estimator_speed.png",
    )
    samples = [
        [str(n), f"{1e3 * e:.2f}", f"{1e6 * e / n:.2f}", f"{1e3 * f:.0f}", f"{1e6 * f / n:.0f}"]
        for n, e, f in zip(LENGTHS, evaluations, fits, strict=True)
    ]
    segments = [
        [
            str(n),
            f"{1e3 * s:.0f}",
            f"{1e3 * s / n:.1f}",
            *([f"{1e3 * p:.0f}", f"{1e3 * p / n:.1f}"] if n > 1 else ["", ""]),
        ]
        for n, s, p in zip(SEGMENTS, separate, pooled, strict=True)
    ]
    return [
        "![Time over samples and over segments, both axes logarithmic.](estimator_speed.png)",
        "",
        *result_page.table(
            ["samples", "one likelihood with derivatives, ms", "us a sample", "one fit, ms", "us a sample"], samples
        ),
        "",
        f"Time goes with the samples to the power {exponent(LENGTHS, evaluations):.2f} (likelihood) and "
        f"{exponent(LENGTHS, fits):.2f} (fit: the race of the starts costs the same for any length, and the number of "
        "steps differs).",
        "",
        *result_page.table(
            ["segments", "separate fits, ms", "a segment", "pooled with the separate ones, ms", "a segment"], segments
        ),
        "",
        f"Time goes with the segments to the power {exponent(SEGMENTS, separate):.2f} (separate) and "
        f"{exponent(SEGMENTS, pooled):.2f} (pooled).",
        "",
        *on_threads,
    ]


def main() -> None:
    own = [sail(hull, seed, SAMPLES) for hull, seed in COMPARED]
    lines = [
        f"Simulated 20/20 zigzags of {SAMPLES} s under the paper's wind and stream, y_v and y_r at 1 Hz at common "
        "instants, no heading measurement; wind force and a current fixed in the earth. Times are those of the "
        "processor in one thread, warm; the machine was shared.",
        "",
        "## One fit",
        "",
        *one_fit(),
        "",
        "## Beside statsmodels",
        "",
        *against_statsmodels(own),
        "",
        "## Beside EKF, smoother and regression",
        "",
        *against_ekf(own),
        "",
        "## Growth",
        "",
        *growth(),
    ]
    path = result_page.write("identify.estimator_speed", "Speed of the estimator", lines)
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
