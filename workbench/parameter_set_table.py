"""A parameter set as a person reads it at a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from kempf.workbench.numbers import number
from kempf.workbench.ranked_warnings import show_warnings
from kempf.workbench.terminal import print_table

if TYPE_CHECKING:
    from kempf.warehouse.tables.parameter_set import ParameterSet


def print_parameter_set(
    parameter_set: ParameterSet, title: str, *, verbose: bool = False, legs_too: bool = False
) -> None:
    """Print a parameter set for a person: values with standard errors, noise levels, fit, the gravest warnings.

    Parameters
    ----------
    legs_too : bool, optional
        Whether parameters fitted to legs, where predictions take these, stand beside those of the likelihood.
    """
    every = (*parameter_set.parameters, *parameter_set.noise)
    legs = _of_legs(parameter_set) if legs_too else {}
    head = ["", "value", "std", *(["by legs", "std"] if legs else []), "unit"]
    rows = [
        [p.name, number(p.value), number(p.std, 2), *(legs.get(p.name, ["", ""]) if legs else []), p.unit]
        for p in every
    ]
    print_table(head, rows, title)
    if legs:
        click.echo("  by legs: fitted to predict one leg ahead; predictions of manoeuvres take these")
    converged = parameter_set.convergence.get("converged")
    reason = parameter_set.convergence.get("reason")
    click.echo(f"  {'converged' if converged else 'NOT CONVERGED'}" + (f": {reason}" if reason else ""))
    for name, fit in dict(parameter_set.fit.get("channels", {})).items():
        click.echo(
            f"  {name}: fit {fit['fit_percent']:.1f} % one step ahead, in sample; "
            f"{100 * fit['inside_95_percent']:.0f} % inside the 95 % interval"
        )
    show_warnings(parameter_set.warnings, verbose=verbose)


def print_by_likelihood(parameter_set: ParameterSet) -> None:
    """Print, below parameters by the likelihood, that predictions take others, where they do."""
    if _of_legs(parameter_set):
        click.echo(
            f"  {parameter_set.parameter_set_id}: by the likelihood's parameters; predictions take those fitted to "
            "legs (kempf params show)"
        )


def _of_legs(parameter_set: ParameterSet) -> dict[str, list[str]]:
    """Return value and standard error of each parameter fitted to legs, empty where predictions take no such ones."""
    from kempf.flows.jobs.identify.leg_fit import by_name

    return {name: [number(value), number(std, 2)] for name, (value, std) in by_name(parameter_set).items()}
