"""``kempf note``: what people know of a vessel, a log, a segment or a set, and no log says."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from kempf.schemas.errors import UsageError
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, vessel_option, warehouse_option
from kempf.workbench.instants import utc_ns_of
from kempf.workbench.terminal import one_line, print_json

if TYPE_CHECKING:
    from kempf.warehouse.tables.notes import Note


@click.command("note", cls=GivenOnce)
@click.argument("text", required=False)
@vessel_option()
@click.option("--log", metavar="ID", help="On this log: its id, a beginning of it, or its file name.")
@click.option("--segment", metavar="ID", help="On this manoeuvre.")
@click.option("--set", "set_id", metavar="ID", help="On this parameter set.")
@click.option("--at", metavar="TIME", help="When it happened, ISO 8601, such as 2025-05-03.")
@click.option("--draught", "draught_m", type=float, metavar="M", help="The draught that it states, m.")
@warehouse_option
@json_option
def command(
    text: str | None,
    vessel: str | None,
    log: str | None,
    segment: str | None,
    set_id: str | None,
    at: str | None,
    draught_m: float | None,
    uri: str,
    as_json: bool,
) -> None:
    """Write a note on a vessel, log, manoeuvre or parameter set; without TEXT list the notes.

    Notes are only ever added; `kempf history` shows them. Where a draught is noted for every log of a vessel, the
    effect load_condition goes by it.
    """
    from kempf.flows.jobs.corrections.notes_of_hers import notes_of_hers
    from kempf.flows.jobs.corrections.subject_of_note import subject_of
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import notes, vessels

    warehouse = Warehouse(uri)
    warehouse.require()
    named = [name for name in (log, segment, set_id) if name is not None]
    if len(named) > 1:
        raise UsageError("several_subjects", "A note is on one thing.", "Give one of --log, --segment and --set.")
    if text is None:
        if named or at is not None or draught_m is not None:
            raise UsageError("no_note", "There is no text.", "Write the note, in quotes, behind `kempf note`.")
        if vessel is not None:
            vessels.require(warehouse, vessel)
        listed = notes.of_vessel(warehouse) if vessel is None else notes_of_hers(warehouse, vessel)
        if as_json:
            print_json([entry.as_json() for entry in listed])
        elif not listed:
            click.echo("no notes")
        for entry in [] if as_json else listed:
            click.echo(words_of(entry))
        return
    whose, subject, subject_id = subject_of(warehouse, vessel, log, segment, set_id)
    event = utc_ns_of(at, "--at") if at is not None else None
    note = notes.add(warehouse, whose, subject, subject_id, text, event_utc_ns=event, draught_m=draught_m)
    if as_json:
        print_json(note.as_json())
    else:
        click.echo(words_of(note))


def words_of(note: Note) -> str:
    """Return a note as one line."""
    from kempf.schemas.instants import iso_utc

    when = f"{iso_utc(note.event_utc_ns)[:10]}: " if note.event_utc_ns is not None else ""
    on = "" if note.subject == "vessel" else f" ({note.subject} {note.subject_id[:20]})"
    draught = f"draught {note.draught_m:g} m; " if note.draught_m is not None else ""
    written = f" [written {note.written:%Y-%m-%d}]" if note.written else ""
    return f"{one_line(note.vessel)}{on}: {when}{draught}{one_line(note.text)}{written}"
