"""``kempf repair``: what is damaged in a warehouse is made again from sealed copies and from the raw logs."""

from __future__ import annotations

import sys

import click

from kempf.schemas.enumeration import counted
from kempf.schemas.errors import DataRejected
from kempf.workbench.cli.confirm import confirm, yes_option
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, warehouse_option
from kempf.workbench.terminal import one_line, print_json, progress_bar


@click.command("repair", cls=GivenOnce)
@yes_option
@warehouse_option
@json_option
def command(yes: bool, uri: str, as_json: bool) -> None:
    """Make again what is damaged, as far as it can be, and say what is lost.

    Damaged files are kept aside in the folder `damaged` of the warehouse. Leaves with exit code 3 where something is
    still wrong.
    """
    from kempf.flows.jobs.repair.repair_warehouse import repair
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.upkeep.migrations.chain import MARKER_MENDED, repair_marker
    from kempf.warehouse.upkeep.verify import verify

    warehouse = Warehouse(uri)
    repaired = repair_marker(warehouse)
    with progress_bar() as progress:
        problems = verify(warehouse, lambda what: progress(0, 1, what))
    if problems:
        confirm(f"{counted(len(problems), 'problem')}, the first: {problems[0].words.rstrip('.')}", yes=yes)
    with progress_bar() as progress:
        outcome = repair(warehouse, progress)
    if repaired:
        outcome.done.insert(0, MARKER_MENDED)
    if as_json:
        print_json(outcome.as_json())
    else:
        for words in outcome.done:
            click.echo(one_line(words))
        for words in outcome.gone:
            click.echo(f"lost: {one_line(words)}")
        for problem in outcome.left:
            click.echo(one_line(f"still wrong: {problem.words} {problem.next_step or ''}".rstrip()))
        nothing = "nothing could be made again" if outcome.left else "nothing had to be done"
        first = (
            "what is said of what is still wrong, then " if any(problem.next_step for problem in outcome.left) else ""
        )
        click.echo(f"next: {first}kempf reprocess" if outcome.done or outcome.gone else nothing)
    if outcome.left:
        sys.exit(DataRejected.exit_code)
