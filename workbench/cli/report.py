"""``kempf report``."""

from __future__ import annotations

from pathlib import Path

import click

from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import beginning_options, json_option, output_option, vessel_option, warehouse_option
from kempf.workbench.terminal import print_json, progress_bar


@click.command("report", cls=GivenOnce)
@vessel_option(required=True)
@beginning_options
@output_option("Write here; default: the vessel's name with .html. Nothing is overwritten.")
@warehouse_option
@json_option
def command(
    vessel: str,
    set_id: str | None,
    model: Path | None,
    files: tuple[Path, ...],
    output: Path | None,
    uri: str,
    as_json: bool,
) -> None:
    """Write the diagnosis of a vessel as one HTML file, with every figure and table in it.

    The file asks for nothing outside itself and can be sent as it is. A diagnosis that `kempf diagnose` stored is read;
    one that is not stored is made first, and stored.
    """
    from kempf.flows.jobs.identify.standing_model import Own
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.chosen_model import chosen_model, read_effect_files
    from kempf.workbench.new_file import require_new, write_new
    from kempf.workbench.report.build import make_report
    from kempf.workbench.report.file_name import called_after

    path = Path(called_after(vessel)) if output is None else output
    require_new(path, "--output")
    warehouse = Warehouse(uri)
    mine = Own(files=read_effect_files(files))
    spec, own = chosen_model(warehouse, vessel, set_id, model, mine)
    own = own.beside(mine)
    with progress_bar() as progress:
        report = make_report(warehouse, vessel, spec, own, progress, say=lambda line: click.echo(line, err=True))
    write_new(path, report.html)
    if as_json:
        print_json(
            {
                "vessel": vessel,
                "diagnosis_id": report.diagnosis_id,
                "verdict": report.content.wording.verdict,
                "headline": report.content.wording.headline,
                "out": str(path),
            }
        )
        return
    click.echo(f"{vessel}: {report.content.wording.headline}")
    click.echo(f"{path}: {len(report.html) / 1e6:.1f} MB, one file, to be opened in any browser", err=True)
