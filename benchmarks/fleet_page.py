"""The pages of `fleet`: the results page, its picture, and the figures in docs/scale.md, from one file of figures."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import result_page
from benchmarks.fleet_logs import DURATION_S

FIGURES = result_page.RESULTS / "fleet.json"
SCALE = Path(__file__).parents[1] / "docs" / "scale.md"
#: The fleet that docs/scale.md is about, and the time that a night has for it.
LARGE, NIGHT_H = 10_000, 8.0

Figures = dict[str, Any]


def write(figures: Figures) -> Path:
    """Write the results page, its picture and the figures of docs/scale.md."""
    draw(figures, result_page.RESULTS / "fleet.png")
    SCALE.write_text(with_figures(SCALE.read_text(encoding="utf-8"), figures), encoding="utf-8")
    options = f"--vessels {figures['vessels']} --logs {figures['logs']}"
    return result_page.write("fleet", "A fleet reprocessed", lines(figures), options=options)


def lines(figures: Figures) -> list[str]:
    """Lines of the results page."""
    whole, again, one = figures["whole"], figures["again"], figures["one"]
    pairs = figures["prefect_pairs_s"]
    share = 1.0 - sum(plain for _, plain in pairs) / sum(engine for engine, _ in pairs)
    workers = figures["dask_s"]["1"] / figures["dask_s"]["2"]
    rows = [
        ["reprocess all of them, every log read and identified anew", f"{whole['wall_s']:.0f} s", ""],
        ["Prefect's share of the threads' time, at most", f"{100 * whole['engine_share']:.1f} %", "5 %"],
        [f"the same against plain threads, {figures['subset']} vessels twice", f"{100 * share:.1f} %", "5 %"],
        ["a second run, nothing changed, of the first", f"{100 * again['wall_s'] / whole['wall_s']:.2f} %", "2 %"],
        ["one log more: vessels looked at", f"{one['changed']}", "1"],
        ["one log more, time of the first", f"{100 * one['wall_s'] / whole['wall_s']:.2f} %", ""],
        [f"two Dask workers over one, {figures['subset']} vessels", f"{workers:.2f}", "1.6"],
        ["a vessel in the largest fleet over one in the smallest", f"{growth(figures):.2f}", "1 (linear)"],
    ]
    return [
        f"{figures['vessels']} vessels, {figures['logs']} simulated logs of {DURATION_S:.0f} s each with a zigzag; "
        f"{figures['cores']} cores, a warehouse in a folder, a Prefect server on the same machine. "
        f"{whole['sets']} parameter sets, {whole['reread']} logs read anew, {whole['batches']} batches.",
        "",
        *result_page.table(["figure", "measured", "wanted"], rows),
        "",
        "Each Dask worker is a process that may use one core. Prefect's share counts all time that a thread was not "
        "inside a batch: also waiting for the others at the end.",
        "",
        "## Cost against the size of the fleet",
        "",
        "The fleet grows; at each size the new vessels are taken in and identified, then a run finds nothing to do.",
        "",
        *result_page.table(
            [
                "vessels",
                "new",
                "taking in, s a vessel",
                "first run, s a vessel",
                "a run for nothing, s",
                "of it finding out, s",
            ],
            [
                [
                    f"{step['vessels']}",
                    f"{step['new']}",
                    f"{step['take_in_s'] / step['new']:.2f}",
                    f"{step['first']['wall_s'] / step['new']:.2f}",
                    f"{step['again']['wall_s']:.1f}",
                    f"{step['again']['plan_s']:.2f}",
                ]
                for step in figures["steps"]
            ],
        ),
        "",
        "![Seconds against vessels](fleet.png)",
        "",
        "## Commits",
        "",
        *result_page.table(
            ["table", "commits a vessel"],
            [[name, f"{n / whole['vessels']:.2f}"] for name, n in sorted(whole["commits"].items())],
        ),
        "",
        *result_page.table(
            ["writers at once", "commits a second to one table"],
            [[n, f"{rate:.0f}"] for n, rate in figures["commits_a_second"].items()],
        ),
    ]


def growth(figures: Figures) -> float:
    """Return what a vessel costs in the largest fleet over what she costs in the smallest."""
    first, last = figures["steps"][0], figures["steps"][-1]
    return float((last["first"]["wall_s"] / last["new"]) / (first["first"]["wall_s"] / first["new"]))


def scale(figures: Figures) -> list[str]:
    """Return the table of docs/scale.md: what `LARGE` vessels cost, extrapolated from the figures measured."""
    whole, again = figures["whole"], figures["again"]
    n = whole["vessels"]
    core_s = figures["cores"] * whole["wall_s"] / n
    busiest, commits = max(whole["commits"].items(), key=lambda item: (item[1], item[0]))
    rate = max(figures["commits_a_second"].values())
    commit_s = commits / n / rate
    sizes = np.array([step["vessels"] for step in figures["steps"]], dtype=float)
    slope, at_none = np.polyfit(sizes, [step["again"]["wall_s"] for step in figures["steps"]], 1)
    slope = max(float(slope), 0.0)
    nothing = max(at_none, 0.0) + slope * LARGE
    cores_a_night = core_s * LARGE / (3600.0 * NIGHT_H)
    raw, tables = figures["bytes"].get("raw", 0), sum(v for k, v in figures["bytes"].items() if k != "raw")
    first_full = core_s / commit_s
    rows = [
        ["everything again (new code), core hours", f"{core_s * LARGE / 3600.0:.1f}"],
        [f"cores for that in {NIGHT_H:.0f} hours", f"{np.ceil(cores_a_night):.0f}"],
        [f"commits to the busiest table, {busiest}", f"{commits / n * LARGE:.0f}"],
        [f"hours for these at {rate:.0f} a second, however many cores", f"{commit_s * LARGE / 3600.0:.2f}"],
        ["cores from which commits to one table, not cores, are the limit", f"{first_full:.0f}"],
        ["one vessel in a hundred changed, core hours", f"{core_s * LARGE / 100 / 3600.0:.2f}"],
        ["nothing changed, seconds", f"{nothing:.0f}"],
        ["raw logs, GB (logs as short as these)", f"{raw / n * LARGE / 1e9:.1f}"],
        ["tables, GB, after each log was read about twice", f"{tables / n * LARGE / 1e9:.1f}"],
    ]
    verdict = (
        f"**First full: {'the commits to one table' if first_full < cores_a_night else 'the cores'}.** A vessel takes "
        f"{core_s:.1f} core seconds and {commits / n:.1f} commits to the table {busiest}. Commits to one table come "
        f"one after another, {rate:.0f} a second here: beyond {first_full:.0f} cores more machines do not help. "
        f"{LARGE} vessels in {NIGHT_H:.0f} hours want {np.ceil(cores_a_night):.0f}. "
        f"A run that finds nothing to do was {again['wall_s']:.1f} s for {n} vessels and grows by "
        f"{1000.0 * slope:.1f} ms a vessel."
    )
    return [
        verdict,
        "",
        *result_page.table([f"{LARGE} vessels, {figures['logs']} logs each", "computed from the figures"], rows),
    ]


_BEGIN, _END = "<!-- computed by python -m benchmarks.fleet -->", "<!-- to here -->"


def with_figures(text: str, figures: Figures) -> str:
    """Return docs/scale.md with its computed part made anew."""
    block = "\n".join([_BEGIN, "", *scale(figures), "", _END])
    found, n = re.subn(f"{re.escape(_BEGIN)}.*?{re.escape(_END)}", lambda _: block, text, flags=re.DOTALL)
    assert n == 1, "docs/scale.md has one computed part"
    return found


def draw(figures: Figures, path: Path) -> None:
    """Draw the cost of a first run and of a run for nothing against the size of the fleet."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    sizes = [step["vessels"] for step in figures["steps"]]
    each = [step["first"]["wall_s"] / step["new"] for step in figures["steps"]]
    nothing = [step["again"]["wall_s"] for step in figures["steps"]]
    figure, axes = plt.subplots(1, 2, figsize=(8.0, 3.0), layout="constrained")
    for one, values, title in zip(
        axes, (each, nothing), ("first run, s a vessel", "a run for nothing, s"), strict=True
    ):
        one.plot(sizes, values, "o-", color="black")
        one.set(xlabel="vessels", title=title, ylim=(0.0, None), xlim=(0.0, None))
    figure.savefig(path, dpi=120, metadata={"Software": None})
    plt.close(figure)
