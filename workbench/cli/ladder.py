"""``kempf ladder``."""

from __future__ import annotations

from collections.abc import Mapping
from math import isnan
from typing import Any

import click

from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, vessel_option, warehouse_option
from kempf.workbench.terminal import number, print_json, print_note, print_table, short_ids

#: columns of the error one leg ahead, and of that of free runs
LEG = ("leg: fitted", "left out", "held out")
FREE = ("free: fitted", "held out")


@click.command("ladder", cls=GivenOnce)
@vessel_option(required=True)
@warehouse_option
@json_option
def command(vessel: str, uri: str, as_json: bool) -> None:
    """Show the models that lead to a vessel's current one, and how the error fell from one to the next."""
    from kempf.flows.jobs.out_of_date import said_of_vessel
    from kempf.warehouse.store import Warehouse
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
    for rung in rungs:
        wind = rung["disturbance_intensity"]["wind_force_m_s2_per_sqrt_s"]
        own = {n.partition(".")[2]: v for n, v in rung["effects"].items() if n.partition(".")[0] == rung["added"]}
        sizes = [_size(name, size) for name, size in own.items()]
        rows.append(
            [
                str(rung["step"]),
                rung["added"] or "plain model",
                ", ".join(sizes) or "-",
                *leg_percent(rung),
                free_run_percent(rung["in_sample_error"], rung["in_sample"]),
                free_run_percent(rung["held_out_error"], rung["held_out"]),
                number(wind, 2),
                ids[rung["parameter_set_id"]],
            ]
        )
    head = ["step", "added", "size, ± 1 s.e.", *LEG, *FREE, "wind, m/s^2/s^0.5", "set"]
    print_table(head, rows, f"{vessel}: error, % of the motion")


def leg_percent(rung: Mapping[str, Any]) -> list[str]:
    """Return the error one leg ahead of fitted, left-out and held-out manoeuvres as percent of the motion."""
    ahead = rung.get("one_leg_ahead")
    if ahead is None:
        return ["-", "-", "-"]
    samples = [list(ahead[f"{name}_percent"].values()) for name in ("fitted", "left_out", "held_out")]
    return ["-" if not s else "diverges" if None in s else number(sum(s) / len(s), 3) for s in samples]


def free_run_percent(error: float | None, runs: Mapping[str, Any]) -> str:
    """Return the free-run error of some manoeuvres as percent of the motion, ``diverges`` where one has none."""
    if not runs:
        return "-"
    return "diverges" if error is None or isnan(error) else number(100 * error, 3)


def _size(name: str, size: dict[str, Any]) -> str:
    unit = size.get("unit") or ""
    return f"{name} {number(size['value'])} ± {number(size['std'], 2)}{'' if unit in ('', '1') else ' ' + unit}"
