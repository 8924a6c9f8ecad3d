"""A parameter set as a person reads it at a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from kempf.workbench.ranked_warnings import show_warnings
from kempf.workbench.terminal import number, print_table

if TYPE_CHECKING:
    from kempf.warehouse.parameter_set import ParameterSet


def tell_set(parameter_set: ParameterSet, title: str, *, verbose: bool = False) -> None:
    """Print a parameter set for a person: values with standard errors, noise levels, fit, the gravest warnings."""
    rows = [
        [p.name, number(p.value), number(p.std, 2), p.unit] for p in (*parameter_set.parameters, *parameter_set.noise)
    ]
    print_table(["", "value", "std", "unit"], rows, title)
    converged = parameter_set.convergence.get("converged")
    reason = parameter_set.convergence.get("reason")
    click.echo(f"  {'converged' if converged else 'NOT CONVERGED'}" + (f": {reason}" if reason else ""))
    for name, fit in dict(parameter_set.fit.get("channels", {})).items():
        click.echo(
            f"  {name}: fit {fit['fit_percent']:.1f} % one step ahead, in sample; "
            f"{100 * fit['inside_95_percent']:.0f} % inside the 95 % interval"
        )
    show_warnings(parameter_set.warnings, verbose=verbose)
