"""``kempf logs list|show|rejected|quarantine|release|dismiss|remove|restore|move``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kempf.schemas.enumeration import as_words, counted
from kempf.workbench.cli.confirm import confirm, reason_option, what_goes, yes_option
from kempf.workbench.cli.given_once import GivenOnceGroup
from kempf.workbench.cli.options import (
    json_option,
    new_vessel_option,
    profile_option,
    verbose_option,
    vessel_option,
    warehouse_option,
)
from kempf.workbench.terminal import one_line, print_json, print_note, print_table

if TYPE_CHECKING:
    from kempf.pipeline.ingest.decoded import LostStretch
    from kempf.warehouse.tables.logs import LogRow


#: Letters of a long file name that a table shows, first and last.
_ENDS = (14, 15)


@click.group("logs", cls=GivenOnceGroup)
def command() -> None:
    """List the logs, show what one's channels say and what was rejected in it; see to the files in quarantine."""


@command.command("list")
@vessel_option()
@click.option("--removed", is_flag=True, help="Those that were removed or moved, with the reason.")
@warehouse_option
@json_option
def list_logs(vessel: str | None, removed: bool, uri: str, as_json: bool) -> None:
    """List the logs with their ledgers, records read = kept + rejected, and what the channel doctor says of each."""
    from kempf.flows.jobs.state.out_of_date import said_of_logs
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import logs, vessels
    from kempf.workbench.documents.logs import listed_logs

    warehouse = Warehouse(uri)
    if removed:
        warehouse.require()
        if vessel is not None and vessel not in vessels.removed(warehouse):
            vessels.require(warehouse, vessel)
        _list_removed(logs.removed(warehouse, vessel), as_json)
        return
    listed = listed_logs(warehouse, vessel)
    facts, gone = listed.documents, listed.lost
    print_note(said_of_logs(warehouse, vessel))
    if as_json:
        print_json(facts)
        return
    rows = [
        [
            *(log["log_id"][:12], log["vessel"], _shortened(log["file_name"]), str(log["start"])[:16]),
            *(str(log["records_kept"]), str(log["records_rejected"]), _brief(log["channels"])),
        ]
        for log in facts
    ]
    head = ["log", "vessel", "file name", "start UTC", "records kept", "rejected", "channels"]
    if gone:
        head.append("damage")
        rows = [[*row, _damage(gone.get(log.ingest_id, ()))] for row, log in zip(rows, listed.rows, strict=True)]
    print_table(head, rows)


def _list_removed(rows: Sequence[LogRow], as_json: bool) -> None:
    from kempf.workbench.documents.logs import facts_of

    if as_json:
        print_json([{**facts_of(row), "removed": row.removed} for row in rows])
        return
    head = ["log", "vessel", "file name", "removed"]
    print_table(head, [[row.log_id[:12], row.vessel, _shortened(row.file_name), row.removed or ""] for row in rows])


def _shortened(name: str) -> str:
    """Leave out the middle of a long name, whose ends distinguish it."""
    head, tail = _ENDS
    return name if len(name) <= head + 3 + tail else f"{name[:head]}...{name[-tail:]}"


def _brief(channels: Any) -> str:
    """Say a verdict in a word or two; a dash for a log from before there was a doctor."""
    if channels is None:
        return "-"
    many = len(channels["findings"])
    return channels["verdict"] if not many else counted(many, "fault")


@command.command("show")
@click.argument("log_id")
@warehouse_option
@json_option
def show(log_id: str, uri: str, as_json: bool) -> None:
    """Show one log: how it was read, and what the channel doctor found in it."""
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import logs
    from kempf.workbench.cli.doctor import print_examination
    from kempf.workbench.documents.logs import log_document

    warehouse = Warehouse(uri)
    shown = log_document(warehouse, logs.by_prefix(warehouse, log_id))
    if as_json:
        print_json(shown)
        return
    channels = shown.pop("channels")
    for name, value in shown.items():
        listed = value if isinstance(value, list) else [value]
        for entry in listed:
            click.echo(f"{as_words(name)}: {one_line(str(entry))}")
    if channels is None:
        click.echo("channels: read before there was a channel doctor; `kempf reprocess` examines it")
    else:
        print_examination("channels", channels, everything=True)


def _damage(lost: Sequence[LostStretch]) -> str:
    """Say in a word what of a log is lost."""
    if not lost:
        return ""
    counted = [stretch.messages for stretch in lost if stretch.messages is not None]
    many = f", {sum(counted)} messages" if len(counted) == len(lost) else ""
    return f"partial: {len(lost)} stretch{'es' if len(lost) > 1 else ''} lost{many}"


@command.command("rejected")
@click.argument("log_id")
@click.option("--limit", type=click.IntRange(min=0), default=50, show_default=True, help="At most so many rows.")
@warehouse_option
@json_option
def rejected(log_id: str, limit: int, uri: str, as_json: bool) -> None:
    """Show the records and values that were refused in one log, each with its reason and raw text."""
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import logs, readings

    warehouse = Warehouse(uri)
    row = logs.by_prefix(warehouse, log_id)
    refused = readings.read_rejected(warehouse, row.ingest_id)
    shown = refused.head(limit).rows(named=True)
    if as_json:
        counts = {"records_rejected": row.tally.records_rejected, "values_rejected": row.tally.values_rejected}
        print_json({"log_id": row.log_id, "rejected": refused.height, **counts, "shown": len(shown), "rows": shown})
        return
    rows = [[str(r["record"]), r["reason"], r["source"] or "", r["channel"] or "", repr(r["raw"])[:80]] for r in shown]
    click.echo(
        f"{row.tally.records_rejected} records rejected, and {row.tally.values_rejected} values of kept records, which "
        "name their channel"
    )
    print_table(["record", "reason", "source", "channel", "raw"], rows)
    if refused.height > limit:
        click.echo(f"... {refused.height - limit} more, see --limit")


