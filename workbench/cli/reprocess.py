"""``kempf reprocess``."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import click

from kempf.schemas.enumeration import as_words
from kempf.schemas.errors import DataRejected, ThresholdExceeded
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, vessel_option, warehouse_option
from kempf.workbench.terminal import print_json, print_table, progress_bar


@click.command("reprocess", cls=GivenOnce)
@vessel_option(multiple=True)
@click.option(
    "--changed-only/--everything",
    default=True,
    show_default=True,
    help="Only what changed, or also verify every kept parameter set from the raw bytes.",
)
@click.option(
    "--quality",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="How many findings on logs and models a vessel may have, quality.yaml; beyond that the exit code is 5.",
)
@warehouse_option
@json_option
def command(vessel: tuple[str, ...], changed_only: bool, quality: Path | None, uri: str, as_json: bool) -> None:
    """Bring the whole fleet, or some vessels, up to date with their profiles and the code.

    Where PREFECT_API_URL names a server this is a run of the Prefect flow `reprocess` there; else it is done in this
    process, and no server is started. Vessels of which nothing changed since their last run are not looked at again;
    a single one that is named is.
    """
    from kempf.flows.fleet.report import beyond, findings_in_words
    from kempf.flows.jobs.ingest.files import read_quality
    from kempf.schemas.quality import NO_LIMITS
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import vessels

    limits = read_quality(quality) if quality else NO_LIMITS
    warehouse = Warehouse(uri)
    warehouse.require()
    names = sorted(set(vessel))
    for name in names:
        vessels.require(warehouse, name)
    reports: list[dict[str, Any]]
    if len(names) == 1:
        from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel

        with progress_bar() as progress:
            reports = [reprocess_vessel(warehouse, names[0], changed_only=changed_only, progress=progress).as_json()]
    elif os.environ.get("PREFECT_API_URL"):
        from kempf.flows.fleet.flows import reports_of

        reports = reports_of(uri, names or None, changed_only=changed_only, quality=str(quality) if quality else None)
    else:
        from kempf.flows.fleet.plan import do_fleet

        with progress_bar() as progress:
            reports = do_fleet(warehouse, names or None, changed_only=changed_only, progress=progress)
    bad = {str(report["vessel"]): over for report in reports if (over := beyond(report, limits))}
    if as_json:
        print_json(reports)
    else:
        head = ["vessel", "status", "logs", "reread", "segments", "new_sets", "kept_sets", "verified", "failures"]
        rows = [[str(r[k]) for k in head[:-2]] + [_counts(r["verified"]), str(len(r["failures"]))] for r in reports]
        print_table([as_words(name) for name in head], rows)
        for report in reports:
            for failure in report["failures"]:
                click.echo(f"{report['vessel']}, {failure['what']}: {failure['error']['message']}", err=True)
            if report["findings"]:
                click.echo(f"{report['vessel']}: {findings_in_words(report)}", err=True)
    if any(report["failures"] for report in reports):
        sys.exit(DataRejected.exit_code)
    if bad:
        for name, over in bad.items():
            click.echo(f"{name} is beyond the limits of quality: {', '.join(over)}", err=True)
        sys.exit(ThresholdExceeded.exit_code)


def _counts(verdicts: dict[str, int]) -> str:
    return ", ".join(f"{count} {verdict}" for verdict, count in sorted(verdicts.items())) or "-"
