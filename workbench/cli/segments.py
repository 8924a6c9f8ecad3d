"""``kempf segments``, and ``kempf segments correct|exclude|accept|add|corrections``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from kempf.schemas.errors import UsageError
from kempf.workbench.cli import correct_segments
from kempf.workbench.cli.given_once import GivenOnceGroup
from kempf.workbench.cli.options import json_option, vessel_option, warehouse_option
from kempf.workbench.numbers import number
from kempf.workbench.terminal import one_line, print_json, print_note, print_table, short_ids

if TYPE_CHECKING:
    from kempf.warehouse.tables.segments import Segment


#: overshoots of a zigzag that a row has room for; the criteria are about the first two
_OVERSHOOTS = 4


@click.group("segments", cls=GivenOnceGroup, invoke_without_command=True)
@vessel_option()
@warehouse_option
@json_option
@click.pass_context
def command(context: click.Context, vessel: str | None, uri: str, as_json: bool) -> None:
    """List the manoeuvres found: zigzags with overshoots and IMO criteria, and what is kept for validation.

    A manoeuvre is corrected by one of the commands below; nothing is lost by it.
    """
    if context.invoked_subcommand is None:
        _list(vessel, uri, as_json)
    elif context.get_parameter_source("uri") is ParameterSource.COMMANDLINE or vessel or as_json:
        raise UsageError(
            "option_before_command",
            f"Options stand behind `{context.invoked_subcommand}`, not before it.",
            f"Write kempf segments {context.invoked_subcommand} ... with the options behind.",
        )


for _one in correct_segments.COMMANDS:
    command.add_command(_one)


def _list(vessel: str | None, uri: str, as_json: bool) -> None:
    from kempf.flows.jobs.state.out_of_date import said_of_logs
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.documents.manoeuvres import listed_manoeuvres

    warehouse = Warehouse(uri)
    listed = listed_manoeuvres(warehouse, vessel)
    print_note(said_of_logs(warehouse, vessel))
    if as_json:
        print_json(listed.documents)
        return
    segments = listed.found
    file_of = {s.segment_id: log["log"] for s, log in zip(segments, listed.documents, strict=True)}
    short = short_ids(segment.segment_id for segment in segments)
    zigzags = [segment for segment in segments if segment.is_zigzag]
    if zigzags:
        _print_zigzags(zigzags, short, file_of)
    else:
        click.echo("No zigzag found" + (f" in the logs of {vessel}." if vessel else "."))
    for segment, document in zip(segments, listed.documents, strict=True):
        if segment.excluded is not None:
            click.echo(f"{short[segment.segment_id]} is excluded: {one_line(segment.excluded)}")
        for words in document["marks"]:
            click.echo(f"{short[segment.segment_id]}: {words}")
    for segment in segments:
        if not segment.is_zigzag:
            _print_other(segment, short[segment.segment_id])
    for log in {document["ingest_id"]: document for document in listed.documents}.values():
        for words in log["channels"]:
            click.echo(f"warning: {one_line(log['log'])}: {one_line(words)}")


def _print_zigzags(zigzags: Sequence[Segment], short: Mapping[str, str], file_of: Mapping[str, str]) -> None:
    """Print a table, a zigzag a row; with the log where those of several logs begin alike."""
    from kempf.schemas.instants import iso_utc
    from kempf.workbench.documents.manoeuvres import logs_begin_alike

    by_vessel: dict[str, list[tuple[str, str]]] = {}
    for s in zigzags:
        by_vessel.setdefault(s.vessel, []).append((iso_utc(s.start_utc_ns), s.log_id))
    alike = any(map(logs_begin_alike, by_vessel.values()))
    rows = [
        [
            short[s.segment_id],
            *([one_line(file_of[s.segment_id])] if alike else []),
            s.vessel,
            f"{s.psi0_deg:g}/{s.delta0_deg:g}" if s.kind == "zigzag" else s.words,
            s.first_side,
            number(s.base_heading_deg),
            iso_utc(s.start_utc_ns)[:16],
            _overshoots(s.overshoots_deg),
            _imo(s.imo),
        ]
        for s in zigzags
    ]
    head = ["segment", *(["log"] if alike else []), "vessel", "zigzag", "first side", "K0 deg", "start UTC"]
    print_table([*head, "overshoots deg", "IMO"], rows)
    click.echo("zigzag: heading at which the rudder is reversed / rudder angle, deg; K0: heading before it")
    if any(len(s.overshoots_deg) > _OVERSHOOTS for s in zigzags):
        click.echo("(+2): two more overshoots, which --json has")


def _overshoots(angles_deg: Sequence[float]) -> str:
    """Write the first overshoots, and how many more there are."""
    more = len(angles_deg) - _OVERSHOOTS
    return " ".join(f"{angle:.1f}" for angle in angles_deg[:_OVERSHOOTS]) + (f" (+{more})" if more > 0 else "")


def _print_other(segment: Segment, short: str) -> None:
    """Print a manoeuvre that is no zigzag: what it was, then a figure a line, 95 % intervals in brackets."""
    from kempf.schemas.instants import iso_utc
    from kempf.workbench.cli.manoeuvre_words import figures, headline

    start = iso_utc(segment.start_utc_ns)[:16]
    use = "fitted" if segment.is_fitted else "kept for validation"
    click.echo(f"{short} {segment.vessel} {start}, {use}: {headline(segment)}")
    for line in figures(segment):
        click.echo(f"  {line}")


def _imo(criteria: object) -> str:
    assert isinstance(criteria, dict)
    judged = [c["passed"] for c in criteria.values() if c["passed"] is not None]
    return "n/a" if not judged else "passed" if all(judged) else "FAILED"
