"""``kempf inbox``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from kempf.schemas.enumeration import counted
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, new_vessel_option, verbose_option, warehouse_option
from kempf.workbench.terminal import one_line, print_json, print_note, progress_bar

if TYPE_CHECKING:
    from kempf.flows.jobs.inbox.take_inbox import InboxRun


@click.command("inbox", cls=GivenOnce)
@click.argument("folder", metavar="[PATH]", required=False)
@new_vessel_option("Make a vessel of every folder whose name is none yet.")
@click.option(
    "--settle",
    "settle_s",
    type=click.FloatRange(min=0.0),
    default=60.0,
    show_default=True,
    metavar="SECONDS",
    help="Leave files for the next run that were written less than so long ago.",
)
@verbose_option
@warehouse_option
@json_option
def command(folder: str | None, new_vessel: bool, settle_s: float, verbose: bool, uri: str, as_json: bool) -> None:
    """Ingest what is new in a folder or under s3://bucket/prefix, one folder a vessel.

    Without PATH it is the inbox that KEMPF_INBOX or kempf.toml names. A file whose vessel or format is not clear goes
    into quarantine and stops no other; `kempf logs quarantine` lists them. Nothing in the inbox is moved or deleted.
    The exit code is 3 while something is in quarantine.
    """
    from kempf.flows.jobs.inbox.take_inbox import NeedsAPerson, take_inbox
    from kempf.flows.process.configuration import setting
    from kempf.schemas.errors import UsageError
    from kempf.warehouse.sources.source_folder import SourceFolder
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.cli.ingest import print_outcomes

    place = folder or setting("inbox")
    if place is None:
        raise UsageError(
            "no_inbox",
            "No inbox is named.",
            "Give its address, or set it: `inbox` in kempf.toml, or KEMPF_INBOX.",
        )
    with progress_bar() as progress:
        run = take_inbox(Warehouse(uri), SourceFolder(place), progress, new_vessels=new_vessel, settle_s=settle_s)
    if as_json:
        print_json(run.as_json())
    else:
        print_outcomes(run.ingested, verbose=verbose)
        _print_run(run)
    if run.quarantined:
        raise click.exceptions.Exit(NeedsAPerson.exit_code)


def _print_run(run: InboxRun) -> None:
    parts = [f"{counted(len(run.ingested), 'log')} ingested", f"{run.known} known"]
    if run.waiting:
        parts.append(
            f"{len(run.waiting)} left for the next run, as they are being written or their profile is not read"
        )
    if run.removed:
        parts.insert(1, f"{len(run.removed)} removed before and left alone")
    click.echo(", ".join(parts))
    for remark in run.remarks:
        print_note(remark)
    for file in run.removed:
        click.echo(
            f"{click.style('removed before', fg='yellow')} {one_line(file.address)}\n"
            f"  {one_line(file.message or '')} {one_line(file.next_step or '')}",
            err=True,
        )
    for file in run.quarantined:
        mark = "" if file.address in run.tried else " (as before)"
        click.echo(
            f"{click.style('quarantined', fg='red')}{mark} [{file.code}] {one_line(file.address)}\n"
            f"  {one_line(file.message or '')} {one_line(file.next_step or '')}",
            err=True,
        )
