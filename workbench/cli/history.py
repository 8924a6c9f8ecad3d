"""``kempf history``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kempf.schemas.enumeration import counted
from kempf.schemas.errors import UsageError
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import figure_option, json_option, output_option, vessel_option, warehouse_option
from kempf.workbench.instants import end_of
from kempf.workbench.new_file import require_figures, require_new, writing
from kempf.workbench.numbers import number
from kempf.workbench.terminal import print_json, print_note, print_paragraph, print_table, short_ids

if TYPE_CHECKING:
    from datetime import datetime

    from kempf.warehouse.queries.history import History
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.documents.changes import Examined


#: Smaller p-values are not written out.
_LEAST_P = 1e-16


@click.command("history", cls=GivenOnce)
@vessel_option(multiple=True)
@click.option("--parameter", metavar="NAME", help="Only this parameter, such as b2.")
@click.option("--as-of", metavar="TIME", help="What was known then, ISO 8601; a date is the whole day.")
@click.option("--all", "superseded", is_flag=True, help="Also sets that a newer profile or code superseded.")
@click.option("--changes", is_flag=True, help="Say whether the ship changed, when, by how much and in what.")
@click.option(
    "--format",
    "file_format",
    type=click.Choice(["csv", "parquet", "json"]),
    help="Write the history to --output in this form, a row a parameter of a set.",
)
@output_option("With --format: the file.")
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
    file_format: str | None,
    output: Path | None,
    figure: Path | None,
    occasion_h: float,
    uri: str,
    as_json: bool,
) -> None:
    """Show vessels' parameters over time, as known now or at an earlier time, and whether they changed.

    Without --vessel, of the whole fleet.
    """
    from kempf.flows.jobs.state.out_of_date import said_of_vessel
    from kempf.warehouse.queries import history
    from kempf.warehouse.queries.comparable import comparable_sets
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import vessels
    from kempf.workbench.documents.changes import changes_document, examined

    _require_sense(file_format, output, figure, changes=changes, as_json=as_json)
    warehouse, instant = Warehouse(uri), end_of(as_of, "--as-of") if as_of is not None else None
    histories = {
        name: history.of_vessel(warehouse, name, parameter, instant, superseded=superseded)
        for name in (dict.fromkeys(vessel) or vessels.names(warehouse))
    }
    if file_format is not None:
        _write(histories, file_format, output)
        return
    for name, vessel_history in histories.items():
        if instant is None:
            print_note(said_of_vessel(warehouse, name))
        if vessel_history.note:
            click.echo(vessel_history.note, err=as_json)
    if not changes:
        _show(histories, as_json=as_json)
        if not as_json:
            if vessel and instant is None:
                _say_which_fit(warehouse, histories)
            _show_notes(warehouse, list(histories), instant)
        return
    kinds = {name: comparable_sets(warehouse, name, instant) for name in histories}
    # each kind of sets has a figure of its own
    figures = iter(require_figures(figure, sum(map(len, kinds.values()))))
    documents = []
    for name, vessel_history in histories.items():
        tested = [_drawn(examined(kind, occasion_h), next(figures, None), name) for kind in kinds[name]]
        documents.append(changes_document(name, vessel_history, tested))
    if as_json:
        print_json(documents[0] if len(documents) == 1 else documents)
        return
    for document in documents:
        if len(documents) > 1:
            click.echo(click.style(document["vessel"], bold=True))
        _print_all(document["changes"])


def _require_sense(
    file_format: str | None, output: Path | None, figure: Path | None, *, changes: bool, as_json: bool
) -> None:
    """Refuse options that say nothing without each other, or beside each other."""
    if (file_format is None) != (output is None):
        raise UsageError("format_without_output", "--format and --output belong together.", "Give both, or neither.")
    if file_format is not None and (changes or as_json):
        raise UsageError(
            "format_beside",
            f"--format writes the history to a file, and {'--changes' if changes else '--json'} shows something else.",
            "Ask for one after the other.",
        )
    if figure is not None and not changes:
        raise UsageError("figure_without_changes", "--figure draws what --changes found.", "Add --changes.")
    if output is not None:
        require_new(output, "--output")


def _write(histories: dict[str, History], file_format: str, output: Path | None) -> None:
    """Write histories to a file, a row a parameter of a set."""
    import polars as pl

    from kempf.workbench.documents.changes import history_rows

    assert output is not None
    schema = {
        **{"vessel": pl.String, "start": pl.String, "parameter": pl.String, "value": pl.Float64, "std": pl.Float64},
        **{"low": pl.Float64, "high": pl.Float64, "unit": pl.String, "model": pl.String, "estimator": pl.String},
        **{"converged": pl.Boolean, "superseded": pl.Boolean, "parameter_set_id": pl.String},
    }
    rows = [row for name, history in histories.items() for row in history_rows(name, history)]
    frame = pl.DataFrame([{key: row[key] for key in schema} for row in rows], schema=schema, orient="row")
    time = pl.col("start").str.to_datetime("%+", time_unit="us", time_zone="UTC")
    with writing(output, "--output"):
        if file_format == "parquet":
            frame.with_columns(time).write_parquet(output)
        elif file_format == "csv":
            frame.write_csv(output)
        else:
            frame.write_json(output)
    click.echo(f"{output}: {counted(frame.height, 'row')} of {counted(len(histories), 'vessel')}")


def _show(histories: dict[str, History], *, as_json: bool) -> None:
    from kempf.workbench.documents.changes import history_rows

    listed = [row for name, history in histories.items() for row in history_rows(name, history)]
    if as_json:
        print_json(listed)
    if not listed or as_json:
        return
    short = short_ids(row["parameter_set_id"] for row in listed)
    # a series can be read down only where one model and estimator made it
    series: dict[tuple[str, str, str], list[list[str]]] = {}
    for r in listed:
        series.setdefault((r["vessel"], r["model"], r["estimator"]), []).append(
            [
                r["start"][:16],
                r["parameter"],
                number(r["value"]),
                number(r["std"], 2),
                r["unit"],
                short[r["parameter_set_id"]]
                + (" superseded" if r["superseded"] else "")
                + ("" if r["converged"] else " not converged"),
            ]
        )
    # sorted, for sets of one start come in the order of their ids; the vessels stay as they were asked for
    order = list(histories)
    for vessel, model, estimator in sorted(series, key=lambda kind: (order.index(kind[0]), kind)):
        title = f"{vessel}, model {model}, estimator {estimator}"
        print_table(["start UTC", "parameter", "value", "std", "unit", "set"], series[vessel, model, estimator], title)


def _say_which_fit(warehouse: Warehouse, histories: Mapping[str, History]) -> None:
    """Say of the current sets that are listed where predictions take other parameters than these."""
    from kempf.warehouse.tables import aliases, parameter_sets
    from kempf.workbench.parameter_set_table import print_by_likelihood

    for name, vessel_history in histories.items():
        current = aliases.of_vessel(warehouse, name).get(aliases.CURRENT)
        if current is not None and current in vessel_history.frame["parameter_set_id"].unique().to_list():
            print_by_likelihood(parameter_sets.get(warehouse, current, name))


def _show_notes(warehouse: Warehouse, names: Sequence[str], as_of: datetime | None) -> None:
    """Print what people noted of the vessels, by that time."""
    from kempf.flows.jobs.corrections.notes_of_hers import notes_of_hers
    from kempf.warehouse.tables import notes
    from kempf.workbench.cli.note import words_of

    for name in names:
        # of an earlier time also those on logs that went to another vessel since
        for note in notes_of_hers(warehouse, name) if as_of is None else notes.of_vessel(warehouse, name):
            if as_of is None or note.written is None or note.written <= as_of:
                click.echo(f"note: {words_of(note)}")


def _drawn(examined: Examined, figure: Path | None, vessel: str) -> dict[str, Any]:
    """Return what the tests say of one model and estimator, drawn where a figure is asked for."""
    if figure is None or not len(examined.history):
        return examined.as_json()
    from kempf.workbench.figures.history import draw_history

    kind = examined.kind
    title = f"{vessel}, model {kind.model}, estimator {kind.estimator}: {examined.changes.verdict}"
    with writing(figure):
        draw_history(examined.history, examined.changes, figure, title)
    return examined.as_json(str(figure))


#: Why a set is left out, of those that no history of single manoeuvres could take.
_SEVERAL = "made of several segments"


def _print_all(examined: Sequence[dict[str, Any]]) -> None:
    """Print what was found of each model and estimator that has sets to compare; the other sets in one sentence."""
    for report in examined:
        if report["sets"]:
            _print_changes(report)
    out: Counter[str] = Counter()
    for report in examined:
        out.update({reason: n for reason, n in report["left_out"].items() if reason == _SEVERAL or not report["sets"]})
    if examined and not any(report["sets"] for report in examined):
        click.echo(f"{click.style(examined[0]['verdict'], bold=True)}: no set of a single manoeuvre to compare")
    if out:
        print_paragraph(f"left out: {_left_out(out)}", indent="")


def _left_out(reasons: Mapping[str, int]) -> str:
    return ", ".join(
        f"{counted(n, 'set')} {'made of several manoeuvres' if reason == _SEVERAL else reason}"
        for reason, n in reasons.items()
    )


def _print_changes(report: dict[str, Any]) -> None:
    """Print what was found of one model and estimator, for a person."""
    left = _left_out({reason: n for reason, n in report["left_out"].items() if reason != _SEVERAL})
    testable = not report["verdict"].startswith("not testable")
    about = f"{counted(report['sets'], 'set')} on {counted(len(report['occasions']), 'occasion')}: " if testable else ""
    click.echo(f"model {report['model']}, estimator {report['estimator']}: {click.style(report['verdict'], bold=True)}")
    print_paragraph(f"{about}{report['why']}")
    if left:
        print_paragraph(f"left out: {left}")
    pooled = report["pooled"]
    if pooled is not None and pooled["poolable"] is not None:
        p_value = f"= {number(pooled['p_value'], 2)}" if pooled["p_value"] > _LEAST_P else f"< {_LEAST_P:g}"
        may, larger = "may be pooled", ""
        if not pooled["poolable"]:
            may = "do not agree within their standard errors"
            larger = f"; with standard errors {number(pooled['scale'], 3)} times as large they would agree"
        print_paragraph(
            f"the sets {may}: Q = {number(pooled['q'])} on {pooled['degrees_of_freedom']} degrees of freedom, "
            f"p {p_value}{larger}"
        )
    for change in report["changes"]:
        _print_change(change)
    if not testable:
        return
    smallest, scatter = report["smallest_step_seen"], report["scatter_between_trials"]
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
    first, last = (t[:10] for t in change["between"])
    sure = f"{100 * change['confidence']:g} %"
    if change["kind"] == "step":
        low, high = (t[:10] for t in change["interval"])
        head = f"step between {first} and {last} ({sure} interval {low} to {high})"
    else:
        head = f"drift from {first} to {last}, per year"
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
        print_paragraph(
            f"{by['parameter']} alone would explain it: {number(by['change'], 3)} ± {number(by['std'], 2)} (1 s.e.) "
            f"{by['unit']} ({by['percent']:+.1f} %)"
        )
