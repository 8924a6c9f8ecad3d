"""``kempf compact``."""

from __future__ import annotations

import click

from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, warehouse_option
from kempf.workbench.terminal import print_json, print_table


@click.command("compact", cls=GivenOnce)
@click.option(
    "--more-files-than",
    type=click.IntRange(min=1),
    default=50,
    show_default=True,
    metavar="N",
    help="Tables with fewer files are left alone.",
)
@click.option("--vacuum", is_flag=True, help="Then delete the files that no version needs that is kept.")
@click.option(
    "--older-than",
    "days",
    type=click.FloatRange(min=1.0),
    default=7.0,
    show_default=True,
    metavar="DAYS",
    help="With --vacuum: files and versions younger than this are kept, whoever they belong to.",
)
@click.option("--dry-run", is_flag=True, help="With --vacuum: only say what would be deleted.")
@warehouse_option
@json_option
def command(more_files_than: int, vacuum: bool, days: float, dry_run: bool, uri: str, as_json: bool) -> None:
    """Put the many small files of the tables into few, so that reading stays quick.

    Every version stays readable. With --vacuum, versions may go that no parameter set was made from, that are older
    than --older-than, and that `kempf history --as-of` does not need.
    """
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.upkeep import compaction

    warehouse = Warehouse(uri)
    tables = () if dry_run else compaction.compact(warehouse, more_files_than)
    cleared = compaction.vacuum(warehouse, 24.0 * days, dry_run=dry_run) if vacuum or dry_run else ()
    if as_json:
        print_json({"compacted": list(tables), "vacuumed": [table.as_json() for table in cleared], "dry_run": dry_run})
        return
    if not dry_run:
        click.echo(f"compacted: {', '.join(tables) or 'nothing, no table has so many files'}")
    if cleared:
        rows = [[c.table, str(c.files), f"{c.size_bytes / 1e6:.3f}", str(c.kept_versions)] for c in cleared]
        print_table(["table", "files to go" if dry_run else "files deleted", "MB", "versions kept"], rows)
