"""``kempf rerun --unadopt``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from kempf.workbench.terminal import print_json

if TYPE_CHECKING:
    from kempf.warehouse.store import Warehouse


def take_back(warehouse: Warehouse, *, as_json: bool) -> None:
    """Let the present code count as itself again, and say what it counted as."""
    from kempf.warehouse import equivalents

    warehouse.require()
    taken = equivalents.withdraw(warehouse)
    if as_json:
        print_json(
            {"taken_back": [{"stage": one.stage, "code": one.code, "stood_for": one.stands_for} for one in taken]}
        )
        return
    for one in taken:
        click.echo(f"{one.stage} code {one.code} counts as {one.stands_for} no longer; next: kempf reprocess")
    if not taken:
        click.echo("The present code counts as no other: there is nothing to take back.")
