"""The figures in docs/scale.md: what a large fleet costs, computed from those that `fleet` measured."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks import result_page
from benchmarks.fleet.fleet_figures import Figures
from kempf.flows.fleet.plan import Plan

SCALE = Path(__file__).parents[2] / "docs" / "scale.md"
#: The time that a night has for it.
NIGHT_H = 8.0
_BEGIN, _END = "<!-- computed by python -m benchmarks.fleet.fleet -->", "<!-- to here -->"


@dataclass(frozen=True)
class Large:
    """What a run over many vessels takes, each of them with everything to do."""

    #: batches, most: Batches that `kempf.flows.fleet.plan` makes, and vessels of the largest.
    batches: int
    most: int
    #: Of the processor without the commits, s: that of the fleet measured times the vessels.
    core_s: float
    #: writers, a_second, commit_s: Float, float. How many at once the table that was measured took most commits a
    #: second from, how many it took, and what each was of the processor, s.
    writers: int
    a_second: float
    commit_s: float
    #: Of the processor for the commits to all tables, s: each taken for one to that table.
    commit_core_s: float
    #: Table that is committed to most.
    busiest: str
    #: To that table.
    commits: float
    #: For these, one after the other as fast as the table took them, s.
    serial_s: float

    @property
    def all_core_s(self) -> float:
        """Of the processor in all, s."""
        return self.core_s + self.commit_core_s

    @property
    def cores_a_night(self) -> int:
        """Cores that do it in `NIGHT_H`, were commits never to wait for each other."""
        return int(np.ceil(self.all_core_s / (3600.0 * NIGHT_H)))

    @property
    def full_from(self) -> float:
        """Cores from which on the commits to one table, one after the other, take longer than everything else."""
        return self.all_core_s / self.serial_s


def large(figures: Figures, vessels: int) -> Large:
    """Return what a run takes in which ``vessels`` of the largest fleet that commits were measured for are due."""
    whole, at = figures["whole"], figures["commits"]["sizes"][-1]
    logs = figures["logs"]
    plan = Plan(tuple((f"{k}", logs) for k in range(vessels)), ())
    batches = plan.batches(figures["cores"])
    a_batch = {name: n / whole["batches"] for name, n in whole["commits"].items()}
    writers, best = max(at["writers"].items(), key=lambda item: item[1]["a_second"])
    busiest, most = max(a_batch.items(), key=lambda item: (item[1], item[0]))
    return Large(
        batches=len(batches),
        most=max(map(len, batches)),
        core_s=whole["cpu_s"] / whole["vessels"] * vessels,
        writers=int(writers),
        a_second=best["a_second"],
        commit_s=best["cpu_s"],
        commit_core_s=sum(a_batch.values()) * len(batches) * best["cpu_s"],
        busiest=busiest,
        commits=most * len(batches),
        serial_s=most * len(batches) / best["a_second"],
    )


def lines(figures: Figures) -> list[str]:
    """Return the computed part of docs/scale.md."""
    whole, at = figures["whole"], figures["commits"]["sizes"][-1]
    n, fleet = whole["vessels"], at["vessels"]
    everything, some = large(figures, fleet), large(figures, max(1, fleet // 100))
    sizes = np.array([step["vessels"] for step in figures["steps"]], dtype=float)
    slope, at_none = np.polyfit(sizes, [step["again"]["wall_s"] for step in figures["steps"]], 1)
    nothing = max(float(at_none), 0.0) + max(float(slope), 0.0) * fleet
    raw, tables = figures["bytes"].get("raw", 0), sum(v for k, v in figures["bytes"].items() if k != "raw")
    commits_first = everything.full_from < everything.cores_a_night
    rows = [
        ["everything again (new code), core hours", f"{everything.all_core_s / 3600.0:.1f}"],
        ["of these for commits", f"{everything.commit_core_s / 3600.0:.1f}"],
        [f"cores for that in {NIGHT_H:.0f} hours", f"{everything.cores_a_night}"],
        ["batches", f"{everything.batches}"],
        ["vessels in the largest of them", f"{everything.most}"],
        [f"commits to the busiest table, {everything.busiest}", f"{everything.commits:.0f}"],
        ["processor time of a commit, s", f"{everything.commit_s:.2f}"],
        [
            f"hours for these at {everything.a_second:.2g} a second, however many cores",
            f"{everything.serial_s / 3600.0:.2f}",
        ],
        ["cores from which commits to one table, not cores, are the limit", f"{everything.full_from:.0f}"],
        ["one vessel in a hundred changed, core hours", f"{some.all_core_s / 3600.0:.2f}"],
        ["nothing changed, seconds", f"{nothing:.0f}"],
        ["raw logs, GB (logs as short as these)", f"{raw / n * fleet / 1e9:.1f}"],
        ["tables, GB, after each log was read as often as here", f"{tables / n * fleet / 1e9:.1f}"],
    ]
    verdict = (
        f"**First full: {'the commits to one table' if commits_first else 'the cores'}.** {fleet} vessels are "
        f"{everything.batches} batches of {everything.most} vessels at most; those measured were {whole['batches']} of "
        f"{np.ceil(n / whole['batches']):.0f}. A vessel takes {everything.core_s / fleet:.1f} core seconds, a batch "
        f"{sum(whole['commits'].values()) / whole['batches']:.1f} commits to all tables together, of which "
        f"{everything.commits / everything.batches:.1f} to {everything.busiest}. A commit to a table of {at['files']} "
        f"files takes {everything.commit_s:.2f} s of the processor, so that commits are "
        f"{100.0 * everything.commit_core_s / everything.all_core_s:.0f} % of the work. One table took "
        f"{everything.a_second:.2g} commits a second at best, writers at once being {everything.writers}, on "
        f"{figures['cores']} cores: were it never more, more than {everything.full_from:.0f} cores would not help. "
        f"{fleet} vessels in {NIGHT_H:.0f} hours want {everything.cores_a_night}."
    )
    return [
        verdict,
        "",
        *result_page.table([f"{fleet} vessels, {figures['logs']} logs each", "computed from the figures"], rows),
    ]


def with_figures(text: str, figures: Figures) -> str:
    """Return docs/scale.md with its computed part made anew."""
    block = "\n".join([_BEGIN, "", *lines(figures), "", _END])
    found, n = re.subn(f"{re.escape(_BEGIN)}.*?{re.escape(_END)}", lambda _: block, text, flags=re.DOTALL)
    assert n == 1, "docs/scale.md has one computed part"
    return found
