"""``kempf next-trial``."""

from __future__ import annotations

import click

from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, vessel_option, warehouse_option
from kempf.workbench.numbers import number
from kempf.workbench.terminal import print_json, print_paragraph, print_table, progress_bar


@click.command("next-trial", cls=GivenOnce)
@vessel_option(required=True)
@click.option("--set", "set_id", metavar="ID", help="Parameter set; default: the current one of the vessel.")
@click.option("--parameter", metavar="NAME", help="Halve the interval of this one, such as b2 or cross_flow_drag.c.")
@warehouse_option
@json_option
def command(vessel: str, set_id: str | None, parameter: str | None, uri: str, as_json: bool) -> None:
    """Say which zigzag to sail next, as a sailing order.

    Where models fit alike, as `kempf diagnose` says, the zigzag that parts them; else the one that narrows the
    intervals of the parameters most. What it is worth is worked out by the set's model with the ship's own instruments.
    """
    from kempf.flows.jobs.predict.next_trial import next_trial
    from kempf.warehouse.storage.store import Warehouse

    with progress_bar() as progress:
        document = next_trial(Warehouse(uri), vessel, set_id, parameter, progress).as_json()
    if as_json:
        print_json(document)
        return
    for sentence in document["sentences"]:
        print_paragraph(sentence)
    print_paragraph("")
    for step, line in enumerate(document["order"], start=1):
        print_paragraph(f"{step}. {line}")
    parting = document["trials"][0]["probability"] is not None
    head = ["zigzag", "takes, s", "sea room, m", "errors become, %"]
    head += ["parts the models, %"] if parting else []
    head += [f"{parameter} becomes, %", "to halve it"] if parameter is not None else []
    rows = []
    for trial in document["trials"]:
        sailed = trial["manoeuvre"]
        row = [
            f"{sailed['heading_deg']:g}/{sailed['rudder_deg']:g}{' *' if trial['beyond_what_was_sailed'] else ''}",
            number(trial["duration_s"], 3),
            " x ".join(f"{x:g}" for x in trial["sea_room_m"]),
            number(100.0 * trial["mean_narrowed"], 3),
        ]
        row += [f"{100.0 * trial['probability']:.1f}"] if parting else []
        if parameter is not None:
            times = trial["times_to_halve"]
            row += [number(100.0 * trial["narrowed"][parameter], 3), "more than 64" if times is None else str(times)]
        rows.append(row)
    print_table(head, rows, f"{document['parameter_set_id']} of {vessel}, at {number(document['speed_m_s'], 3)} m/s")
    if any(trial["beyond_what_was_sailed"] for trial in document["trials"]):
        print_paragraph("* the rudder goes beyond what was sailed")
