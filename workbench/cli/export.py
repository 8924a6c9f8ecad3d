"""``kempf export yaml|csv|control|mat|mcap``: a parameter set, or runs and predictions, as a file for others."""

from __future__ import annotations

from collections.abc import Callable
from math import radians
from pathlib import Path
from typing import Any, TypeVar

import click

from kempf.schemas.errors import UsageError
from kempf.workbench.cli.options import json_option, vessel_option, warehouse_option
from kempf.workbench.terminal import print_json, progress

F = TypeVar("F", bound=Callable[..., Any])


@click.group("export")
def command() -> None:
    """Write a parameter set, or runs with their predictions, as a file that other programs read.

    A unique beginning of its id is enough. Without --out it goes to stdout. Nothing is overwritten.
    """


def _file_options(function: F) -> F:
    out = click.option(
        "--out", type=click.Path(path_type=Path), metavar="FILE", help="Write here instead of to stdout."
    )
    return click.argument("set_id")(out(warehouse_option(json_option(function))))


def _linear_options(function: F) -> F:
    speed = click.option("--speed", type=float, metavar="M/S", help="Speed through the water; default: the trial's.")
    step = click.option("--step", type=float, default=1.0, show_default=True, help="Step of the discrete system, s.")
    course = click.option(
        "--course", type=float, default=0.0, show_default=True, help="Course that the heading is counted from, degrees."
    )
    return speed(step(course(_file_options(function))))


@command.command("yaml")
@_file_options
def yaml_file(set_id: str, out: Path | None, uri: str, as_json: bool) -> None:
    """Values, units, standard errors, covariance, noise, fit, inputs by hash, parent, as YAML."""
    _text("yaml", set_id, out, uri, as_json)


@command.command("csv")
@_file_options
def csv_file(set_id: str, out: Path | None, uri: str, as_json: bool) -> None:
    """Parameters, discrete parameters and noise levels with standard errors and units, as CSV."""
    _text("csv", set_id, out, uri, as_json)


@command.command("control")
@_linear_options
def control_file(
    set_id: str, out: Path | None, uri: str, as_json: bool, speed: float | None, step: float, course: float
) -> None:
    """State space as a Python module for python-control: named systems, noise, covariance."""
    from kempf.workbench.export import as_control

    model = _linear(uri, set_id, speed, step, course)
    _deliver("control", model.ship.parameter_set.parameter_set_id, as_control(model), out, as_json)


@command.command("mat")
@_linear_options
def mat_file(
    set_id: str, out: Path | None, uri: str, as_json: bool, speed: float | None, step: float, course: float
) -> None:
    """State space as a MATLAB file; there: load FILE, then ss(A, B, C, D) or ss(Ad, Bd, C, D, step_s)."""
    from kempf.workbench.export import as_mat

    if out is None:
        raise UsageError(
            "no_file_given", "A MATLAB file is not text and does not go to stdout.", "Give a file with --out FILE.mat."
        )
    model = _linear(uri, set_id, speed, step, course)
    _deliver("mat", model.ship.parameter_set.parameter_set_id, as_mat(model), out, as_json)


@command.command("mcap")
@vessel_option(required=True)
@click.option("--set", "set_id", metavar="ID", help="Parameter set, by id or alias; default: current.")
@click.option(
    "--output", "--out", "out", type=click.Path(path_type=Path), metavar="FILE", required=True, help="Write here."
)
@warehouse_option
@json_option
def mcap_file(vessel: str, set_id: str | None, out: Path, uri: str, as_json: bool) -> None:
    """Measured and predicted channels of a vessel's runs side by side, for Foxglove and PlotJuggler.

    One step ahead with 95 % intervals, and the free run; UTC nanoseconds, JSON messages with a schema, zstd.
    """
    from kempf.flows.jobs.compare_vessel import compare_vessel
    from kempf.warehouse.store import Warehouse
    from kempf.workbench.export import write_new
    from kempf.workbench.export_mcap import about, to_mcap
    from kempf.workbench.new_file import require_new

    require_new(out, "--output")
    with progress() as tell:
        found = compare_vessel(Warehouse(uri), vessel, set_id, "1", tell)
    data = to_mcap(found.runs, about(found))
    write_new(out, data, "--output")
    name = found.parameter_set.parameter_set_id
    if as_json:
        told = {"vessel": vessel, "parameter_set_id": name, "format": "mcap", "out": str(out), "runs": len(found.runs)}
        print_json({**told, "skipped": found.skipped})
    else:
        click.echo(f"{vessel}, {name}: {len(found.runs)} runs written to {out}", err=True)


def _linear(uri: str, set_id: str, speed: float | None, step: float, course: float) -> Any:
    from kempf.flows.jobs.ship_model import known_ship
    from kempf.warehouse.store import Warehouse
    from kempf.workbench.export import linear

    return linear(known_ship(Warehouse(uri), set_id, speed), step, radians(course))


def _text(form: str, set_id: str, out: Path | None, uri: str, as_json: bool) -> None:
    from kempf.warehouse import parameter_sets
    from kempf.warehouse.store import Warehouse
    from kempf.workbench.export import as_text

    one = parameter_sets.get(Warehouse(uri), set_id)
    _deliver(form, one.parameter_set_id, as_text(one, form), out, as_json)


def _deliver(form: str, name: str, content: str | bytes, out: Path | None, as_json: bool) -> None:
    from kempf.workbench.export import write_new

    if out is not None:
        write_new(out, content, "--out")
    text = content if isinstance(content, str) and out is None else None
    if as_json:
        print_json({"parameter_set_id": name, "format": form, "out": str(out) if out else None, "text": text})
    elif out is not None:
        click.echo(f"{name}: {form} written to {out}", err=True)
    else:
        click.echo(text, nl=False)
