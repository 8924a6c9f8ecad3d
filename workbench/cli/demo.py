"""``kempf demo``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import folder_option, json_option
from kempf.workbench.numbers import number
from kempf.workbench.terminal import print_json, print_table, progress_bar

if TYPE_CHECKING:
    from kempf.flows.jobs.demo.demonstrate import Demonstration
    from kempf.warehouse.tables.parameter_set import ParameterSet


@click.command("demo", cls=GivenOnce)
@folder_option("kempf-demo", "Where the logs and the warehouse go.")
@json_option
def command(folder: Path, as_json: bool) -> None:
    """Simulate three trial days of one ship, run the main job on the raw logs, compare with the truth.

    The logs are NMEA 0183, delimited text and MCAP with noise, wind, current and damaged lines; the pipeline gets
    nothing but the logs and the vessel's profile.
    """
    from kempf.flows.jobs.demo.demonstrate import demonstrate

    with progress_bar() as progress:
        shown = demonstrate(folder, progress)
    if as_json:
        print_json(
            {
                "folder": str(shown.folder),
                "vessel": shown.vessel,
                "truth": shown.truth,
                "ingested": [o.as_json() for o in shown.ingested],
                "parameter_sets": [o.parameter_set.as_json() for o in shown.identified if o.parameter_set],
                "reruns": [r.as_json() for r in shown.reruns],
            }
        )
        return
    _print_demonstration(shown)


def _print_demonstration(shown: Demonstration) -> None:
    from kempf.workbench.cli.ingest import print_outcomes

    click.echo(click.style("Raw logs", bold=True) + f" in {shown.folder / 'logs'}")
    print_outcomes(shown.ingested, notes=False)
    click.echo()
    zigzags = [
        [
            f"{s.psi0_deg:g}/{s.delta0_deg:g}",
            s.first_side,
            number(s.base_heading_deg),
            str(len(s.executes_utc_ns)),
            " ".join(f"{angle:.1f}" for angle in s.overshoots_deg[:4]),
        ]
        for s in (o.segment for o in shown.identified)
    ]
    print_table(["heading/rudder deg", "first side", "K0 deg", "executes", "overshoots deg"], zigzags, "Zigzags found")
    click.echo()
    for outcome in shown.identified:
        segment = outcome.segment
        title = f"{segment.words} of {segment.segment_id}"
        if outcome.parameter_set is None:
            click.echo(f"{title}: not identified, {outcome.error}")
            continue
        _compare(outcome.parameter_set, shown.truth, title)
    same = sum(r.verdict == "bit-identical" for r in shown.reruns)
    click.echo(f"Rebuilt from the raw bytes: {same} of {len(shown.reruns)} parameter sets bit-identical.")
    tables = shown.folder / "warehouse"
    click.echo(f"Tables (Delta Lake, plain Parquet inside): {tables}")
    click.echo("\nnext:")
    click.echo(f"  export KEMPF_WAREHOUSE={tables}")
    click.echo("  kempf workbench --open  (all of it in the browser)")
    click.echo(f"  kempf segments\n  kempf history --vessel {shown.vessel} --parameter b2")


def _compare(parameter_set: ParameterSet, truth: dict[str, float], title: str) -> None:
    rows = [
        [
            p.name,
            number(p.value),
            number(p.std, 2),
            p.unit,
            number(truth[p.name]),
            f"{(p.value - truth[p.name]) / p.std:+.1f}" if p.std else "-",
        ]
        for p in parameter_set.parameters
    ]
    converged = "converged" if parameter_set.convergence.get("converged") else "NOT CONVERGED"
    head = ["", "value", "std", "unit", "truth", "error in std"]
    print_table(head, rows, f"{title}: {parameter_set.parameter_set_id}, {converged}")
    click.echo()
