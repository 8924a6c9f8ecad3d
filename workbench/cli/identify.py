"""``kempf identify``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kempf.flows.process.progress import Progress
from kempf.pipeline.estimate.names import NAMES
from kempf.schemas.enumeration import counted
from kempf.schemas.errors import KempfError, NotFound
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, verbose_option, vessel_option, warehouse_option
from kempf.workbench.parameter_set_table import print_parameter_set
from kempf.workbench.ranked_warnings import MOST
from kempf.workbench.terminal import print_json, progress_bar

if TYPE_CHECKING:
    from kempf.flows.jobs.identify.identify_vessel import IdentifyOutcome, Request
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables.parameter_set import ParameterSet


@click.command("identify", cls=GivenOnce)
@vessel_option(required=True)
@click.option("--model", metavar="FILE|ID", help="Model file, YAML, or a parameter set whose model it is.")
@click.option("--effect-file", "files", multiple=True, type=click.Path(path_type=Path), metavar="FILE",
              help="An effect of your own that the model file names, YAML. May be repeated.")  # fmt: skip
@click.option("--estimator", type=click.Choice(NAMES), default="ml", show_default=True, help="How it is estimated.")
@verbose_option
@warehouse_option
@json_option
def command(
    vessel: str,
    model: str | None,
    files: tuple[Path, ...],
    estimator: str,
    verbose: bool,
    uri: str,
    as_json: bool,
) -> None:
    """Identify a model from every manoeuvre of a vessel and store it as a parameter set.

    Maximum likelihood also identifies one hull from all of them together. A model file may name effects; they are
    estimated with the hull, from each manoeuvre and from all of them.

    What was identified before from the same inputs, with the same code and settings, is not computed again.
    """
    from kempf.flows.jobs.identify.default_model import default_model_of
    from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
    from kempf.flows.jobs.identify.standing_model import Own
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.chosen_model import named_model, read_effect_files

    warehouse = Warehouse(uri)
    mine = Own(files=read_effect_files(files))
    spec, own = named_model(warehouse, vessel, model, mine) if model else (default_model_of(warehouse, vessel), Own())
    request = Request(spec, estimator, own=own.beside(mine))
    with progress_bar() as progress:
        outcomes = identify_vessel(warehouse, vessel, request, progress=progress)
        pooled, alone = _pooled(warehouse, vessel, request, outcomes, progress)
    if as_json:
        print_json([*(_show(outcome, alone) for outcome in outcomes), *([pooled.as_json()] if pooled else [])])
    else:
        if pooled is not None:
            held = len(pooled.convergence.get("held_out", ()))
            title = f"{counted(len(pooled.segment_ids) - held, 'manoeuvre')} pooled"
            title += f", {held} held out: {pooled.parameter_set_id}" if held else f": {pooled.parameter_set_id}"
            print_parameter_set(pooled, title, verbose=verbose)
            _print_alone(alone, verbose=verbose)
        for outcome in outcomes:
            _print_outcome(outcome, verbose=verbose)
        _print_current(warehouse, vessel, pooled)
        click.echo(f"next: kempf history --vessel {vessel}, kempf params show ID, kempf rerun ID")
    failed = [outcome.error for outcome in outcomes if outcome.error is not None]
    if failed and len(failed) == len(outcomes):
        sys.exit(max(error.exit_code for error in failed))


def _pooled(
    warehouse: Warehouse, vessel: str, request: Request, outcomes: list[IdentifyOutcome], progress: Progress
) -> tuple[ParameterSet | None, dict[str, str]]:
    """Return the set that all manoeuvres share, and why each of the others is not in it.

    Where they share none the reason goes to stderr.
    """
    from kempf.flows.jobs.identify.pool_vessel import not_pooled, pool_vessel

    try:
        pooled = pool_vessel(warehouse, vessel, request, outcomes, progress=progress)
    except KempfError as error:
        click.echo(f"not pooled [{error.code}] {error}", err=True)
        return None, not_pooled(warehouse, vessel, request, outcomes, error)
    alone = not_pooled(warehouse, vessel, request, outcomes, pooled[0] if pooled else None)
    for why in dict.fromkeys(alone.values()) if pooled is None else ():
        click.echo(f"not pooled: {why}", err=True)
    return (pooled[0] if pooled else None), alone


def _print_alone(alone: dict[str, str], *, verbose: bool) -> None:
    """Say which manoeuvres are not in the pooled set, those of one reason together."""
    for why in dict.fromkeys(alone.values()):
        names = [name for name, reason in alone.items() if reason == why]
        more = f" and {len(names) - MOST} more" if len(names) > MOST and not verbose else ""
        shown = names if verbose else names[:MOST]
        click.echo(f"  not in it: {counted(len(names), 'manoeuvre')}, {', '.join(shown)}{more}: {why}")


def _print_current(warehouse: Warehouse, vessel: str, pooled: ParameterSet | None) -> None:
    """Say which set every command takes from now on, and why it is not the pooled one where it is not."""
    from kempf.flows.jobs.identify.chosen_set import chosen_set

    try:
        current, _ = chosen_set(warehouse, vessel)
    except NotFound as error:
        withdrawn = "withdrawn" in error.details
        click.echo(f"current of {vessel}: {error if withdrawn else 'no set; none of them converged'}")
        return
    name, model = current.parameter_set_id, current.model_name
    basis = "pooled" if len(current.segment_ids) > 1 else "one manoeuvre"
    click.echo(f"current of {vessel}: {name}, {model}, {basis}")
    if pooled is not None and pooled.parameter_set_id != name:
        click.echo(f"  it stays; to have the pooled one: kempf params alias current {pooled.parameter_set_id}")


def _show(outcome: IdentifyOutcome, alone: dict[str, str]) -> object:
    name = outcome.segment.segment_id
    why = {"not_pooled": alone[name]} if name in alone else {}
    if outcome.parameter_set is not None:
        return {**outcome.parameter_set.as_json(), **why}
    assert outcome.error is not None
    return {"segment_id": name, **outcome.error.as_json(), **why}


def _print_outcome(outcome: IdentifyOutcome, *, verbose: bool) -> None:
    segment = outcome.segment
    named = f"{segment.words} {segment.segment_id}"
    if outcome.parameter_set is None:
        assert outcome.error is not None
        click.echo(f"{named}: not identified [{outcome.error.code}] {outcome.error}", err=True)
        return
    print_parameter_set(outcome.parameter_set, f"{named}: {outcome.parameter_set.parameter_set_id}", verbose=verbose)
