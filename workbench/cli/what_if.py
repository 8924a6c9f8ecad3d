"""``kempf what-if``."""

from __future__ import annotations

from math import isnan

import click

from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, vessel_option, warehouse_option
from kempf.workbench.numbers import number
from kempf.workbench.terminal import print_json, print_paragraph, print_table, progress_bar


@click.command("what-if", cls=GivenOnce)
@click.argument("parameter")
@vessel_option(required=True)
@click.option("--set", "set_id", metavar="ID", help="Parameter set; default: the current one of the vessel.")
@click.option(
    "--segment",
    "segment_id",
    metavar="ID",
    help="Manoeuvre run freely; default: the one that is predicted worst, of those held out where there are any.",
)
@warehouse_option
@json_option
def command(parameter: str, vessel: str, set_id: str | None, segment_id: str | None, uri: str, as_json: bool) -> None:
    """Move PARAMETER of a set, the others held: what a free run does, and what it costs in likelihood.

    PARAMETER is one of the hull, such as a11, or of an effect, such as rudder_lag.tau; nothing is stored.
    """
    from kempf.flows.jobs.compare.what_if import what_if
    from kempf.warehouse.storage.store import Warehouse

    with progress_bar() as progress:
        answer = what_if(Warehouse(uri), vessel, parameter, set_id, segment_id, progress)
    if as_json:
        print_json(answer.as_json())
        return
    rows = [
        [
            number(t.value),
            number(t.in_std, 2),
            "-" if isnan(t.log_likelihood_falls_by) else f"{0.0 - t.log_likelihood_falls_by:+.3g}",
            number(t.free_run_error_percent, 3),
        ]
        for t in answer.tried
    ]
    print_table(
        [f"{parameter}, {answer.unit}", "standard errors away", "log-likelihood changes by", "free-run error, %"],
        rows,
        f"{answer.parameter_set.parameter_set_id} of {vessel}, {answer.run.segment.segment_id} run freely",
    )
    print_paragraph("the other parameters are held: fitted anew beside it, a value costs less")
    if answer.by_legs:
        print_paragraph("parameters are those fitted to legs, which predictions take: the likelihood prefers others")
