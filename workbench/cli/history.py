"""``kempf history``."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kempf.schemas.errors import UsageError
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import figure_option, json_option, vessel_option, warehouse_option
from kempf.workbench.new_file import require_figures, writing
from kempf.workbench.terminal import counted, number, print_json, print_note, print_table, short_ids

if TYPE_CHECKING:
    from kempf.warehouse.history import Comparable, History


@click.command("history", cls=GivenOnce)
@vessel_option(required=True, multiple=True)
@click.option("--parameter", metavar="NAME", help="Only this parameter, such as b2.")
@click.option("--as-of", metavar="TIME", help="What was known at this time, ISO 8601; without a zone it is UTC.")
@click.option("--all", "superseded", is_flag=True, help="Also sets that a newer profile or code superseded.")
@click.option("--changes", is_flag=True, help="Say whether the ship changed, when, by how much and in what.")
@figure_option("With --changes: draw it")
@click.option(
    "--occasion",
    "occasion_h",
    type=click.FloatRange(min=0.0, max=1e6),
    default=12.0,
    show_default=True,
    metavar="HOURS",
    help="With --changes: trials begun within this time share load and weather and count as one.",
)
@warehouse_option
@json_option
def command(
    vessel: tuple[str, ...],
    parameter: str | None,
    as_of: str | None,
    superseded: bool,
    changes: bool,
    figure: Path | None,
    occasion_h: float,
    uri: str,
    as_json: bool,
) -> None:
    """Show vessels' parameters over time, as known now or at an earlier time, and whether they changed."""
    from kempf.flows.jobs.out_of_date import said_of_vessel
    from kempf.warehouse import history
    from kempf.warehouse.store import Warehouse

    if figure is not None and not changes:
        raise UsageError("figure_without_changes", "--figure draws what --changes found.", "Add --changes.")
    warehouse, instant = Warehouse(uri), _instant(as_of)
    histories = {
        name: history.of_vessel(warehouse, name, parameter, instant, superseded=superseded)
        for name in dict.fromkeys(vessel)
    }
    for name, found in histories.items():
        if instant is None:
            print_note(said_of_vessel(warehouse, name))
        if found.note:
            click.echo(found.note, err=as_json)
    if not changes:
        _show(histories, as_json=as_json)
        return
    kinds = {name: history.comparable(warehouse, name, instant) for name in histories}
    # each kind of sets has a figure of its own
    figures = iter(require_figures(figure, sum(map(len, kinds.values()))))
    documents: list[dict[str, Any]] = []
    for name, found in histories.items():
        examined = [_examine(kind, occasion_h, next(figures, None), name) for kind in kinds[name]]
        documents.append({"vessel": name, "history": _rows(name, found), "changes": examined})
    if as_json:
        print_json(documents if len(documents) > 1 else documents[0])
        return
    for document in documents:
        if len(documents) > 1:
            click.echo(click.style(document["vessel"], bold=True))
        for one in document["changes"]:
            _print_changes(one)


def _rows(vessel: str, history: History) -> list[dict[str, Any]]:
    return [{"vessel": vessel, **row} for row in history.rows()]


def _show(histories: dict[str, History], *, as_json: bool) -> None:
    listed = [row for name, history in histories.items() for row in _rows(name, history)]
    if as_json:
        print_json(listed)
    if not listed or as_json:
        return
    several, short = len(histories) > 1, short_ids(row["parameter_set_id"] for row in listed)
    rows = [
        [
            *([r["vessel"]] if several else []),
            r["start"][:16],
            r["parameter"],
            number(r["value"]),
            number(r["std"], 2),
            r["unit"],
            r["estimator"],
            r["model"],
            short[r["parameter_set_id"]] + (" superseded" if r["superseded"] else ""),
        ]
        for r in listed
    ]
    head = ["vessel"] if several else []
    print_table([*head, "start UTC", "parameter", "value", "std", "unit", "estimator", "model", "set"], rows)


