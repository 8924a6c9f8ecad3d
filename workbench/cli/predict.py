"""``kempf predict``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click

from kempf.flows.jobs.predict.predict_request import Kind, PredictRequest, angles_of
from kempf.schemas.enumeration import as_words, counted
from kempf.schemas.errors import UsageError
from kempf.schemas.side import Side
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import figure_option, json_option, vessel_option, warehouse_option
from kempf.workbench.manoeuvre_figures import FIGURES, LAST_TURN, beside_in_words, in_words, scaled
from kempf.workbench.new_file import require_figures, writing
from kempf.workbench.numbers import number
from kempf.workbench.terminal import print_json, print_paragraph, print_table, progress_bar

if TYPE_CHECKING:
    from kempf.flows.jobs.predict.compare_predicted import ComparedFigure, MeasuredManoeuvre
    from kempf.flows.jobs.predict.predicted import SetPrediction
    from kempf.pipeline.manoeuvre.prediction import PredictedFigure


@click.command("predict", cls=GivenOnce)
@click.argument("manoeuvre", type=click.Choice(get_args(Kind)))
@vessel_option(required=True)
@click.option("--set", "set_id", metavar="ID", help="Parameter set; default: the current one of the vessel.")
@click.option(
    "--rudder",
    "rudder_deg",
    type=float,
    metavar="DEG",
    help="Rudder of circle, pull-out or spiral; default: 35, 20 and 20.",
)
@click.option("--angles", metavar="HEADING/RUDDER", help="Of a zigzag, degrees; default: 20/20.")
@click.option("--side", type=click.Choice(get_args(Side)), default="starboard", show_default=True, help="Of the turn.")
@click.option(
    "--speed", type=float, metavar="M/S", help="Of the approach; default: the mean of those that were sailed."
)
@click.option(
    "--rudder-rate",
    "rudder_rate",
    type=float,
    metavar="DEG/S",
    help="Of another steering gear; default: as in the logs.",
)
@click.option("--compare", is_flag=True, help="Lay it over the measured manoeuvres of the same kind and angles.")
@figure_option("Draw the manoeuvre with its interval")
@warehouse_option
@json_option
def command(
    manoeuvre: Any,
    vessel: str,
    set_id: str | None,
    rudder_deg: float | None,
    angles: str | None,
    side: Any,
    speed: float | None,
    rudder_rate: float | None,
    compare: bool,
    figure: Path | None,
    uri: str,
    as_json: bool,
) -> None:
    """Predict a standard manoeuvre from a parameter set, every figure with its 95 % interval.

    The intervals are those of ships that the errors of the set allow, of it and of every model that fits the
    data as well. What is beyond the drift, yaw rate, rudder and speed of the logs is named.
    """
    from kempf.flows.jobs.predict.checked_prediction import predict_checked
    from kempf.flows.jobs.predict.compare_predicted import measured_beside, measured_kind, other_orders
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.documents.prediction import prediction_document

    require_figures(figure, code="cannot_write")
    _require_fitting(manoeuvre, rudder_deg, angles)
    heading, rudder = angles_of(angles, "--angles") if angles is not None else (20.0, 20.0)
    request = PredictRequest(manoeuvre, set_id, rudder_deg, (heading, rudder), side, speed, rudder_rate)
    with progress_bar() as progress:
        predicted = predict_checked(Warehouse(uri), vessel, request, progress)
        measured = measured_beside(Warehouse(uri), predicted, progress) if compare else None
    others = other_orders(Warehouse(uri), predicted) if compare else {}
    if figure is not None:
        from kempf.workbench.figures.manoeuvre import draw_manoeuvre

        with writing(figure):
            draw_manoeuvre(predicted.prediction, figure, _title(predicted))
    if as_json:
        drawn = str(figure) if figure else None
        print_json(prediction_document(predicted, measured, others, drawn))
    else:
        _print_predicted(predicted, figure)
        if measured is not None:
            _print_measured(measured, manoeuvre)
        if others:
            by_option = ", ".join(f"{count} with {option}" for option, count in others.items())
            print_paragraph(f"not compared, as they are of other angles: {by_option}")
        if not compare and manoeuvre != "zigzag" and (count := measured_kind(Warehouse(uri), predicted)):
            measured_ones = counted(count, manoeuvre.replace("-", " "))
            print_paragraph(f"measured: {measured_ones}; --compare lays the prediction over those of this rudder")


def _require_fitting(manoeuvre: str, rudder_deg: float | None, angles: str | None) -> None:
    if manoeuvre == "zigzag" and rudder_deg is not None:
        raise UsageError("usage", "A zigzag has no --rudder.", "Give heading and rudder with --angles, such as 10/10.")
    if manoeuvre != "zigzag" and angles is not None:
        raise UsageError("usage", f"A {manoeuvre} has no --angles.", "Give its rudder with --rudder.")


def _title(predicted: SetPrediction) -> str:
    manoeuvre = predicted.as_json()["manoeuvre"]
    kind = manoeuvre["kind"].replace("-", " ")
    words = f"{kind} with {manoeuvre['rudder_deg']:g} deg of rudder"
    if kind == "zigzag":
        words = f"{manoeuvre['heading_deg']:g}/{manoeuvre['rudder_deg']:g} zigzag"
    side = f" to {manoeuvre['side']}" if "side" in manoeuvre else ""
    return (
        f"{predicted.vessel}, {predicted.parameter_set.parameter_set_id}: {words}{side} at "
        f"{number(predicted.speed_m_s, 3)} m/s"
    )


def _print_predicted(predicted: SetPrediction, figure: Path | None) -> None:
    shown = predicted.as_json()
    manoeuvre = shown["manoeuvre"]
    scale = predicted.basis.particulars.model_scale
    rows = [_row(name, figure, manoeuvre, scale) for name, figure in predicted.prediction.figures.items()]
    heads = ["figure", "value", "95 % interval", "unit"]
    heads += [] if scale is None else ["at full scale", "95 % interval"]
    print_table(heads, rows, _title(predicted))
    if len(shown["models"]) > 1:
        _print_models(predicted)
    for criterion in predicted.prediction.imo:
        limit = f", at most {number(criterion.limit)} {criterion.unit}" if criterion.limit is not None else ""
        verdict = (
            f"fulfilled with a probability of {100 * criterion.probability:.0f} %"
            if criterion.probability is not None
            else "not judged"
        )
        print_paragraph(f"IMO {criterion.name}{limit}: {verdict}" + (f" ({criterion.why})" if criterion.why else ""))
    for beyond in predicted.prediction.extrapolated:
        print_paragraph(f"extrapolated: {beyond.sentence}")
    if predicted.own_zigzags is not None:
        print_paragraph(predicted.own_zigzags.sentence)
    for sentence in (*predicted.against, *predicted.limits):
        print_paragraph(f"limit: {sentence}")
    for sentence in predicted.assumed:
        print_paragraph(f"assumed: {sentence}")
    if figure is not None:
        click.echo(f"  drawn: {figure}")


def _row(name: str, figure: PredictedFigure, manoeuvre: dict[str, Any], model_scale: float | None) -> list[str]:
    base, _, place = name.partition(".")
    words, unit = in_words(base, int(place) if place else None, manoeuvre), FIGURES[base][1]
    if figure.value is None:
        return [words, "-", "too few ships have it", unit, *(() if model_scale is None else ("-", "-"))]
    row = [words, number(figure.value), f"{number(figure.low)} to {number(figure.high)}", unit]
    if model_scale is None:
        return row
    full = scaled(base, vars(figure), model_scale)
    return [*row, number(full["value"]), f"{number(full['low'])} to {number(full['high'])}"]


def _with_half(beside: ComparedFigure) -> str:
    """Return what was measured with half its own interval, where that is known."""
    low, high = beside.measured_low, beside.measured_high
    return number(beside.measured) + ("" if low is None or high is None else f" ± {number(0.5 * (high - low), 2)}")


def _print_models(predicted: SetPrediction) -> None:
    first = next(iter(predicted.prediction.figures))
    words, unit = FIGURES[first.partition(".")[0]]
    rows = []
    for member in predicted.prediction.models:
        figure = member.figures[first]
        rows.append([member.model.title, number(figure.value), f"{number(figure.low)} to {number(figure.high)}", unit])
    print_table([f"{words} of the model", "value", "95 % interval", "unit"], rows)


def _print_measured(measured: Sequence[MeasuredManoeuvre], kind: str) -> None:
    from kempf.flows.jobs.predict.one_sided import one_sided
    from kempf.workbench.documents.prediction import judged, sentence_of

    if not measured:
        print_paragraph("measured: no manoeuvre of this kind and these angles is in the warehouse")
        return
    rows = []
    for run in measured:
        for beside in run.figures:
            figure = beside.predicted
            base, _, place = beside.name.partition(".")
            words = beside_in_words(kind, base, int(place) if place else None, vars(run))
            if figure.value is not None:
                interval = f"{number(figure.low)} to {number(figure.high)}"
                about = (run.segment_id[:12], run.side, as_words(run.sample), words)
                verdict = "yes" if beside.inside else "by both" if beside.agrees else "no"
                rows.append([*about, _with_half(beside), number(figure.value), interval, verdict])
    head = ["segment", "side", "sample", "figure", "measured", "predicted", "95 % interval", "inside"]
    print_table(head, rows, "measured, and predicted as each was sailed: its own beginning, rudder, headings and wind")
    for sentence in (*judged(measured), *([LAST_TURN] if kind == "turning-circle" else [])):
        print_paragraph(sentence)
    for found in one_sided(measured):
        print_paragraph(sentence_of(found))
    for run in measured:
        if run.why:
            print_paragraph(f"{run.segment_id}: {run.why}")
