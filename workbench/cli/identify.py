"""``kempf identify``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from kempf.flows.process.progress import Progress
from kempf.pipeline.estimate.names import NAMES
from kempf.schemas.errors import KempfError
from kempf.workbench.cli.options import json_option, vessel_option, warehouse_option
from kempf.workbench.parameter_set_table import tell_set
from kempf.workbench.terminal import print_json, progress

if TYPE_CHECKING:
    from kempf.flows.jobs.identify_vessel import IdentifyOutcome, Request
    from kempf.warehouse.parameter_set import ParameterSet
    from kempf.warehouse.store import Warehouse


@click.command("identify")
@vessel_option(required=True)
@click.option("--model", type=click.Path(path_type=Path), metavar="FILE", help="Model specification in YAML.")
@click.option("--estimator", type=click.Choice(NAMES), default="ml", show_default=True, help="How it is estimated.")
@warehouse_option
@json_option
def command(vessel: str, model: Path | None, estimator: str, uri: str, as_json: bool) -> None:
    """Identify a model from every zigzag of a vessel and store it as a parameter set.

    Maximum likelihood also identifies one hull from all of them together, and tests whether they may be pooled.

    What was identified before from the same inputs, with the same code and settings, is not computed again.
    """
    from kempf.flows.jobs.files import read_model
    from kempf.flows.jobs.identify_vessel import Request, identify_vessel
    from kempf.schemas.model_spec import ModelSpec
    from kempf.warehouse.store import Warehouse

    request = Request(read_model(model) if model else ModelSpec(), estimator)
    with progress() as tell:
        outcomes = identify_vessel(Warehouse(uri), vessel, request, progress=tell)
        pooled = _pooled(Warehouse(uri), vessel, request, outcomes, tell)
    if as_json:
        print_json([*(_show(outcome) for outcome in outcomes), *([pooled.show()] if pooled else [])])
    else:
        for outcome in outcomes:
            _tell(outcome)
        if pooled is not None:
            tell_set(pooled, f"{len(pooled.segment_ids)} zigzags pooled: {pooled.parameter_set_id}")
            out = len(outcomes) - len(pooled.segment_ids)
            if out:
                click.echo(
                    f"  {out} zigzags are not in it: broken off, not converged, or the same manoeuvre in another log"
                )
        click.echo(f"next: kempf history --vessel {vessel}, kempf params show ID, kempf rerun ID")
    failed = [outcome.error for outcome in outcomes if outcome.error is not None]
    if failed and len(failed) == len(outcomes):
        sys.exit(max(error.exit_code for error in failed))


def _pooled(
    warehouse: Warehouse, vessel: str, request: Request, outcomes: list[IdentifyOutcome], tell: Progress
) -> ParameterSet | None:
    """Return the set that all zigzags share; where they share none the reason goes to stderr."""
    from kempf.flows.jobs.pool_vessel import pool_vessel

    try:
        found = pool_vessel(warehouse, vessel, request, outcomes, progress=tell)
    except KempfError as error:
        click.echo(f"not pooled [{error.code}] {error}", err=True)
        return None
    return found[0] if found else None


def _show(outcome: IdentifyOutcome) -> object:
    if outcome.parameter_set is not None:
        return outcome.parameter_set.show()
    assert outcome.error is not None
    return {"segment_id": outcome.segment.segment_id, **outcome.error.to_json()}


def _tell(outcome: IdentifyOutcome) -> None:
    segment = outcome.segment
    named = f"{segment.psi0_deg:g}/{segment.delta0_deg:g} zigzag {segment.segment_id}"
    if outcome.parameter_set is None:
        assert outcome.error is not None
        click.echo(f"{named}: not identified [{outcome.error.code}] {outcome.error}", err=True)
        return
    tell_set(outcome.parameter_set, f"{named}: {outcome.parameter_set.parameter_set_id}")
