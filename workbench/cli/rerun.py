"""``kempf rerun``."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from kempf.schemas.errors import DataRejected, ThresholdExceeded, UsageError
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option, vessel_option, warehouse_option
from kempf.workbench.numbers import number
from kempf.workbench.terminal import print_json, print_table, progress_bar

if TYPE_CHECKING:
    from kempf.flows.jobs.reprocess.rerun_all import Verification
    from kempf.flows.jobs.reprocess.rerun_set import Rerun
    from kempf.warehouse.storage.store import Warehouse


@click.command("rerun", cls=GivenOnce)
@click.argument("set_id", required=False)
@click.option("--all", "all_sets", is_flag=True, help="Every parameter set, or with --vessel every one of hers.")
@click.option(
    "--verify/--preview",
    default=True,
    show_default=True,
    help="With --all: compare every set with itself, built again; or say which sets the present code would change.",
)
@vessel_option(multiple=True)
@click.option("--tolerance", type=float, default=1e-9, show_default=True, help="Relative; what still counts as equal.")
@click.option("--afresh", is_flag=True, help="With --all: also sets that this code has verified before.")
@click.option(
    "--adopt",
    is_flag=True,
    help="With --preview: where nothing would change, let the present code count as the one that made what is stored.",
)
@click.option("--unadopt", is_flag=True, help="Take back what --adopt said of the present code.")
@click.option("--fail-above", type=float, metavar="X", help="With --preview: exit code 5 above X standard errors.")
@warehouse_option
@json_option
def command(
    set_id: str | None,
    all_sets: bool,
    verify: bool,
    vessel: tuple[str, ...],
    tolerance: float,
    afresh: bool,
    fail_above: float | None,
    adopt: bool,
    unadopt: bool,
    uri: str,
    as_json: bool,
) -> None:
    """Build a parameter set again from the raw bytes and say whether it is the same, bit for bit.

    Where several vessels have an alias, --vessel says whose is meant.

    Exit code 5 where one is different, 3 where one of --all cannot be built again. Interrupted, --all goes on where it
    stopped when it is called again.
    """
    from kempf.flows.jobs.identify.chosen_set import named_set
    from kempf.warehouse.storage.store import Warehouse

    if unadopt:
        from kempf.workbench.cli.adopted import take_back

        take_back(Warehouse(uri), as_json=as_json)
        return
    if all_sets == (set_id is not None):
        raise UsageError(
            "one_or_all",
            "Either one parameter set or --all was expected, found " + ("both." if all_sets else "neither."),
            "Give the id of one, as `kempf params list` shows it, or --all.",
        )
    if not all_sets and (len(vessel) > 1 or not verify or afresh):
        raise UsageError(
            "only_with_all", "--preview, --afresh and several vessels go with --all.", "Add --all, leave out ID."
        )
    if fail_above is not None and verify:
        raise UsageError("only_with_preview", "--fail-above goes with --preview.", "Add --preview, or leave it out.")
    if adopt and verify:
        raise UsageError("only_with_preview", "--adopt goes with --preview.", "Add --preview, or leave it out.")
    warehouse, vessels = Warehouse(uri), sorted(set(vessel))
    if set_id is not None:
        _one(warehouse, named_set(warehouse, set_id, *vessel).parameter_set_id, tolerance, as_json=as_json)
    elif verify:
        _verify(warehouse, vessels, tolerance, afresh=afresh, as_json=as_json)
    else:
        from kempf.workbench.cli.rerun_preview import preview

        preview(warehouse, vessels, fail_above, adopt=adopt, as_json=as_json)


def _one(warehouse: Warehouse, set_id: str, tolerance: float, *, as_json: bool) -> None:
    from kempf.flows.jobs.reprocess.rerun_set import rerun

    with progress_bar() as progress:
        result = rerun(warehouse, set_id, tolerance, progress)
    if as_json:
        print_json(result.as_json())
    else:
        _print_rerun(result)
    if "different" in (result.verdict, *result.rests_on.values()):
        sys.exit(ThresholdExceeded.exit_code)


def _print_rerun(result: Rerun) -> None:
    click.echo(f"{result.parameter_set_id}: {result.verdict}")
    for name, verdict in result.rests_on.items():
        click.echo(f"  rests on {name}: {verdict}")
    if result.code_changed:
        click.echo("  the code is not the one that made it")
    for name, (then, now) in result.packages_changed.items():
        click.echo(f"  {name} was {then}, is {now}")
    if result.differences:
        rows = [[d.field, str(d.stored), str(d.rebuilt), number(d.relative)] for d in result.differences[:20]]
        print_table(["field", "stored", "rebuilt", "relative"], rows)


def _verify(warehouse: Warehouse, vessels: list[str], tolerance: float, *, afresh: bool, as_json: bool) -> None:
    from kempf.flows.jobs.reprocess.rerun_all import verify_all

    with progress_bar() as progress:
        verification = verify_all(warehouse, vessels, tolerance, afresh=afresh, progress=progress)
    if as_json:
        print_json(verification.as_json())
    else:
        _print_verification(verification)
    counts = verification.counts()
    if counts["failed"]:
        sys.exit(DataRejected.exit_code)
    if counts["different"]:
        sys.exit(ThresholdExceeded.exit_code)


def _print_verification(verification: Verification) -> None:
    this, other = verification.counts(code_changed=False), verification.counts(code_changed=True)
    rows = [[verdict, str(n), str(this[verdict]), str(other[verdict])] for verdict, n in verification.counts().items()]
    print_table(["verdict", "sets", "of this code", "of other code"], rows)
    before = sum(v.known_before for v in verification.verdicts)
    if before:
        click.echo(f"{before} of these were verified before by this code; --afresh builds them again, too.")
    if verification.of_purged_logs:
        click.echo(f"{len(verification.of_purged_logs)} rest on a log that was purged, and cannot be built again.")
    for result in verification.verdicts:
        if result.error is not None:
            click.echo(
                f"{result.vessel}, {result.parameter_set_id}: {result.error.message} {result.error.next_step}", err=True
            )
        elif result.verdict == "different":
            fields = ", ".join(str(d["field"]) for d in result.fields[:3])
            more = f" and {result.differences - 3} more" if result.differences > 3 else ""
            click.echo(f"{result.vessel}, {result.parameter_set_id}: different in {fields}{more}")
