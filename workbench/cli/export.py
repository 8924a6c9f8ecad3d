"""``kempf export yaml|csv|control|mat|mcap``: a parameter set, or runs and predictions, as a file for others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from kempf.schemas.enumeration import counted
from kempf.schemas.errors import NotFound, UsageError
from kempf.workbench.cli.given_once import GivenOnceGroup
from kempf.workbench.cli.options import json_option, output_option, set_argument, vessel_option, warehouse_option
from kempf.workbench.terminal import print_json, print_note, progress_bar

if TYPE_CHECKING:
    from kempf.flows.jobs.compare.compare_vessel import Comparison

F = TypeVar("F", bound=Callable[..., Any])


@click.group("export", cls=GivenOnceGroup)
def command() -> None:
    """Write a parameter set, or manoeuvres with their predictions, as a file that other programs read.

    An id, a unique beginning of one, or an alias names the set; default: current. Without --output it goes to stdout.
    Nothing is overwritten.
    """


def _file_options(function: F) -> F:
    return set_argument(output_option()(warehouse_option(json_option(function))))


def _linear_options(function: F) -> F:
    speed = click.option("--speed", type=float, metavar="M/S", help="Speed through the water; default: the trial's.")
    step = click.option("--step", type=float, default=1.0, show_default=True, help="Step of the discrete system, s.")
    course = click.option(
        "--course", type=float, default=0.0, show_default=True, help="Course that the heading is counted from, degrees."
    )
    return speed(step(course(_file_options(function))))


@command.command("yaml")
@_file_options
def yaml_file(**given: Any) -> None:
    """Values, units, standard errors, covariance, noise, fit, inputs by hash, parent, as YAML."""
    _text("yaml", **given)


@command.command("csv")
@_file_options
def csv_file(**given: Any) -> None:
    """Parameters, discrete parameters and noise levels with standard errors and units, as CSV."""
    _text("csv", **given)


@command.command("tables")
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False))
@click.option(
    "--format",
    "file_format",
    type=click.Choice(["parquet", "csv"]),
    default="parquet",
    show_default=True,
    help="Of the files.",
)
@warehouse_option
@json_option
def tables(folder: Path, file_format: str, uri: str, as_json: bool) -> None:
    """Parameters over time, manoeuvres, logs and runs of the fleet, a file each for SQL or a spreadsheet.

    Files of an earlier call in FOLDER are replaced, each all at once.
    """
    from kempf.warehouse.queries.views import VIEWS
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.new_file import replaced

    warehouse = Warehouse(uri)
    warehouse.require()
    rows = {}
    for name, view in VIEWS.items():
        frame = view(warehouse)
        with replaced(folder / f"{name}.{file_format}") as passing:
            frame.write_parquet(passing) if file_format == "parquet" else frame.write_csv(passing)
        rows[name] = frame.height
    if as_json:
        print_json({"folder": str(folder), "rows": rows})
    else:
        for name, count in rows.items():
            click.echo(f"{folder / name}.{file_format}: {counted(count, 'row')}")


@command.command("control")
@_linear_options
def control_file(output: Path | None, as_json: bool, **asked: Any) -> None:
    """State space as a Python module for python-control: named systems, noise, covariance."""
    from kempf.workbench.export import as_control

    model = _linear(**asked)
    _deliver("control", model.ship.parameter_set.parameter_set_id, as_control(model), output, as_json)


@command.command("mat")
@_linear_options
def mat_file(output: Path | None, as_json: bool, **asked: Any) -> None:
    """State space as a MATLAB file; there: load FILE, then ss(A, B, C, D) or ss(Ad, Bd, C, D, step_s)."""
    from kempf.workbench.export import as_mat

    if output is None:
        raise UsageError(
            "no_file_given",
            "A MATLAB file is not text and does not go to stdout.",
            "Give a file with --output FILE.mat.",
        )
    model = _linear(**asked)
    _deliver("mat", model.ship.parameter_set.parameter_set_id, as_mat(model), output, as_json)


@command.command("mcap")
@vessel_option(required=True)
@click.option("--set", "set_id", metavar="ID", help="Parameter set, by id or alias; default: current.")
@output_option("Write here.", required=True)
@click.option(
    "--segment", "segments", multiple=True, metavar="ID", help="Only this manoeuvre; may be repeated. Default: all."
)
@warehouse_option
@json_option
def mcap_file(
    vessel: str, set_id: str | None, output: Path, segments: tuple[str, ...], uri: str, as_json: bool
) -> None:
    """Measured and predicted channels of a vessel's manoeuvres side by side, for Foxglove and PlotJuggler.

    One step ahead with 95 % intervals, and the free run, with what each leaves, and the position; UTC nanoseconds, JSON
    messages with a schema, zstd.
    """
    from kempf.flows.jobs.compare.compare_vessel import compare_vessel
    from kempf.flows.jobs.compare.measured_positions import measured_positions
    from kempf.flows.jobs.state.out_of_date import said_of_vessel
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.export_mcap import about, to_mcap
    from kempf.workbench.new_file import require_new, write_new

    require_new(output, "--output")
    warehouse = Warehouse(uri)
    with progress_bar() as progress:
        comparison = compare_vessel(warehouse, vessel, set_id, "1", progress)
    print_note(said_of_vessel(warehouse, vessel))
    comparison = _only(comparison, segments) if segments else comparison
    data = to_mcap(comparison.runs, about(comparison), measured_positions(warehouse, comparison.found))
    write_new(output, data)
    name = comparison.parameter_set.parameter_set_id
    if as_json:
        content = {
            "vessel": vessel,
            "parameter_set_id": name,
            "format": "mcap",
            "out": str(output),
            "runs": len(comparison.runs),
        }
        print_json({**content, "skipped": comparison.skipped})
    else:
        click.echo(f"{vessel}, {name}: {counted(len(comparison.runs), 'run')} written to {output}", err=True)


def _only(comparison: Comparison, beginnings: Sequence[str]) -> Comparison:
    """Return a comparison with the runs of some segments alone; a unique beginning of an id is enough."""
    names = [run.name for run in comparison.runs]
    chosen = set()
    for beginning in beginnings:
        named = [name for name in names if name.startswith(beginning)]
        if len(named) != 1:
            raise NotFound(
                "no_segment",
                f"{beginning!r} begins {len(named)} ids of the manoeuvres that the set predicts: {', '.join(names)}.",
                f"Name one of them; `kempf segments --vessel {comparison.vessel}` lists them all.",
                {"segment_id": beginning, "known": names, "skipped": comparison.skipped},
            )
        chosen.update(named)
    pairs = [pair for pair in zip(comparison.runs, comparison.found, strict=True) if pair[0].name in chosen]
    return replace(comparison, runs=tuple(run for run, _ in pairs), found=tuple(segment for _, segment in pairs))


def _linear(set_id: str | None, vessel: str | None, uri: str, speed: float | None, step: float, course: float) -> Any:
    from kempf.flows.jobs.identify.chosen_set import named_set
    from kempf.flows.jobs.identify.ship_model import ship_of_set
    from kempf.flows.jobs.state.out_of_date import said_of_sets
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.export import linear

    warehouse = Warehouse(uri)
    ship = ship_of_set(warehouse, named_set(warehouse, set_id, vessel), speed)
    print_note(said_of_sets(warehouse, [ship.parameter_set]))
    return linear(ship, step, radians(course))


def _text(form: str, set_id: str | None, vessel: str | None, output: Path | None, uri: str, as_json: bool) -> None:
    from kempf.flows.jobs.identify.chosen_set import named_set
    from kempf.flows.jobs.state.out_of_date import said_of_sets
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.export import as_text

    warehouse = Warehouse(uri)
    parameter_set = named_set(warehouse, set_id, vessel)
    print_note(said_of_sets(warehouse, [parameter_set]))
    _deliver(form, parameter_set.parameter_set_id, as_text(parameter_set, form), output, as_json)


def _deliver(form: str, name: str, content: str | bytes, output: Path | None, as_json: bool) -> None:
    from kempf.workbench.new_file import write_new

    if output is not None:
        write_new(output, content)
    text = content if isinstance(content, str) and output is None else None
    if as_json:
        print_json({"parameter_set_id": name, "format": form, "out": str(output) if output else None, "text": text})
    elif output is not None:
        click.echo(f"{name}: {form} written to {output}", err=True)
    else:
        click.echo(text, nl=False)
