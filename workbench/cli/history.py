"""``kempf history``."""

from __future__ import annotations

from datetime import UTC, datetime

import click

from schemas.errors import UsageError
from workbench.cli.options import json_option, vessel_option, warehouse_option
from workbench.terminal import number, print_json, print_table


@click.command("history")
@vessel_option(required=True)
@click.option("--parameter", metavar="NAME", help="Only this parameter, such as b2.")
@click.option("--as-of", metavar="TIME", help="What was known at this time, ISO 8601; without a zone it is UTC.")
@click.option("--all", "superseded", is_flag=True, help="Also sets that a newer profile or code superseded.")
@warehouse_option
@json_option
def command(vessel: str, parameter: str | None, as_of: str | None, superseded: bool, uri: str, as_json: bool) -> None:
    """Show a vessel's parameters over time, as known now or at an earlier time."""
    from warehouse import history
    from warehouse.store import Warehouse

    found = history.of_vessel(Warehouse(uri), vessel, parameter, _instant(as_of), superseded=superseded)
    if found.note:
        click.echo(found.note, err=as_json)
    if as_json:
        print_json(found.rows())
    if found.note or as_json:
        return
    rows = [
        [
            r["start"][:19],
            r["parameter"],
            number(r["value"]),
            number(r["std"], 2),
            r["unit"],
            r["estimator"],
            r["model"],
            r["parameter_set_id"] + (" superseded" if r["superseded"] else ""),
        ]
        for r in found.rows()
    ]
    print_table(["start UTC", "parameter", "value", "std", "unit", "estimator", "model", "parameter set"], rows)


def _instant(text: str | None) -> datetime | None:
    if text is None:
        return None
    try:
        instant = datetime.fromisoformat(text)
        return (instant if instant.tzinfo is not None else instant.replace(tzinfo=UTC)).astimezone(UTC)
    except (ValueError, OverflowError) as error:
        raise UsageError(
            "not_a_time",
            f"--as-of {text!r} is no time; expected ISO 8601.",
            "Write it as 2025-05-03T12:00:00Z.",
        ) from error
