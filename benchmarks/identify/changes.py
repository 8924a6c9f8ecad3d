"""Does the change detector cry wolf, and what does it see? Histories with and without change, counted.

The covariances are those of zigzags that were simulated and identified here. Every world without change says in what
its trials are worse than their covariances. The rival is the scan of the whole six-vector by its likelihood ratio, with
the covariances as they are or times one scale factor, calibrated by simulation as well.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.stats import beta

from benchmarks.identify.draw_changes import draw_changes
from benchmarks.result_page import RESULTS, table, write
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings, identify
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.history.changes import find_changes
from kempf.pipeline.history.scan import judge, stretch
from kempf.pipeline.history.sets import ParameterHistory, occasions
from kempf.pipeline.history.settings import ChangeSettings
from kempf.pipeline.simulate.trial import Trial, simulate_trial, zigzag_settings
from kempf.schemas.channels import CHANNELS
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec
from kempf.schemas.units import SECOND_NS

NAMES = tuple(HULL_PARAMETERS)
SETTINGS = ChangeSettings()
MONTH_NS = 30 * 86400 * SECOND_NS
LENGTHS = (4, 5, 7, 10, 20, 40)
#: A load moves all parameters together; how much of each, relative.
LOAD = np.array([1.0, -0.5, 1.5, 1.0, 0.5, -0.7])
#: Zigzags that the covariances come from: psi0 = delta0, deg, and duration, s.
KINDS = ((20.0, 1200.0), (20.0, 600.0), (10.0, 600.0), (10.0, 900.0))
CHANNEL_OF = {channel.column: channel for channel in CHANNELS.values()}


def covariances(hull: str, count: int) -> Float:
    """Relative covariances of so many identified zigzags, shape (count, 6, 6)."""
    found = []
    for seed in range(count):
        angle, duration = KINDS[seed % len(KINDS)]
        settings = zigzag_settings(
            hull,
            seed=1000 + seed,
            heading_deg=angle,
            rudder_deg=angle,
            duration_s=duration,
            first_side="starboard" if seed % 2 else "port",
        )
        trial = simulate_trial(replace(settings, heading_deg=(137.508 * seed) % 360.0))
        zigzag, start = trial.truth.zigzags[0], trial.settings.start_utc_ns
        bounds = (start + round((zigzag.start_s - 20.0) * SECOND_NS), start + round(zigzag.end_s * SECOND_NS))
        record = make_record(instruments_of(trial), *bounds)
        fit = identify(record, ModelSpec(), trial.truth.wind_arm_per_m, MaximumLikelihoodSettings())
        if fit.converged:
            truth = np.array([getattr(trial.truth.parameters, name) for name in NAMES])
            found.append(fit.covariance[:6, :6] / np.outer(truth, truth))
    return np.array(found)


def instruments_of(trial: Trial) -> Instruments:
    series = {}
    for record in trial.instruments:
        for column, value in record.values.items():
            channel = CHANNEL_OF[column]
            held = np.unwrap(value) if channel.wrap == "circle" else value
            series[channel.name] = Series(record.measured_utc_ns, held)
    return Instruments(series, dict.fromkeys(series, "simulated"), ())


Spoil = Callable[[Float, np.random.Generator], Float]


def _some_worse(e: Float, random: np.random.Generator) -> Float:
    return e * np.where(random.random(len(e)) < 0.2, 2.0, 1.0)[:, None]


def _tails(e: Float, random: np.random.Generator) -> Float:
    return e * np.sqrt(5.0 / random.chisquare(5.0, len(e)))[:, None]


#: What is wrong with the covariances, by its description.
WORLDS: dict[str, Spoil] = {
    "covariances true": lambda e, _: e,
    "standard errors stated 1.3 times too small": lambda e, _: 1.3 * e,
    "one set in five has standard errors half the truth": _some_worse,
    "errors with the tails of Student's t, 5 degrees of freedom": _tails,
    "every parameter scatters by 1 % between trials": lambda e, r: e + 0.01 * r.standard_normal(e.shape),
    "every parameter scatters by 3 % between trials": lambda e, r: e + 0.03 * r.standard_normal(e.shape),
    "load moves all parameters together by 3 %": lambda e, r: e + 0.03 * r.standard_normal((len(e), 1)) * LOAD,
    "damping scatters by 6 %, rudder by 0.5 %": lambda e, r: (
        e + r.standard_normal(e.shape) * np.array([0.06, 0.03, 0.06, 0.06, 0.005, 0.005])
    ),
}


def history(
    pool: Float, n: int, random: np.random.Generator, spoil: Spoil, shift: Float | None = None
) -> ParameterHistory:
    """A history of n months, values relative to the truth 1; ``shift`` of shape (n, 6) is the change."""
    S = pool[random.integers(0, len(pool), n)]
    e = np.einsum("iab,ib->ia", np.linalg.cholesky(S), random.standard_normal((n, 6)))
    value = 1.0 + spoil(e, random) + (0.0 if shift is None else shift)
    return ParameterHistory(NAMES, ("1",) * 6, MONTH_NS * np.arange(n), value, S)


def alarmed(one: ParameterHistory, settings: ChangeSettings = SETTINGS) -> bool:
    merged = occasions(one, settings.occasion_s)
    return judge(stretch(merged, settings), settings.level).p_value <= settings.level


def rivals(one: ParameterHistory, draws: int = 199) -> tuple[bool, bool]:
    """Whether the likelihood ratio of the whole vector alarms: covariances as they are, and times a scale factor."""
    n, p = one.value.shape
    J = np.linalg.inv(one.covariance)
    A = np.cumsum(J, axis=0)
    inner = range(1, n - 2)
    noise = np.random.default_rng(7).standard_normal((draws, n, p))
    simulated = np.einsum("iab,sib->sia", np.linalg.cholesky(one.covariance), noise)
    y = np.concatenate([(one.value - 1.0)[None], simulated])
    h = np.einsum("iab,sib->sia", J, y)
    b = np.cumsum(h, axis=1)
    mean = np.einsum("ab,sb->sa", np.linalg.inv(A[-1]), b[:, -1])
    left = b[:, 1 : n - 2] - np.einsum("kab,sb->ska", A[1 : n - 2], mean)
    middle = np.array([np.linalg.inv(A[k]) + np.linalg.inv(A[-1] - A[k]) for k in inner])
    ratio = np.einsum("ska,kab,skb->sk", left, middle, left).max(axis=1)
    total = np.einsum("sia,iab,sib->s", y - mean[:, None], J, y - mean[:, None])
    scaled = ratio / (total - ratio)
    as_stated, with_scale = ((1 + np.sum(x[1:] >= x[0])) / (draws + 1) <= SETTINGS.level for x in (ratio, scaled))
    return bool(as_stated), bool(with_scale)


@dataclass(frozen=True)
class Share:
    """k of n, with Clopper and Pearson's 95 % interval."""

    k: int
    n: int

    @property
    def percent(self) -> float:
        return 100.0 * self.k / self.n

    @property
    def interval(self) -> tuple[float, float]:
        low = beta.ppf(0.025, self.k, self.n - self.k + 1) if self.k else 0.0
        high = beta.ppf(0.975, self.k + 1, self.n - self.k) if self.k < self.n else 1.0
        return 100.0 * float(low), 100.0 * float(high)

    def __str__(self) -> str:
        low, high = self.interval
        return f"{self.percent:.1f} ({low:.1f} to {high:.1f})"


