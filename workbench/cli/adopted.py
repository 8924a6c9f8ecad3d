"""``kempf rerun --unadopt``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from kempf.workbench.terminal import print_json

if TYPE_CHECKING:
    from kempf.warehouse.storage.store import Warehouse


def take_back(warehouse: Warehouse, *, as_json: bool) -> None:
    """Let the present code count as itself again, and say what it counted as."""
    from kempf.warehouse.tables import equivalents

    warehouse.require()
    entries = equivalents.withdraw(warehouse)
    if as_json:
        print_json(
            {
                "taken_back": [
                    {"stage": entry.stage, "code": entry.code, "stood_for": entry.stands_for} for entry in entries
                ]
            }
        )
        return
    for entry in entries:
        click.echo(f"{entry.stage} code {entry.code} counts as {entry.stands_for} no longer; next: kempf reprocess")
    if not entries:
        click.echo("The present code counts as no other: there is nothing to take back.")
