"""``kempf segments correct|exclude|accept|add|corrections``: what a person says of the manoeuvres of a log."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from kempf.schemas.enumeration import counted
from kempf.schemas.errors import UsageError
from kempf.workbench.cli.confirm import confirm, reason_option, yes_option
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, vessel_option, warehouse_option
from kempf.workbench.instants import utc_ns_of
from kempf.workbench.terminal import one_line, print_json, print_table

if TYPE_CHECKING:
    from kempf.flows.jobs.corrections.correct_segments import Planned
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables.segments import Segment


@click.command("correct", cls=GivenOnce)
@click.argument("segment_id")
@click.option("--start", metavar="TIME", help="First instant of the manoeuvre, ISO 8601; its own by default.")
@click.option("--end", metavar="TIME", help="Last instant of the manoeuvre; its own by default.")
@reason_option
@yes_option
@warehouse_option
@json_option
def correct(
    segment_id: str, start: str | None, end: str | None, reason: str, yes: bool, uri: str, as_json: bool
) -> None:
    """Give a zigzag other bounds; executes and overshoots are measured again between them."""
    from kempf.flows.jobs.corrections.correct_segments import plan_for
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import segments

    if start is None and end is None:
        raise UsageError("no_bounds", "Neither --start nor --end is given.", "Give the one that is to change, or both.")
    warehouse = Warehouse(uri)
    own = segments.by_prefix(warehouse, segment_id)
    bounds = (
        own.start_utc_ns if start is None else utc_ns_of(start, "--start"),
        own.end_utc_ns if end is None else utc_ns_of(end, "--end"),
    )
    _carry_out(warehouse, plan_for(warehouse, own.segment_id, "correct", reason, bounds), yes=yes, as_json=as_json)


@click.command("exclude", cls=GivenOnce)
@click.argument("segment_id")
@reason_option
@yes_option
@warehouse_option
@json_option
def exclude(segment_id: str, reason: str, yes: bool, uri: str, as_json: bool) -> None:
    """Let a manoeuvre count no longer: nothing is fitted to it, pooled with it or compared with it."""
    from kempf.flows.jobs.corrections.correct_segments import plan_for
    from kempf.warehouse.storage.store import Warehouse

    warehouse = Warehouse(uri)
    _carry_out(warehouse, plan_for(warehouse, segment_id, "exclude", reason), yes=yes, as_json=as_json)


@click.command("accept", cls=GivenOnce)
@click.argument("segment_id")
@reason_option
@yes_option
@warehouse_option
@json_option
def accept(segment_id: str, reason: str, yes: bool, uri: str, as_json: bool) -> None:
    """Let a manoeuvre count as the search found it, or as it was added: undoes an exclusion and other bounds."""
    from kempf.flows.jobs.corrections.correct_segments import plan_for
    from kempf.warehouse.storage.store import Warehouse

    warehouse = Warehouse(uri)
    _carry_out(warehouse, plan_for(warehouse, segment_id, "accept", reason), yes=yes, as_json=as_json)


@click.command("add", cls=GivenOnce)
@click.argument("log")
@click.option("--start", required=True, metavar="TIME", help="First instant of the manoeuvre, ISO 8601.")
@click.option("--end", required=True, metavar="TIME", help="Last instant of the manoeuvre.")
@reason_option
@yes_option
@warehouse_option
@json_option
def add(log: str, start: str, end: str, reason: str, yes: bool, uri: str, as_json: bool) -> None:
    """Add a zigzag that the search did not find, by its bounds in a log."""
    from kempf.flows.jobs.corrections.correct_segments import plan_new
    from kempf.warehouse.storage.store import Warehouse

    warehouse = Warehouse(uri)
    bounds = utc_ns_of(start, "--start"), utc_ns_of(end, "--end")
    _carry_out(warehouse, plan_new(warehouse, log, bounds, reason), yes=yes, as_json=as_json)


@click.command("corrections", cls=GivenOnce)
@vessel_option()
@warehouse_option
@json_option
def list_corrections(vessel: str | None, uri: str, as_json: bool) -> None:
    """List every correction that was made, with its reason and when."""
    from kempf.schemas.instants import iso_utc
    from kempf.warehouse.storage import append_only
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import corrections, logs, vessels

    warehouse = Warehouse(uri)
    warehouse.require()
    if vessel is not None:
        vessels.require(warehouse, vessel)
    rows = {row.log_id: row for row in logs.current(warehouse, vessel)}
    when = append_only.times(warehouse, "corrections")
    listed: list[dict[str, Any]] = []
    for entry in corrections.all_of(warehouse, rows if vessel is not None else None):
        row, bounds = rows.get(entry.log_id), entry.correction.bounds_utc_ns
        listed.append(
            {
                "number": entry.number,
                "at": when[entry.number].isoformat().replace("+00:00", "Z") if entry.number in when else None,
                "vessel": row.vessel if row else None,
                "log_id": entry.log_id,
                "log": row.file_name if row else None,
                "segment_id": entry.segment_id,
                "action": entry.correction.action,
                "start": iso_utc(bounds[0]) if bounds else None,
                "end": iso_utc(bounds[1]) if bounds else None,
                "reason": entry.correction.reason,
            }
        )
    if as_json:
        print_json(listed)
        return
    head = ["no.", "at", "log", "segment", "action", "start", "end", "reason"]
    print_table(
        head,
        [
            [
                *(str(line["number"]), str(line["at"] or "-")[:19], str(line["log"] or line["log_id"][:12])),
                *(str(line["segment_id"] or "-"), str(line["action"])),
                *(str(line["start"] or "-")[:19], str(line["end"] or "-")[:19], one_line(str(line["reason"]))),
            ]
            for line in listed
        ],
    )


COMMANDS = (correct, exclude, accept, add, list_corrections)


def _carry_out(warehouse: Warehouse, planned: Planned, *, yes: bool, as_json: bool) -> None:
    """Say what a correction changes, ask, and store it."""
    from kempf.flows.jobs.state.out_of_date import command_for

    confirm(_words(planned), yes=yes)
    planned.store(warehouse)
    if as_json:
        print_json(planned.as_json())
        return
    click.echo(f"{_words(planned)}.")
    click.echo(f"next: {command_for([planned.log.vessel])}")


def _words(planned: Planned) -> str:
    """Say what changes, a sentence without its full stop."""
    outcomes = {"correct": "gets other bounds", "exclude": "is excluded", "accept": "counts", "add": "is added"}
    sentence = f"{_described(planned.before or planned.after)} {outcomes[planned.correction.action]}"
    if planned.before is not None and planned.after.segment_id != planned.before.segment_id:
        sentence += f" and is {_described(planned.after)}"
    affected = planned.affected
    current = ", the current one among them" if affected.current else ""
    superseded = f"{counted(len(affected.set_ids), 'parameter set')} of {affected.vessel!r} superseded{current}"
    return "\n".join((f"{sentence}: {superseded}", *(f"  warning: {doubt}" for doubt in planned.doubts)))


def _described(segment: Segment) -> str:
    from kempf.schemas.instants import iso_utc

    span = f"{iso_utc(segment.start_utc_ns)[:19]} to {iso_utc(segment.end_utc_ns)[:19]}"
    return f"{segment.segment_id} ({segment.words}, {span})"