def false_alarms(pool: Float, runs: int) -> dict[str, dict[int, Share]]:
    counted: dict[str, dict[int, Share]] = {}
    for w, (name, spoil) in enumerate(WORLDS.items()):
        counted[name] = {}
        for n in LENGTHS:
            random = np.random.default_rng([1, w, n])
            counted[name][n] = Share(sum(alarmed(history(pool, n, random, spoil)) for _ in range(runs)), runs)
            print(name, n, counted[name][n], file=sys.stderr, flush=True)
    return counted


def rival_alarms(pool: Float, runs: int, n: int = 20) -> dict[str, tuple[Share, Share]]:
    counted = {}
    for w, (name, spoil) in enumerate(WORLDS.items()):
        random = np.random.default_rng([2, w, n])
        said = [rivals(history(pool, n, random, spoil)) for _ in range(runs)]
        counted[name] = (Share(sum(a for a, _ in said), runs), Share(sum(b for _, b in said), runs))
    return counted


ONE_PERCENT = WORLDS["every parameter scatters by 1 % between trials"]
AXES = {
    "step in b2": np.array([0, 0, 0, 0, 0, 1.0]),
    "step in b1 and b2 (rudder)": np.array([0, 0, 0, 0, 1.0, 1.0]),
    "step in a22": np.array([0, 0, 0, 1.0, 0, 0]),
    "drift of all damping (fouling)": np.array([1.0, 0, 0, 1.0, 0, 0]),
}
SIZES = (0.01, 0.02, 0.03, 0.04, 0.06, 0.08)


