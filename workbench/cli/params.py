"""``kempf params list|show|diff|export|alias|steering``."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kempf.workbench.cli.given_once import GivenOnceGroup
from kempf.workbench.cli.options import (
    json_option,
    output_option,
    set_argument,
    verbose_option,
    vessel_option,
    warehouse_option,
)
from kempf.workbench.numbers import number
from kempf.workbench.terminal import print_json, print_note, print_table

if TYPE_CHECKING:
    from kempf.pipeline.steering.nomoto import Constant


@click.group("params", cls=GivenOnceGroup)
def command() -> None:
    """List, show, compare and export parameter sets, and what they say of her steering."""


@command.command("list")
@vessel_option()
@warehouse_option
@json_option
def list_sets(vessel: str | None, uri: str, as_json: bool) -> None:
    """List parameter sets, of one vessel or of all."""
    from kempf.flows.jobs.state.out_of_date import said_of_vessel
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.documents.parameter_sets import listed_sets

    warehouse = Warehouse(uri)
    listed = listed_sets(warehouse, vessel)
    if vessel is not None:
        print_note(said_of_vessel(warehouse, vessel))
    if as_json:
        print_json(listed)
        return
    rows = [
        [r["parameter_set_id"], r["vessel"], r["start"][:19], r["model_name"], r["estimator"], ", ".join(r["aliases"])]
        for r in listed
    ]
    print_table(["parameter set", "vessel", "start UTC", "model", "estimator", "alias"], rows)


@command.command("show")
@set_argument
@verbose_option
@warehouse_option
@json_option
def show(set_id: str | None, vessel: str | None, verbose: bool, uri: str, as_json: bool) -> None:
    """Show a parameter set whole: an id, a unique beginning of one, an alias; default: current."""
    from kempf.flows.jobs.identify.chosen_set import named_set
    from kempf.flows.jobs.identify.leg_fit import by_name
    from kempf.flows.jobs.state.out_of_date import said_of_sets
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.parameter_set_table import print_parameter_set

    warehouse = Warehouse(uri)
    parameter_set = named_set(warehouse, set_id, vessel)
    print_note(said_of_sets(warehouse, [parameter_set]))
    if as_json:
        print_json(parameter_set.as_json())
        return
    title = (
        f"{parameter_set.parameter_set_id}: {parameter_set.vessel}, model {parameter_set.model_name}, "
        f"estimator {parameter_set.estimator}"
    )
    print_parameter_set(parameter_set, title, verbose=verbose, legs_too=True)
    print_table(
        ["", "value", "std", "unit"],
        [[p.name, number(p.value), number(p.std, 2), p.unit] for p in parameter_set.discrete],
        f"Discrete, eq. (17), at {number(parameter_set.convergence.get('speed_m_s'))} m/s and a step of "
        f"{number(parameter_set.convergence.get('step_s'))} s"
        + (", by the likelihood's parameters" if by_name(parameter_set) else ""),
    )
    effects = parameter_set.model_spec.get("effects")
    if effects:
        click.echo(f"  of the hull alone, without {', '.join(effects)}; with them: kempf export control")
    origin = parameter_set.provenance
    click.echo(f"  log {', '.join(parameter_set.log_ids)}")
    click.echo(f"  profile {origin['profile_sha256']}, code {origin['code_version']}, commit {origin['git_commit']}")


@command.command("diff")
@click.argument("first")
@click.argument("second")
@vessel_option()
@warehouse_option
@json_option
def diff(first: str, second: str, vessel: str | None, uri: str, as_json: bool) -> None:
    """Compare the parameters of two sets: difference, and the same in standard errors of the difference.

    A parameter that only one of the sets has is shown with a dash for the other. Sets of two vessels are compared
    without dimension too, with K' = K L/V and T' = T V/L of their hulls.
    """
    from kempf.flows.jobs.identify.chosen_set import named_set
    from kempf.flows.jobs.state.out_of_date import said_of_sets
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.documents.compared_sets import compared_sets
    from kempf.workbench.parameter_set_table import print_by_likelihood

    warehouse = Warehouse(uri)
    one, other = named_set(warehouse, first, vessel), named_set(warehouse, second, vessel)
    document = compared_sets(warehouse, one, other)
    print_note(said_of_sets(warehouse, [one, other]))
    if as_json:
        print_json(document)
        return
    head = ["", "first", "second", "difference", "in std errors", "unit"]
    print_table(head, _difference_rows(document["parameters"]))
    if one.vessel != other.vessel and document["nondimensional"] is not None:
        words = "Without their dimension, as ships of other sizes are compared; K' and T' of the hull alone:"
        print_table(head, _difference_rows(document["nondimensional"]), words)
    for each in (one, other):
        print_by_likelihood(each)


def _difference_rows(differences: Mapping[str, Mapping[str, Any]]) -> list[list[str]]:
    return [
        [name, number(d["first"]), number(d["second"]), number(d["difference"]), number(d["in_std"], 3), d["unit"]]
        for name, d in differences.items()
    ]


@command.command("export")
@set_argument
@click.option("--format", "form", type=click.Choice(["yaml", "csv", "json"]), default="yaml", show_default=True)
@output_option()
@warehouse_option
@json_option
def export(set_id: str | None, vessel: str | None, form: str, output: Path | None, uri: str, as_json: bool) -> None:
    """Export a parameter set with values, units, standard errors, covariance, inputs by hash and fit.

    --json is short for --format json.
    """
    from kempf.flows.jobs.identify.chosen_set import named_set
    from kempf.flows.jobs.state.out_of_date import said_of_sets
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.export import as_text
    from kempf.workbench.new_file import write_new

    warehouse = Warehouse(uri)
    parameter_set = named_set(warehouse, set_id, vessel)
    print_note(said_of_sets(warehouse, [parameter_set]))
    text = as_text(parameter_set, "json" if as_json else form)
    if output is None:
        click.echo(text, nl=False)
    else:
        write_new(output, text)


@command.command("alias")
@click.argument("name")
@click.argument("set_id")
@vessel_option()
@warehouse_option
@json_option
def alias(name: str, set_id: str, vessel: str | None, uri: str, as_json: bool) -> None:
    """Let NAME point to a parameter set of its vessel; `current` is what every command takes unless another is named.

    Every command that takes the id of a set takes the name as well. Names move, sets never change.
    """
    from kempf.flows.jobs.identify.chosen_set import named_set
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import aliases

    warehouse = Warehouse(uri)
    parameter_set = named_set(warehouse, set_id, vessel)
    before = aliases.of_vessel(warehouse, parameter_set.vessel).get(name)
    aliases.point(warehouse, parameter_set.vessel, parameter_set.parameter_set_id, name)
    if as_json:
        print_json(
            {
                "vessel": parameter_set.vessel,
                "alias": name,
                "parameter_set_id": parameter_set.parameter_set_id,
                "before": before,
            }
        )
        return
    moved = f", before {before}" if before not in (None, parameter_set.parameter_set_id) else ""
    click.echo(f"{name} of {parameter_set.vessel}: {parameter_set.parameter_set_id}{moved}")


@command.command("steering")
@set_argument
@click.option("--speed", type=float, metavar="M/S", help="Speed through the water; default: that of the trial.")
@verbose_option
@warehouse_option
@json_option
def steering(
    set_id: str | None, vessel: str | None, speed: float | None, verbose: bool, uri: str, as_json: bool
) -> None:
    """Show Nomoto's constants and whether she holds a straight course, with standard errors.

    Of a set with effects these are the constants of its linear model about a straight course; what has no part in it is
    named, and so is a lag of the rudder, which is none of the hull's.
    """
    from kempf.flows.jobs.state.out_of_date import said_of_sets
    from kempf.flows.jobs.steering.steering_of_set import steering_of_set
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.ranked_warnings import show_warnings

    warehouse = Warehouse(uri)
    found = steering_of_set(warehouse, set_id, vessel, speed)
    ship, judged = found.ship, found.stability
    print_note(said_of_sets(warehouse, [ship.parameter_set]))
    if as_json:
        print_json(found.as_json())
        return
    rows = [[c.name, number(c.value), number(c.std, 2), c.unit, _interval(c)] for c in found.nomoto.constants.values()]
    rows += [[p.name, number(p.value), number(p.std, 2), p.unit, "-"] for p in ship.effect_parameters]
    print_table(
        ["", "value", "1 s.e.", "unit", "95 % interval"],
        rows,
        f"{ship.parameter_set.parameter_set_id} at {number(ship.speed_m_s)} m/s",
    )
    click.echo(f"  on a straight course: {judged.verdict}; {judged.reason}")
    for part in judged.real_parts:
        click.echo(f"  {part.name}: real part {number(part.value)} ± {number(part.std, 2)} {part.unit} (1 s.e.)")
    show_warnings(found.warnings, verbose=verbose)


def _interval(constant: Constant) -> str:
    if constant.interval_95 is None:
        return "unbounded" if isfinite(constant.std) else "-"
    return f"{number(constant.interval_95[0])} to {number(constant.interval_95[1])}"
