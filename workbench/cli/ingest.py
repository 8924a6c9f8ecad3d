"""``kempf ingest``."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kempf.schemas.enumeration import counted
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import (
    json_option,
    new_vessel_option,
    profile_option,
    verbose_option,
    vessel_option,
    warehouse_option,
)
from kempf.workbench.ranked_warnings import of_several, show_warnings
from kempf.workbench.terminal import one_line, print_json, progress_bar

if TYPE_CHECKING:
    from kempf.flows.jobs.ingest.ingest_logs import IngestOutcome
    from kempf.pipeline.ingest.readings import Tally


@click.command("ingest", cls=GivenOnce)
@click.argument("paths", nargs=-1, required=True, type=click.Path(path_type=Path))
@vessel_option()
@new_vessel_option("She is new: a name beside those of the warehouse is no slip of the hand.")
@profile_option
@verbose_option
@warehouse_option
@json_option
def command(
    paths: tuple[Path, ...],
    vessel: str | None,
    new_vessel: bool,
    profiles: tuple[Path, ...],
    verbose: bool,
    uri: str,
    as_json: bool,
) -> None:
    """Take raw logs in: MCAP, NMEA 0183 or delimited text, also compressed. Of a folder all files are taken.

    Each log is read, checked, kept byte for byte and searched for manoeuvres. A log that is in already changes nothing.
    One that cannot be read stops none of the others, and leaves nothing behind.
    """
    from kempf.flows.jobs.ingest.files import logs_in, read_profiles
    from kempf.flows.jobs.ingest.ingest_logs import ingest
    from kempf.warehouse.storage.store import Warehouse

    paths, beside = logs_in(paths)
    profile = read_profiles(profiles or beside) if profiles or beside else None
    with progress_bar() as progress:
        outcomes = ingest(Warehouse(uri), paths, vessel, profile, progress, new_vessel=new_vessel)
    failed = [outcome.error for outcome in outcomes if outcome.error is not None]
    if len(outcomes) == 1 and failed:
        raise failed[0]
    if as_json:
        print_json([outcome.as_json() for outcome in outcomes])
    else:
        print_outcomes(outcomes, verbose=verbose)
        if any(outcome.segments for outcome in outcomes):
            click.echo("next: kempf segments, kempf identify --vessel NAME")
    if failed:
        sys.exit(max(error.exit_code for error in failed))


def print_outcomes(outcomes: Sequence[IngestOutcome], *, verbose: bool = False, notes: bool = True) -> None:
    """Print what became of some logs, then what is to be said of their channels and of how they were read."""
    for outcome in outcomes:
        _print_outcome(outcome)
    for outcome in outcomes:
        _print_channels(outcome, named=len(outcomes) > 1)
    if notes:
        remarks: dict[str, list[str]] = {}
        for outcome in outcomes:
            remarks.setdefault(one_line(Path(outcome.path).name), []).extend(outcome.notes)
        every = [f"{name}: {note}" if len(remarks) > 1 else note for name, of_log in remarks.items() for note in of_log]
        show_warnings(every if verbose else of_several(remarks), verbose=verbose, word="note")


def _print_outcome(outcome: IngestOutcome) -> None:
    """Print what became of one log."""
    name = one_line(Path(outcome.path).name)
    if outcome.error is not None or outcome.tally is None:
        assert outcome.error is not None
        click.echo(f"{name}: {click.style('failed', fg='red')} [{outcome.error.code}] {outcome.error}", err=True)
        return
    click.echo(f"{name}: {outcome.outcome}, {_ledger(outcome.tally)}; {_found(outcome)}")
    if outcome.was_removed is not None:
        label = click.style("removed before", fg="yellow")
        click.echo(f"  {label}: this log had been removed ({one_line(outcome.was_removed)}); now it counts again")
    if outcome.lost:
        from kempf.flows.jobs.ingest.unreadable_stretches import as_json

        times = [
            stretch["since"] or stretch["until"]
            for stretch in as_json(outcome.lost)
            if stretch["since"] or stretch["until"]
        ]
        many = f"{len(outcome.lost)} stretch{'es' if len(outcome.lost) > 1 else ''} of this log could not be read"
        from_then = f", the first from {times[0]} on" if times else ""
        click.echo(f"  {click.style('partial', fg='yellow')}: {many}{from_then}")


def _ledger(tally: Tally) -> str:
    """Say what was read of a log: records, and the values of those kept where some are rejected; both sums close."""
    reasons = ", ".join(f"{count} {reason}" for reason, count in tally.by_reason.items())
    sentence = f"{tally.records_read} records read = {tally.records_kept} kept + {tally.records_rejected} rejected"
    if tally.values_rejected:
        sentence += (
            f"; {tally.values_read} values in the kept ones = {tally.values_kept} kept + "
            f"{tally.values_rejected} rejected"
        )
        return f"{sentence}; rejected records and values by reason: {reasons}"
    return f"{sentence} ({reasons})" if reasons else sentence


def _print_channels(outcome: IngestOutcome, *, named: bool = False) -> None:
    """Print what the channel doctor found in a log, nothing where it is clean; its name before it where asked."""
    examination = outcome.examination
    if examination is None or examination.verdict not in ("faults", "failed"):
        return
    for words in examination.findings or (str(examination.content.get("why", "")),):
        label = "channels" if examination.verdict == "faults" else "the channel doctor failed"
        of = f" of {one_line(Path(outcome.path).name)}" if named else ""
        click.echo(f"  {click.style(label, fg='yellow')}{of}: {one_line(words)[:600]}")
    if examination.findings and outcome.log_id:
        click.echo(f"  next: kempf doctor {outcome.log_id[:12]}")


def _found(outcome: IngestOutcome) -> str:
    """Say which zigzags were found, and behind them what else."""
    zigzags = [
        f"{s.psi0_deg:g}/{s.delta0_deg:g} to {s.first_side}{' (broken off)' if s.kind != 'zigzag' else ''}"
        for s in outcome.segments
        if s.is_zigzag
    ]
    irregular = len(outcome.segments) - len(zigzags)
    parts = [f"{counted(len(zigzags), 'zigzag')}: {', '.join(zigzags)}" if zigzags else "no zigzag"]
    parts += [counted(irregular, "random manoeuvre")] if irregular else []
    others = [f"{s.words} with {s.delta0_deg:.3g} deg to {s.first_side}" for s in outcome.others]
    return "; ".join([*parts, *([f"kept for validation: {', '.join(others)}"] if others else [])])