def ramp(n: int, name: str) -> Float:
    return np.linspace(0.0, 1.0, n) if name.startswith("drift") else (np.arange(n) >= n // 2).astype(float)


def powers(pool: Float, runs: int) -> dict[tuple[str, int], list[Share]]:
    found = {}
    for a, (name, axis) in enumerate(AXES.items()):
        for n in (6, 10, 20):
            curve = []
            for size in SIZES:
                random = np.random.default_rng([3, a, n])
                shift = size * np.outer(ramp(n, name), axis)
                curve.append(
                    Share(sum(alarmed(history(pool, n, random, ONE_PERCENT, shift)) for _ in range(runs)), runs)
                )
            found[name, n] = curve
            print(name, n, *curve, file=sys.stderr, flush=True)
    return found


def looks(pool: Float, runs: int, size: float, change_at: int, last: int) -> list[int]:
    """The lengths at which a history that is looked at after every new set is first reported; 0 for never."""
    first = []
    for run in range(runs):
        random = np.random.default_rng([4, run, change_at])
        shift = size * np.outer(np.arange(last) >= change_at, AXES["step in b2"])
        whole = history(pool, last, random, ONE_PERCENT, shift)
        begin = SETTINGS.fewest if size == 0 else change_at + 1
        seen = (n for n in range(begin, last + 1) if alarmed(shortened(whole, n)))
        first.append(next(seen, 0))
    return first


def shortened(h: ParameterHistory, n: int) -> ParameterHistory:
    return ParameterHistory(h.names, h.units, h.time_utc_ns[:n], h.value[:n], h.covariance[:n])


@dataclass(frozen=True)
class Accuracy:
    """Of changes found: right form, time inside its interval, all six intervals cover, parameters named."""

    found: Share
    form: Share
    time: Share
    all_cover: Share
    named_wrongly: Share
    extra: Share


def accuracy(pool: Float, runs: int, name: str, size: float, n: int = 20) -> Accuracy:
    shift = size * np.outer(ramp(n, name), AXES[name])
    drift = name.startswith("drift")
    truth = size * AXES[name] * (365.25 / 30.0 / (n - 1) if drift else 1.0)
    tally = np.zeros(6, dtype=int)
    for run in range(runs):
        one = history(pool, n, np.random.default_rng([5, run, int(1e4 * size)]), ONE_PERCENT, shift)
        said = find_changes(one, SETTINGS)
        right = [c for c in said.changes if c.kind == ("drift" if drift else "step")]
        tally[0] += bool(said.changes)
        tally[5] += len(said.changes) > 1
        if len(said.changes) == 1 and right:
            c = right[0]
            tally[1] += 1
            low, high = c.interval_utc_ns
            tally[2] += low <= (n // 2 - 1) * MONTH_NS and high >= (n // 2) * MONTH_NS
            tally[3] += bool(np.all(np.abs(c.change - truth) <= c.width * c.std))
            tally[4] += bool(np.any(c.moved & (truth == 0)))
    found = int(max(tally[1], 1))
    return Accuracy(
        Share(int(tally[0]), runs),
        Share(int(tally[1]), int(max(tally[0], 1))),
        *(Share(int(tally[i]), found) for i in (2, 3, 4)),
        Share(int(tally[5]), runs),
    )


def up_and_back(pool: Float, runs: int, size: float) -> tuple[Share, Share]:
    """A load taken on and discharged, 24 sets: exactly two steps reported, and both times in their intervals."""
    sets = np.arange(24)
    shift = size * np.outer((sets >= 8) & (sets < 16), AXES["step in b2"])
    both = inside = 0
    for run in range(runs):
        said = find_changes(history(pool, 24, np.random.default_rng([8, run]), ONE_PERCENT, shift), SETTINGS)
        if [c.kind for c in said.changes] == ["step", "step"]:
            both += 1
            spans = zip(said.changes, (8, 16), strict=True)
            inside += all(
                c.interval_utc_ns[0] <= (k - 1) * MONTH_NS and c.interval_utc_ns[1] >= k * MONTH_NS for c, k in spans
            )
    return Share(both, runs), Share(inside, max(both, 1))


def same_days(pool: Float, runs: int, days: int = 10) -> tuple[Share, Share]:
    """Two trials a day that share the day's load: alarms with a day as one occasion, and with each set as one."""
    counts = [0, 0]
    alone = replace(SETTINGS, occasion_s=0.0)
    for run in range(runs):
        random = np.random.default_rng([6, run])
        day = np.repeat(0.03 * random.standard_normal((days, 1)) * LOAD, 2, axis=0)
        one = history(pool, 2 * days, random, ONE_PERCENT, day)
        time = np.repeat(MONTH_NS * np.arange(days), 2) + np.tile([0, 3600 * SECOND_NS], days)
        one = replace(one, time_utc_ns=time)
        counts[0] += alarmed(one)
        counts[1] += alarmed(one, alone)
    return Share(counts[0], runs), Share(counts[1], runs)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=500, help="histories a world and length")
    parser.add_argument("--keep", help="file that keeps the identified covariances between runs")
    options = parser.parse_args()
    runs, few = options.runs, max(options.runs // 5, 10)
    pool = kept(options.keep)
    alarms = false_alarms(pool, runs)
    rival = rival_alarms(pool, runs)
    curves = powers(pool, few)
    quiet, late = looks(pool, few, 0.0, 0, 24), looks(pool, few, 0.04, 10, 22)
    stated = {key: accuracy(pool, few, *key) for key in (("step in b2", 0.04), ("step in a22", 0.06))}
    stated["drift of all damping (fouling)", 0.1] = accuracy(pool, few, "drift of all damping (fouling)", 0.1)
    back, days = up_and_back(pool, few, 0.06), same_days(pool, runs)
    draw_changes(alarms, rival, curves, SIZES, SETTINGS, RESULTS / "changes.png")
    write(
        "identify.changes",
        "Changes of the ship: false alarms and power",
        page(pool, alarms, rival, curves, quiet, late, stated, back, days),
        options="" if runs == 500 else f"--runs {runs}",
    )


def kept(path: str | None) -> Float:
    if path and Path(path).exists():
        found: Float = np.load(path)
        return found
    found = np.concatenate([covariances(hull, 12) for hull in ("mariner", "ferry")])
    if path:
        np.save(path, found)
    return found


def page(
    pool: Float,
    alarms: dict[str, dict[int, Share]],
    rival: dict[str, tuple[Share, Share]],
    curves: dict[tuple[str, int], list[Share]],
    quiet: list[int],
    late: list[int],
    stated: dict[tuple[str, float], Accuracy],
    back: tuple[Share, Share],
    days: tuple[Share, Share],
) -> list[str]:
    everything = [share for row in alarms.values() for share in row.values()]
    total = Share(sum(s.k for s in everything), sum(s.n for s in everything))
    true = alarms["covariances true"].values()
    clean = Share(sum(s.k for s in true), sum(s.n for s in true))
    worst = max(everything, key=lambda s: s.percent)
    above = [s for s in everything if s.interval[0] > 100 * SETTINGS.level]
    std = 100 * np.sqrt(np.mean(np.einsum("ijj->ij", pool), axis=0))
    axes = 100 * np.sqrt(np.linalg.eigvalsh(np.mean(pool, axis=0)))
    seen = [n for n in late if n]
    lines = [
        f"Histories of 4 to 40 sets a month apart, {len(pool)} covariances of identified zigzags (mariner and ferry; "
        "20/20 of 20 and 10 min, 10/10 of 10 and 15 min), drawn at random. Their standard errors are "
        + ", ".join(f"{name} {s:.1f}" for name, s in zip(NAMES, std, strict=True))
        + f" %, but {axes[0]:.2f} % along the best and {axes[-1]:.1f} % along the worst combination: no trial "
        "repeats as well as the best combination claims, so a detector that believes whole covariances cries wolf.",
        "",
        f"**Reported though nothing changed, wanted at most {100 * SETTINGS.level:g} %: {clean} % of {clean.n} "
        f"histories whose covariances are true, {total} % of all {total.n}.** Worst cell {worst} %; cells whose 95 % "
        f"interval lies above {100 * SETTINGS.level:g} %: {len(above)} of {len(everything)}. In brackets: Clopper and "
        "Pearson's 95 % intervals.",
        "",
        "![False alarms and power](changes.png)",
        "",
        "## False alarms, %",
        "",
        *table(
            ["no change, and", *(f"{n} sets" for n in LENGTHS)], [[w, *map(str, r.values())] for w, r in alarms.items()]
        ),
        "",
        "## The rival: likelihood ratio of the whole six-vector, 20 sets, false alarms, %",
        "",
        *table(
            ["no change, and", "covariances as they are", "times one scale factor", "this detector"],
            [[w, str(a), str(b), str(alarms[w][20])] for w, (a, b) in rival.items()],
        ),
        "",
        "## Power, % of histories reported",
        "",
        "Every parameter scatters by 1 % between trials; a step comes midway, a drift is given by what it adds up to.",
        "",
        *table(
            ["change", "sets", *(f"{100 * s:g} %" for s in SIZES)],
            [[name, str(n), *(f"{s.percent:.0f}" for s in curve)] for (name, n), curve in curves.items()],
        ),
        "",
        "## What is said of the changes found, 20 sets",
        "",
        *table(
            [
                "change",
                "reported, %",
                "as one, and as what it is, % of those",
                "time interval holds the time, %",
                "all six intervals hold the truth, %",
                "names a parameter that did not change, %",
                "more than one change reported, %",
            ],
            [
                [
                    f"{name}, {100 * size:g} %",
                    *map(str, (a.found, a.form, "-" if "drift" in name else a.time)),
                    str(a.all_cover),
                    str(a.named_wrongly),
                    str(a.extra),
                ]
                for (name, size), a in stated.items()
            ],
        ),
        "",
        f"b2 up by 6 % after 8 of 24 sets and back after 16: two steps reported in {back[0]} % of {back[0].n} "
        f"histories, both times inside their intervals in {back[1]} % of those.",
        "",
        "## Looking again after every new set",
        "",
        f"Nothing changes, and the history is tested anew at every length from {SETTINGS.fewest} to 24 sets: "
        f"{Share(sum(n > 0 for n in quiet), len(quiet))} % of {len(quiet)} histories are reported at least once. The "
        f"{100 * SETTINGS.level:g} % hold for one look.",
        "",
        f"A step of 4 % in b2 after 10 sets, tested anew after every further set: reported in {len(seen)} of "
        f"{len(late)} histories by the 12th; median delay {np.median(seen) - 10 if seen else float('nan'):.0f} sets, "
        f"90 % within {np.quantile(seen, 0.9) - 10 if seen else float('nan'):.0f}. "
        f"At least {SETTINGS.smallest_side} are needed.",
        "",
        "## Trials of one day",
        "",
        "Two trials a day for ten days, nothing changes, and both of a day share a load that moves all parameters by "
        f"3 %: false alarms {days[0]} % with a day as one occasion (the default), {days[1]} % with every set as its "
        "own.",
    ]
    return lines


if __name__ == "__main__":
    main()
