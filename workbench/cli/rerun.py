"""``kempf rerun``."""

from __future__ import annotations

import sys

import click

from schemas.errors import ThresholdExceeded
from workbench.cli.options import json_option, warehouse_option
from workbench.terminal import number, print_json, print_table


@click.command("rerun")
@click.argument("set_id")
@click.option("--tolerance", type=float, default=1e-9, show_default=True, help="Relative; what still counts as equal.")
@warehouse_option
@json_option
def command(set_id: str, tolerance: float, uri: str, as_json: bool) -> None:
    """Build a parameter set again from the raw bytes and say whether it is the same, bit for bit.

    Exit code 5 where it is different.
    """
    from flows.rerun_set import rerun
    from warehouse.store import Warehouse

    result = rerun(Warehouse(uri), set_id, tolerance)
    if as_json:
        print_json(result.show())
    else:
        click.echo(f"{result.parameter_set_id}: {result.verdict}")
        if result.code_changed:
            click.echo("  the code is not the one that made it")
        for name, (then, now) in result.packages_changed.items():
            click.echo(f"  {name} was {then}, is {now}")
        if result.differences:
            rows = [[d.field, str(d.stored), str(d.rebuilt), number(d.relative)] for d in result.differences[:20]]
            print_table(["field", "stored", "rebuilt", "relative"], rows)
    if result.verdict == "different":
        sys.exit(ThresholdExceeded.exit_code)
