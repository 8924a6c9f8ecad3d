"""``kempf reproduce-paper``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from kempf.schemas.errors import UsageError
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import folder_option, json_option
from kempf.workbench.numbers import number
from kempf.workbench.terminal import print_json, print_table, progress_bar

if TYPE_CHECKING:
    from kempf.flows.jobs.demo.reproduce_paper import Experiment, Reproduction


@click.command("reproduce-paper", cls=GivenOnce)
@folder_option("kempf-paper", "Where the figures go.")
@json_option
def command(folder: Path, as_json: bool) -> None:
    """Repeat the experiment of the paper that the method comes from: its three figures, its accuracy beside ours.

    A zigzag is simulated under a constant wind force and current; the hull is identified by the paper's 25 iterations
    and by maximum likelihood from the same record, once with little noise and once with that of usual instruments.
    """
    from kempf.flows.jobs.demo.reproduce_paper import reproduce_paper

    try:
        folder.mkdir(parents=True, exist_ok=True)
        with progress_bar() as progress:
            reproduction = reproduce_paper(progress)
        figures = draw(reproduction, folder)
    except OSError as error:
        raise UsageError(
            "cannot_write", f"Writing to {folder} failed: {error.strerror or error}.", "Give another folder."
        ) from error
    if as_json:
        print_json({**reproduction.as_json(), "figures": [str(path) for path in figures]})
        return
    _print_reproduction(reproduction)
    click.echo(click.style("Figures", bold=True))
    for path in figures:
        click.echo(f"  {path}")


def draw(reproduction: Reproduction, folder: Path) -> list[Path]:
    """Draw the paper's three figures of the experiment with the least noise into a folder; return their paths."""
    from kempf.workbench.figures.disturbed_zigzag import draw_disturbed_zigzag
    from kempf.workbench.figures.iterations import draw_iterations

    shown = reproduction.experiments[0]
    figures = [folder / f"figure-{k}.png" for k in (1, 2, 3)]
    last = len(shown.course.passes) - 1
    noise = f"{shown.noise_factor:g} times the noise of usual instruments"
    for path, estimated, stage in (
        (figures[0], shown.first, "after the first approximation"),
        (figures[2], shown.last, f"after iteration {last}"),
    ):
        draw_disturbed_zigzag(shown.time_s, shown.true, shown.measured, estimated, path, f"{stage}; {noise}")
    draw_iterations(shown.procedure.iterations, reproduction.discrete, figures[1], f"parameters of eq. (17); {noise}")
    return figures


def _print_reproduction(reproduction: Reproduction) -> None:
    rows = [[name, value, by] for name, (value, by) in reproduction.conditions.items()]
    print_table(["condition", "value", "stated by"], rows, "The experiment")
    click.echo()
    for experiment in reproduction.experiments:
        _print_experiment(reproduction, experiment)


def _print_experiment(reproduction: Reproduction, experiment: Experiment) -> None:
    shown = experiment.as_json()
    rows = [
        [
            name,
            number(reproduction.truth[name]),
            number(row["paper_percent"], 3),
            *(number(row[key], 3) for key in ("first_percent", "last_percent", "ml_percent")),
            number(row["ml_std_percent"], 2),
        ]
        for name, row in shown["accuracy"].items()
    ]
    last = len(experiment.course.passes) - 1
    head = ["", "truth", "paper", "first approximation", f"iteration {last}", "maximum likelihood", "its std"]
    print_table(head, rows, f"Noise {experiment.noise_factor:g} times that of usual instruments: errors in percent")
    for name, unit, key in (("force", "m/s^2", "force_m_s2"), ("current", "m/s", "current_m_s")):
        estimated = shown["disturbances_at_the_end"][key]
        first, end, true = (number(estimated[which], 3) for which in ("first", "last", "true"))
        estimates = f"{first} after the first approximation, {end} after iteration {last}"
        click.echo(f"  {name} at the end: {estimates}; true {true} {unit}")
    likely = experiment.maximum_likelihood
    click.echo(f"  procedure: {experiment.course.reason}")
    click.echo(f"  maximum likelihood: {'converged' if likely.converged else 'NOT CONVERGED'}")
    for warning in likely.warnings:
        click.echo(f"    warning: {warning}")
    click.echo()
