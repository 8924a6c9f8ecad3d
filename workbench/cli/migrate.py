"""``kempf migrate``: an earlier warehouse is brought to the layout of this version."""

from __future__ import annotations

import click

from kempf.workbench.cli.confirm import confirm, yes_option
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, warehouse_option
from kempf.workbench.terminal import one_line, print_json, progress_bar


@click.command("migrate", cls=GivenOnce)
@yes_option
@warehouse_option
@json_option
def command(yes: bool, uri: str, as_json: bool) -> None:
    """Bring a warehouse of an earlier version of kempf forward, to the layout that this version works with.

    Nothing is lost: what it says is compared before it counts. Interrupted, the same command goes on. Earlier versions
    of kempf refuse the warehouse from then on.
    """
    from kempf.flows.jobs.repair.migrate_warehouse import migrate, planned
    from kempf.warehouse.storage.store import Warehouse

    warehouse = Warehouse(uri)
    with progress_bar() as progress:
        progress(0, 1, "what is to be done")
        plan = planned(warehouse)
    if plan.since != plan.until:
        shown = "; ".join(plan.to_do) or "only its marker is written"
        confirm(f"The warehouse {uri} goes from layout {plan.since} to {plan.until}: {shown}", yes=yes)
    with progress_bar() as progress:
        migration = migrate(warehouse, progress)
    if as_json:
        print_json(migration.as_json())
    elif migration.since == migration.until:
        click.echo(f"nothing to do: the warehouse has layout {migration.until}")
    else:
        for words in migration.compared:
            click.echo(one_line(words))
        click.echo(f"the warehouse has layout {migration.until}; next: kempf verify")
