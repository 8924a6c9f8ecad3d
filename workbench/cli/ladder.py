"""``kempf ladder``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import click

from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, vessel_option, warehouse_option
from kempf.workbench.numbers import number
from kempf.workbench.rungs import Rung, compared, in_words, remarks
from kempf.workbench.terminal import print_json, print_note, print_table, short_ids

#: columns of the error one leg ahead, and of that of free runs
LEG = ("leg: fitted", "left out", "held out")
FREE = ("free: fitted", "held out")


@click.command("ladder", cls=GivenOnce)
@vessel_option(required=True)
@warehouse_option
@json_option
def command(vessel: str, uri: str, as_json: bool) -> None:
    """Show the models that lead to a vessel's current one, and how the error fell from one to the next."""
    from kempf.flows.jobs.state.out_of_date import said_of_vessel
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.documents.ladder import ladder_document

    warehouse = Warehouse(uri)
    rungs = ladder_document(warehouse, vessel)
    print_note(said_of_vessel(warehouse, vessel))
    if as_json:
        print_json(rungs)
    else:
        print_rungs(rungs, vessel)


def print_rungs(rungs: list[dict[str, Any]], vessel: str) -> None:
    """Print rungs of a ladder as a table."""
    ids = short_ids([rung["parameter_set_id"] for rung in rungs])
    rows = []
    beside = compared(rungs)
    for rung, errors in zip(rungs, beside, strict=True):
        wind = rung["disturbance_intensity"]["wind_force_m_s2_per_sqrt_s"]
        rows.append(
            [
                str(rung["step"]),
                rung["added"] or "plain model",
                ", ".join(size.words for size in errors.sizes) or "-",
                *percents(errors),
                number(wind, 2),
                ids[rung["parameter_set_id"]],
            ]
        )
    head = ["step", "added", "size, ± 1 s.e.", *LEG, *FREE, "wind, m/s^2/s^0.5", "set"]
    print_table(head, rows, f"{vessel}: error, % of the motion")
    print_by_legs(beside)
    if len([rung for rung in beside if rung.sizes]) > 1:
        click.echo("  a size is that of its step's model; what the last model says of all: kempf params show")


def percents(errors: Rung) -> list[str]:
    """Return the columns `LEG` and `FREE`."""
    leg, free = errors.leg, errors.free
    return [in_words(error) for error in (leg.fitted, leg.left_out, leg.held_out, free.fitted, free.held_out)]


def print_by_legs(rungs: Sequence[Rung]) -> None:
    """Say where the figures of rungs are with the parameters fitted to legs."""
    for remark in remarks(rungs):
        click.echo(f"  {remark}")
