"""The pages of `fleet`: the results page, its picture, and the figures in docs/scale.md, from one file of figures."""

from __future__ import annotations

from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from benchmarks import result_page
from benchmarks.fleet import fleet_scale
from benchmarks.fleet.fleet_figures import Figures
from benchmarks.fleet.fleet_logs import DURATION_S

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def write(figures: Figures) -> Path:
    """Write the results page, its picture and the figures of docs/scale.md."""
    draw(figures, result_page.RESULTS / "fleet.png")
    scale = fleet_scale.SCALE
    scale.write_text(fleet_scale.with_figures(scale.read_text(encoding="utf-8"), figures), encoding="utf-8")
    sizes = " ".join(f"{size['vessels']}" for size in figures["commits"]["sizes"])
    options = f"--vessels {figures['vessels']} --logs {figures['logs']} --commit-vessels {sizes}"
    return result_page.write("fleet.fleet", "A fleet reprocessed", lines(figures), options=options)


def lines(figures: Figures) -> list[str]:
    """Lines of the results page."""
    whole, again, one = figures["whole"], figures["again"], figures["one"]
    beside = f"{figures['subset']} vessels, {len(figures['pairs'])} pairs"
    workers = figures["dask_s"]["1"] / figures["dask_s"]["2"]
    rows = [
        ["reprocess all of them, every log read and identified anew", f"{whole['wall_s']:.0f} s", ""],
        ["Prefect's share of the threads' time, at most", f"{100 * whole['engine_share']:.1f} %", "5 %"],
        [f"the same against plain threads, time of the processor, {beside}", against_threads(figures, "cpu_s"), "5 %"],
        [f"the same on the clock, {beside}", against_threads(figures, "wall_s"), "5 %"],
        ["a second run, nothing changed, of the first", f"{100 * again['wall_s'] / whole['wall_s']:.2f} %", "2 %"],
        ["one log more: vessels looked at", f"{one['changed']}", "1"],
        ["one log more, time of the first", f"{100 * one['wall_s'] / whole['wall_s']:.2f} %", ""],
        [f"two Dask workers over one, {figures['subset']} of {figures['dask_of']} vessels", f"{workers:.2f}", "1.6"],
        *_threads_over_workers(figures),
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
        "inside a batch: also waiting for the others at the end. Beside plain threads that do the same batches, in "
        "turns, each figure is the median of the pairs and, in brackets, the least and the greatest of them: a share "
        "smaller than that spread cannot be distinguished from noise. Time of the processor is that of the process "
        "that runs the flow; the server's is not in it, but it is on the clock.",
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
            ["table", "commits a vessel", "a batch"],
            [
                [name, f"{n / whole['vessels']:.2f}", f"{n / whole['batches']:.2f}"]
                for name, n in sorted(whole["commits"].items())
            ],
        ),
        "",
        *commits(figures),
    ]


def _threads_over_workers(figures: Figures) -> list[list[str]]:
    if figures["dask_of"] != figures["vessels"]:  # not of one run
        return []
    threads = median(pair["engine"]["wall_s"] for pair in figures["pairs"])
    return [
        [
            f"threads of one process over two Dask workers, {figures['subset']} vessels, on the clock",
            f"{threads / figures['dask_s']['2']:.2f}",
            "",
        ]
    ]


def commits(figures: Figures) -> list[str]:
    """Lines about what a commit costs."""
    stated, sizes = figures["commits"], figures["commits"]["sizes"]
    writers = sorted({n for size in sizes for n in size["writers"]}, key=int)
    shared = f"{stated['together']} vessels"
    return [
        f"A commit to the table {stated['table']} by the number of vessels in it, one set and one file each, which is "
        f"the least that a table with a folder a vessel has: medians of {stated['times']}. A commit is planned over "
        "all files of its table.",
        "",
        *result_page.table(
            [
                "vessels",
                "files",
                "reading one, ms",
                *(f"{what}, ms {how}" for what in ("a commit of one vessel", f"of {shared}") for how in _HOW.values()),
            ],
            [
                [
                    f"{size['vessels']}",
                    f"{size['files']}",
                    f"{1e3 * size['read']['wall_s']:.0f}",
                    *(f"{1e3 * size[what][how]:.0f}" for what in ("one", "together") for how in _HOW),
                ]
                for size in sizes
            ],
        ),
        "",
        f"Writers at once, in threads of one process, each commit of {shared}, no vessel of two writers, "
        f"{stated['shared']} commits in all:",
        "",
        *result_page.table(
            ["vessels", *(f"{n} writer{'s' if n != '1' else ''}, {what}" for n in writers for what in _AT_ONCE)],
            [
                [
                    f"{size['vessels']}",
                    *(
                        f"{size['writers'][n][k]:.2g}" if n in size["writers"] else ""
                        for n in writers
                        for k in _AT_ONCE.values()
                    ),
                ]
                for size in sizes
            ],
        ),
    ]


_AT_ONCE = {"commits a second": "a_second", "s of the processor each": "cpu_s"}
_HOW = {"wall_s": "on the clock", "cpu_s": "of the processor"}


def against_threads(figures: Figures, what: str) -> str:
    """Return how much more the engine took than plain threads, of its own: the median of the pairs and the spread."""
    shares = [100.0 * (1.0 - pair["plain"][what] / pair["engine"][what]) for pair in figures["pairs"]]
    return f"{median(shares):.1f} % ({min(shares):.1f} to {max(shares):.1f})"


def growth(figures: Figures) -> float:
    """Return what a vessel costs in the largest fleet over what she costs in the smallest."""
    first, last = figures["steps"][0], figures["steps"][-1]
    return float((last["first"]["wall_s"] / last["new"]) / (first["first"]["wall_s"] / first["new"]))


def draw(figures: Figures, path: Path) -> None:
    """Draw the cost of a first run, of a run for nothing and of a commit against the size of the fleet."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    sizes = [step["vessels"] for step in figures["steps"]]
    each = [step["first"]["wall_s"] / step["new"] for step in figures["steps"]]
    nothing = [step["again"]["wall_s"] for step in figures["steps"]]
    figure, axes = plt.subplots(1, 3, figsize=(11.0, 3.2), layout="constrained")
    for one, values, title in zip(
        axes[:2], (each, nothing), ("first run, s a vessel", "a run for nothing, s"), strict=True
    ):
        one.plot(sizes, values, "o-", color="black")
        one.set(xlabel="vessels", title=title, ylim=(0.0, 1.1 * max(values)), xlim=(0.0, 1.05 * max(sizes)))
    _draw_commits(figures, axes[2])
    figure.savefig(path, dpi=120, metadata={"Software": None})
    plt.close(figure)


def _draw_commits(figures: Figures, axes: Axes) -> None:
    stated = figures["commits"]
    vessels = [size["vessels"] for size in stated["sizes"]]
    for what, name, mark in (("one", "of one vessel", "o-"), ("together", f"of {stated['together']} vessels", "s--")):
        axes.loglog(
            vessels, [size[what]["cpu_s"] for size in stated["sizes"]], mark, color="black", mfc="white", label=name
        )
    axes.set(xlabel="vessels in the table", ylabel="s", title="a commit, s of the processor")
    axes.grid(visible=True, which="major", linewidth=0.4)
    axes.legend(frameon=False)
