"""``kempf verify``: whether everything in a warehouse is there and as it was written."""

from __future__ import annotations

import sys

import click

from kempf.schemas.enumeration import counted
from kempf.schemas.errors import DataRejected
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, warehouse_option
from kempf.workbench.terminal import one_line, print_json, progress_bar


@click.command("verify", cls=GivenOnce)
@warehouse_option
@json_option
def command(uri: str, as_json: bool) -> None:
    """Check raw logs, the files of every table and what refers to what; say what is damaged or lost.

    Leaves with exit code 3 where something is. Nothing is changed.
    """
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.upkeep.verify import verify

    with progress_bar() as progress:
        problems = verify(Warehouse(uri), lambda what: progress(0, 1, what))
    if as_json:
        print_json([problem.as_json() for problem in problems])
    else:
        for problem in problems:
            click.echo(one_line(f"{problem.words} {problem.next_step or ''}".rstrip()))
        repairable = any(problem.next_step is None for problem in problems)
        total = counted(len(problems), "problem") + ("; next: kempf repair" if repairable else "")
        click.echo(total if problems else "all is well")
    if problems:
        sys.exit(DataRejected.exit_code)