@command.command("quarantine")
@warehouse_option
@json_option
def quarantine(uri: str, as_json: bool) -> None:
    """List the files of inboxes that could not be placed or read, with the reason and what to do."""
    from kempf.flows.jobs.inbox.take_inbox import quarantine_json
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import inbox

    held = inbox.quarantined(Warehouse(uri))
    if as_json:
        print_json([quarantine_json(file) for file in held])
        return
    if not held:
        click.echo("no file is in quarantine")
    for file in held:
        click.echo(f"{one_line(file.address)}: [{file.code}] {one_line(file.message or '')}")
        click.echo(f"  {one_line(file.next_step or '')}")


@command.command("release")
@click.argument("file")
@vessel_option()
@new_vessel_option("She is new.")
@profile_option
@verbose_option
@warehouse_option
@json_option
def release_file(
    file: str,
    vessel: str | None,
    new_vessel: bool,
    profiles: tuple[Path, ...],
    verbose: bool,
    uri: str,
    as_json: bool,
) -> None:
    """Ingest a file that is in quarantine, by its address or the end of it, as a log of the vessel that is named."""
    from kempf.flows.jobs.inbox.release_log import release
    from kempf.flows.jobs.ingest.files import read_profiles
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.cli.ingest import print_outcomes

    profile = read_profiles(profiles) if profiles else None
    outcome = release(Warehouse(uri), file, vessel, profile, new_vessel=new_vessel)
    if as_json:
        print_json(outcome.as_json())
    else:
        print_outcomes([outcome], verbose=verbose)


@command.command("dismiss")
@click.argument("file")
@reason_option
@warehouse_option
@json_option
def dismiss_file(file: str, reason: str, uri: str, as_json: bool) -> None:
    """Leave a file that is in quarantine alone for good. The file itself is not touched."""
    from kempf.flows.jobs.inbox.release_log import dismiss
    from kempf.warehouse.storage.store import Warehouse

    row = dismiss(Warehouse(uri), file, reason)
    if as_json:
        print_json({"file": row.address, "dismissed": True, "reason": row.message})
    else:
        click.echo(f"{one_line(row.address)}: dismissed, {one_line(row.message or '')}")


@command.command("remove")
@click.argument("log_id")
@reason_option
@yes_option
@warehouse_option
@json_option
def remove_log(log_id: str, reason: str, yes: bool, uri: str, as_json: bool) -> None:
    """Let a log count no longer. Nothing is deleted: `restore` brings it back, `history --as-of` still knows it."""
    from kempf.flows.jobs.corrections.affected_sets import of_logs
    from kempf.flows.jobs.corrections.remove_logs import remove
    from kempf.flows.jobs.state.out_of_date import command_for
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import logs

    warehouse = Warehouse(uri)
    row = logs.by_prefix(warehouse, log_id)
    confirm(what_goes(of_logs(warehouse, [row]), f"{row.file_name} is removed"), yes=yes)
    affected = remove(warehouse, [row], reason)
    if as_json:
        print_json(affected.as_json())
    else:
        click.echo(f"{one_line(row.file_name)}: removed; next: {command_for([row.vessel])}")


@command.command("restore")
@click.argument("log_id")
@warehouse_option
@json_option
def restore_log(log_id: str, uri: str, as_json: bool) -> None:
    """Let a log that was removed count again, and its vessel where she was removed too."""
    from kempf.flows.jobs.corrections.remove_logs import restore
    from kempf.flows.jobs.state.out_of_date import command_for
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import vessels
    from kempf.workbench.documents.logs import facts_of

    warehouse = Warehouse(uri)
    warehouse.require()
    gone = vessels.removed(warehouse)
    row = restore(warehouse, log_id)
    if as_json:
        print_json({**facts_of(row), "vessel_restored": row.vessel in gone})
    else:
        also = f", and the vessel {row.vessel!r} with it" if row.vessel in gone else ""
        click.echo(f"{one_line(row.file_name)}: counts again{also}; next: {command_for([row.vessel])}")


@command.command("move")
@click.argument("log_id")
@vessel_option(required=True)
@new_vessel_option("She is new.")
@reason_option
@yes_option
@warehouse_option
@json_option
def move_log(log_id: str, vessel: str, new_vessel: bool, reason: str, yes: bool, uri: str, as_json: bool) -> None:
    """Give a log to the vessel that it is of: it is read again from its bytes, with her profile."""
    from kempf.flows.jobs.corrections.affected_sets import of_logs
    from kempf.flows.jobs.corrections.remove_logs import move
    from kempf.schemas.errors import NotFound
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import logs
    from kempf.workbench.documents.logs import facts_of

    warehouse = Warehouse(uri)
    try:
        row = logs.by_prefix(warehouse, log_id)
    except NotFound:  # an interrupted move goes on, and takes nothing from anybody
        pass
    else:
        confirm(what_goes(of_logs(warehouse, [row]), f"{row.file_name} is given to {vessel!r}"), yes=yes)
    affected, now = move(warehouse, log_id, vessel, reason, new_vessel=new_vessel)
    if as_json:
        print_json({**facts_of(now), "following": affected.as_json() if affected else None})
        return
    of = [vessel] if affected is None else [affected.vessel, vessel]
    again = " ".join(f"--vessel {name}" for name in of)
    click.echo(f"{one_line(now.file_name)}: a log of {vessel} now; next: kempf reprocess {again}")