def _examine(kind: Comparable, occasion_h: float, figure: Path | None, vessel: str) -> dict[str, Any]:
    """Put the sets of one model and estimator to the tests."""
    import numpy as np

    from kempf.pipeline.history.changes import find_changes
    from kempf.pipeline.history.pooled import pool
    from kempf.pipeline.history.report import report
    from kempf.pipeline.history.sets import ParameterHistory, usable
    from kempf.pipeline.history.settings import ChangeSettings

    n, p = len(kind.parameter_set_ids), len(kind.names)
    time = np.array(kind.starts_utc_ns, dtype=np.int64)
    value = np.array(kind.values, dtype=np.float64).reshape(n, p)
    covariance = np.array(kind.covariances, dtype=np.float64).reshape(n, p, p)
    good = usable(value, covariance)
    history = ParameterHistory(kind.names, kind.units, time[good], value[good], covariance[good])
    left_out = dict(kind.left_out)
    if not bool(np.all(good)):
        left_out["covariance not positive definite"] = int(np.sum(~good))
    changes = find_changes(history, replace(ChangeSettings(), occasion_s=3600.0 * occasion_h))
    if figure is not None and len(history):
        from kempf.workbench.figures.history import draw_history

        title = f"{vessel}, model {kind.model}, estimator {kind.estimator}: {changes.verdict}"
        with writing(figure):
            draw_history(history, changes, figure, title)
    return {
        "model": kind.model,
        "model_sha256": kind.model_sha256,
        "estimator": kind.estimator,
        "parameter_set_ids": [name for name, ok in zip(kind.parameter_set_ids, good, strict=True) if ok],
        "left_out": left_out,
        **report(history, pool(history.value, history.covariance) if len(history) else None, changes),
        "figure": str(figure) if figure is not None and len(history) else None,
    }


def _print_changes(one: dict[str, Any]) -> None:
    """Print what was found of one model and estimator, for a person."""
    left = ", ".join(f"{n} {reason}" for reason, n in one["left_out"].items())
    title = (
        f"model {one['model']}, estimator {one['estimator']}: {counted(one['sets'], 'set')} on "
        f"{counted(len(one['occasions']), 'occasion')}"
    )
    click.echo(click.style(title, bold=True) + (f"; left out: {left}" if left else ""))
    pooled = one["pooled"]
    if pooled is not None and pooled["poolable"] is not None:
        p_value = number(pooled["p_value"], 2) if pooled["p_value"] > 1e-16 else "0 to 16 digits"
        may = "may be pooled" if pooled["poolable"] else "do not agree within their standard errors"
        click.echo(
            f"  the sets {may}: Q = {number(pooled['q'])} on {pooled['degrees_of_freedom']} degrees of freedom, "
            f"p = {p_value}; with standard errors {number(pooled['scale'], 3)} times as large "
            "they would agree"
        )
    click.echo(f"  {click.style(one['verdict'], bold=True)}: {one['why']}")
    for change in one["changes"]:
        _print_change(change)
    if one["verdict"].startswith("not testable"):
        return
    smallest, scatter = one["smallest_step_seen"], one["scatter_between_trials"]
    rows = [
        [name, number(s["value"], 3), _percent(s["percent"]), _percent(scatter[name]["percent"]), s["unit"]]
        for name, s in smallest.items()
        if name != "power"
    ]
    click.echo(f"  seen with {100 * smallest['power']:g} % probability: a step midway, of one parameter alone, of")
    print_table(["", "step", "%", "scatter between trials %", "unit"], rows)


def _percent(share: float) -> str:
    return number(share, 2) if not abs(share) >= 100 else f"{share:.0f}"


def _print_change(change: dict[str, Any]) -> None:
    one, other = (t[:10] for t in change["between"])
    sure = f"{100 * change['confidence']:g} %"
    if change["kind"] == "step":
        low, high = (t[:10] for t in change["interval"])
        head = f"step between {one} and {other} ({sure} interval {low} to {high})"
    else:
        head = f"drift from {one} to {other}, per year"
    doubt = "; step or drift, the data hardly decide" if change["bic_ahead_of_other_form"] < 2 else ""
    rows = [
        [
            name,
            number(p["before"]),
            number(p["change"], 3),
            number(p["std"], 2),
            f"{p['percent']:+.1f}",
            f"{p['percent_std']:.1f}",
            number(p["low"], 3),
            number(p["high"], 3),
            "yes" if p["moved"] else "",
            p["unit"],
        ]
        for name, p in change["parameters"].items()
    ]
    print_table(["", "before", "change", "std", "%", "std %", "low", "high", "moved", "unit"], rows, f"  {head}{doubt}")
    for by in change["alone"]:
        click.echo(
            f"  {by['parameter']} alone would explain it: {number(by['change'], 3)} ± {number(by['std'], 2)} (1 s.e.) "
            f"{by['unit']} ({by['percent']:+.1f} %)"
        )


def _instant(text: str | None) -> datetime | None:
    if text is None:
        return None
    try:
        instant = datetime.fromisoformat(text)
        return (instant if instant.tzinfo is not None else instant.replace(tzinfo=UTC)).astimezone(UTC)
    except (ValueError, OverflowError) as error:
        raise UsageError(
            "not_a_time",
            f"--as-of {text!r} is no time; expected ISO 8601.",
            "Write it as 2025-05-03T12:00:00Z.",
        ) from error
