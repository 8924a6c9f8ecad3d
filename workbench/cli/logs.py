"""``kempf logs list|rejected``."""

from __future__ import annotations

import click

from workbench.cli.options import json_option, vessel_option, warehouse_option
from workbench.terminal import print_json, print_table


@click.group("logs")
def command() -> None:
    """List the logs, show what was rejected in one and why."""


@command.command("list")
@vessel_option()
@warehouse_option
@json_option
def list_logs(vessel: str | None, uri: str, as_json: bool) -> None:
    """List the logs with their ledgers: records read = kept + rejected."""
    from warehouse import logs, vessels
    from warehouse.instant import iso_utc
    from warehouse.store import Warehouse

    warehouse = Warehouse(uri)
    warehouse.require()
    if vessel is not None:
        vessels.require(warehouse, vessel)
    found = [
        {
            "log_id": row.log_id,
            "ingest_id": row.ingest_id,
            "vessel": row.vessel,
            "file_name": row.file_name,
            "format": row.format,
            "start": iso_utc(row.start_utc_ns),
            "end": iso_utc(row.end_utc_ns),
            "records_read": row.tally.records_read,
            "records_kept": row.tally.records_kept,
            "records_rejected": row.tally.records_rejected,
            "rejected_by_reason": dict(row.tally.by_reason),
            "notes": list(row.notes),
        }
        for row in logs.current(warehouse, vessel)
    ]
    if as_json:
        print_json(found)
        return
    head = ["log_id", "vessel", "file_name", "format", "start", "records_read", "records_kept", "records_rejected"]
    rows = [[str(one[name])[: 12 if name == "log_id" else 40] for name in head] for one in found]
    print_table([name.replace("_", " ") for name in head], rows)


@command.command("rejected")
@click.argument("log_id")
@click.option("--limit", type=click.IntRange(min=0), default=50, show_default=True, help="At most so many rows.")
@warehouse_option
@json_option
def rejected(log_id: str, limit: int, uri: str, as_json: bool) -> None:
    """Show the records and values that were refused in one log, each with its reason and raw text."""
    from warehouse import logs, readings
    from warehouse.store import Warehouse

    warehouse = Warehouse(uri)
    row = logs.by_prefix(warehouse, log_id)
    refused = readings.read_rejected(warehouse, row.ingest_id)
    shown = refused.head(limit).rows(named=True)
    if as_json:
        print_json({"log_id": row.log_id, "rejected": refused.height, "shown": len(shown), "rows": shown})
        return
    rows = [[str(r["record"]), r["reason"], r["source"] or "", r["channel"] or "", repr(r["raw"])[:80]] for r in shown]
    print_table(["record", "reason", "source", "channel", "raw"], rows)
    if refused.height > limit:
        click.echo(f"... {refused.height - limit} more, see --limit")
