"""``kempf rerun --all --preview``: what the present code would move, as it is shown."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from statistics import median
from typing import TYPE_CHECKING, Any

import click

from kempf.schemas.enumeration import counted
from kempf.schemas.errors import DataRejected, ThresholdExceeded
from kempf.workbench.numbers import number
from kempf.workbench.terminal import print_json, print_table, progress_bar

if TYPE_CHECKING:
    from kempf.flows.jobs.reprocess.parameter_changes import Move
    from kempf.flows.jobs.reprocess.preview_code import VesselPreview
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables.equivalents import Equivalent

#: Lines for a person; --json has all.
_SHOWN, _NAMED = 20, 3


def preview(warehouse: Warehouse, vessels: list[str], fail_above: float | None, *, adopt: bool, as_json: bool) -> None:
    """Show it; exit code 3 where something could not be done, 5 where a parameter moves further than is allowed.

    With ``adopt`` the present code then counts as the one before; where something moves that is refused.
    """
    from kempf.flows.jobs.reprocess.preview_code import preview_all

    with progress_bar() as progress:
        previews = preview_all(warehouse, vessels, progress)
    moves = sorted((m for vessel_preview in previews for m in vessel_preview.moves), key=lambda m: -m.size)
    lines = _by_parameter(moves)
    adopted = _adopted(warehouse, previews) if adopt else []
    if as_json:
        shown = [{k: v for k, v in line.items() if k != "size"} for line in lines]
        print_json(
            {
                **_counts(previews),
                "parameters": shown,
                "vessels": [vessel_preview.as_json() for vessel_preview in previews],
                "moves": [m.as_json() for m in moves],
                **({"adopted": [vars(equivalent) for equivalent in adopted]} if adopt else {}),
            }
        )
    else:
        _print_preview(previews, lines)
        if adopt:
            _print_adopted(adopted)
    if any(vessel_preview.failures for vessel_preview in previews):
        sys.exit(DataRejected.exit_code)
    if fail_above is not None and moves and moves[0].size > fail_above:
        sys.exit(ThresholdExceeded.exit_code)


def _adopted(warehouse: Warehouse, previews: Sequence[VesselPreview]) -> list[Equivalent]:
    from kempf.flows.jobs.reprocess.adopt_code import adopt_code

    return adopt_code(warehouse, previews)


def _print_adopted(adopted: Sequence[Equivalent]) -> None:
    if not adopted:
        click.echo("There is nothing to adopt: the present code counts as the one that made what is stored.")
    for equivalent in adopted:
        click.echo(
            f"adopted: {equivalent.stage} code {equivalent.code} counts as {equivalent.stands_for}, on the evidence of "
            f"{equivalent.sets} sets of {counted(len(equivalent.vessels), 'vessel')}"
        )


def _counts(previews: Sequence[VesselPreview]) -> dict[str, int]:
    return {
        "sets": sum(vessel_preview.sets for vessel_preview in previews),
        "up_to_date": sum(vessel_preview.up_to_date for vessel_preview in previews),
        "identical": sum(vessel_preview.identical for vessel_preview in previews),
        "moved": sum(len({m.parameter_set_id for m in vessel_preview.moves}) for vessel_preview in previews),
        "new": sum(len(vessel_preview.new) for vessel_preview in previews),
        "gone": sum(len(vessel_preview.gone) for vessel_preview in previews),
        "logs_otherwise": sum(len(vessel_preview.logs_otherwise) for vessel_preview in previews),
        "failures": sum(len(vessel_preview.failures) for vessel_preview in previews),
    }


def _by_parameter(moves: Sequence[Move]) -> list[dict[str, Any]]:
    """Return one line a vessel, model, estimator and parameter, the one with the largest move first."""
    of: dict[tuple[str, str, str, str], list[Move]] = {}
    for move in moves:
        of.setdefault((move.vessel, move.model, move.estimator, move.parameter), []).append(move)
    return [
        {
            "vessel": vessel,
            "parameter": parameter,
            "model": model,
            "estimator": estimator,
            "sets": len(group),
            "largest_in_std": group[0].in_std,
            "median_in_std": median(m.size for m in group),
            "std_ratio": group[0].std_ratio,
            "before": group[0].before,
            "after": group[0].after,
            "unit": group[0].unit,
            "parameter_set_id": group[0].parameter_set_id,
            "size": group[0].size,
        }
        for (vessel, model, estimator, parameter), group in of.items()
    ]


def _print_preview(previews: Sequence[VesselPreview], lines: Sequence[dict[str, Any]]) -> None:
    counts = _counts(previews)
    if counts["sets"] == counts["up_to_date"] and not any(
        counts[name] for name in ("new", "failures", "logs_otherwise")
    ):
        click.echo(f"All {counts['sets']} current parameter sets were made by this code.")
        return
    click.echo(
        f"{counts['sets']} current parameter sets: {counts['up_to_date']} made by this code, {counts['identical']} "
        f"bit-identical, {counts['moved']} would change, {counts['gone']} would be withdrawn without replacement, "
        f"{counts['new']} would be new."
    )
    for outcome in previews:
        if outcome.logs_otherwise:
            names = ", ".join(outcome.logs_otherwise[:_NAMED]) + (" ..." if outcome.logs_otherwise[_NAMED:] else "")
            click.echo(
                f"{outcome.vessel}: in {len(outcome.logs_otherwise)} of {outcome.logs} logs other things are read "
                f"or found: {names}"
            )
    if lines:
        head = ["vessel", "parameter", "largest change in s.e.", "median", "s.e. ratio", "before", "after", "unit"]
        head += ["sets", "estimator", "model", "parameter set"]
        rows = [
            [
                line["vessel"],
                line["parameter"],
                f"{line['largest_in_std']:+.2g}" if line["largest_in_std"] is not None else "-",
                number(line["median_in_std"], 2),
                number(line["std_ratio"], 3),
                number(line["before"]),
                number(line["after"]),
                line["unit"],
                str(line["sets"]),
                line["estimator"],
                line["model"],
                line["parameter_set_id"],
            ]
            for line in lines[:_SHOWN]
        ]
        print_table(head, rows)
        if len(lines) > _SHOWN:
            click.echo(f"... and {len(lines) - _SHOWN} more; --json has all.")
    for vessel_preview in previews:
        for failure in vessel_preview.failures:
            click.echo(f"{vessel_preview.vessel}, {failure['what']}: {failure['error']['message']}", err=True)
    click.echo("Nothing was stored. next: kempf reprocess")
