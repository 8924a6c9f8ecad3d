"""What `kempf predict` says of measured ships beside what they did: circles from zigzags, and zigzags closed loop.

The Esso Osaka is identified from her zigzags and sails her turning circles; the tank's KVLCC2 sails its own zigzags,
those held out among them. Each is predicted as it was sailed: with its own approach, shaft speed, wind and headings.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks import measured_ships, result_page
from benchmarks.identify import peers
from benchmarks.measured_ships import Ship
from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_vessel
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN, point
from kempf.flows.jobs.identify.vessel_model import store_model
from kempf.flows.jobs.ingest.files import read_model
from kempf.flows.jobs.predict.as_sailed import as_sailed
from kempf.flows.jobs.predict.checked_prediction import predict_checked
from kempf.flows.jobs.predict.compare_predicted import ComparedFigure, MeasuredManoeuvre, beside, measured_beside
from kempf.flows.jobs.predict.predict_request import PredictRequest
from kempf.flows.jobs.predict.predicted import SetPrediction
from kempf.pipeline.manoeuvre.zigzag import PredictedZigzag
from kempf.schemas.errors import KempfError
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets, segments

_MODELS = Path(__file__).parents[2] / "docs" / "models"
_CIRCLE = ("steady_yaw_rate_deg_s", "advance_m", "transfer_m", "tactical_diameter_m", "speed_loss_percent")
_FIRST_TWO = ("overshoots_deg.0", "overshoots_deg.1")


@dataclass(frozen=True)
class Source:
    """A model of a ship, and how it came about."""

    words: str
    set_id: str


def sources(warehouse: Warehouse, vessel: str, spec: ModelSpec | None, named: ModelSpec | None) -> list[Source]:
    """Return the set that a diagnosis ends with, and that of a model whose effects are named by hand."""
    found = []
    plain = spec or default_model_of(warehouse, vessel)
    ladder = diagnose_vessel(warehouse, vessel, plain)[0].as_json()["ladder"]
    effects = (*plain.effects, *(step["added"] for step in ladder if step["added"]))
    ends = [("the diagnosis", plain.model_copy(update={"effects": effects}))]
    if named is not None:
        ends.append(("a model file", named))
    for words, model in ends:
        one, _ = store_model(warehouse, choose(warehouse, vessel), model, NONE_OF_ONES_OWN)
        found.append(Source(f"{words}, effects: {' + '.join(model.effects) or 'none'}", one.parameter_set_id))
    return found


def circles(warehouse: Warehouse, vessel: str, source: Source) -> list[str]:
    """Return the part of the page with the circles of a ship."""
    rows, ratios, inside = [], [], []
    for rudder in sorted({s.delta0_deg for s in segments.every(warehouse, vessel) if s.kind == "turning_circle"}):
        made = predict_checked(warehouse, vessel, PredictRequest("turning-circle", source.set_id, rudder))
        for one in measured_beside(warehouse, made):
            figures = {figure.name: figure for figure in one.figures}
            rate = figures.get("steady_yaw_rate_deg_s")
            if rate is not None and rate.predicted.value is not None:
                ratios.append(rate.predicted.value / rate.measured)
                inside.append(bool(rate.as_json()["inside"]))
            rows.append([f"{rudder:g} deg, {one.side}", *[_cell(figures.get(name)) for name in _CIRCLE]])
    lines = [f"### Turning circles by {source.words}", ""]
    if ratios:
        near = sum(abs(ratio - 1.0) <= 0.08 for ratio in ratios)
        lines += [
            f"Steady yaw rate, predicted over measured: {min(ratios):.2f} to {max(ratios):.2f}, {near} of "
            f"{len(ratios)} within 8 %; {sum(inside)} of {len(ratios)} measured ones lie in the 95 % interval.",
            "",
        ]
    heads = ["circle", "steady yaw rate, deg/s", "advance, m", "transfer, m", "tactical diameter, m", "speed loss, %"]
    return [*lines, *result_page.table(heads, rows), ""]


def zigzags(warehouse: Warehouse, vessel: str, source: Source, *, others: bool) -> list[str]:
    """Return the part of the page with the zigzags of a ship, beside those of others where there are some."""
    made = predict_checked(warehouse, vessel, PredictRequest("zigzag", source.set_id))
    checked = made.own_zigzags
    assert checked is not None
    every = [s for s in segments.current(warehouse, vessel) if s.kind == "zigzag"]
    pairs = [
        (s, PredictedZigzag(np.deg2rad(s.psi0_deg), np.deg2rad(s.delta0_deg), overshoots=2))
        for s in sorted(every, key=lambda s: (s.psi0_deg, s.delta0_deg, s.first_side))
    ]
    sailed = as_sailed(warehouse, made, pairs)
    measured = [beside(made, one) for one in sailed]
    rows = []
    for one, (segment, _) in zip(measured, pairs, strict=True):
        figures = {figure.name: figure for figure in one.figures}
        angles = f"{segment.psi0_deg:g}/{segment.delta0_deg:g} {one.side}"
        row = [angles, one.sample.replace("_", " "), *[_cell(figures.get(name)) for name in _FIRST_TWO]]
        gear = made.basis.rudder_rate.rad_s
        theirs = [peers.overshoots(segment.psi0_deg, segment.delta0_deg, one.side, gear)] if others else []
        rows.append([*row, *theirs])
    heads = ["zigzag", "sample", "first overshoot, deg", "second overshoot, deg"]
    heads += ["MMG from captive tests, both"] if others else []
    return [
        f"### Overshoots by {source.words}",
        "",
        f"{checked.sentence[0].upper()}{checked.sentence[1:]}.",
        "",
        *_shares(measured),
        "",
        *result_page.table(heads, rows),
        "",
        *_calm_circle(warehouse, vessel, source, others=others),
    ]


def _shares(measured: Sequence[MeasuredManoeuvre]) -> list[str]:
    lines = []
    for sample in ("fitted", "held_out"):
        figures = [f for one in measured if one.sample == sample for f in one.figures if f.predicted.value is not None]
        for name, words in zip(_FIRST_TWO, ("first", "second"), strict=True):
            own = [f for f in figures if f.name == name]
            if not own:
                continue
            off = [float(f.predicted.value or np.nan) - f.measured for f in own]
            lines.append(
                f"- {words} overshoots of {len(own)} zigzags {sample.replace('_', ' ')}: off by {min(off):+.2f} to "
                f"{max(off):+.2f} deg, {sum(bool(f.as_json()['inside']) for f in own)} in their 95 % interval"
            )
    return lines


def _calm_circle(warehouse: Warehouse, vessel: str, source: Source, *, others: bool) -> list[str]:
    """Return a 35 deg circle in calm water with its intervals: how much the model is worth beyond zigzags."""
    try:
        made = predict_checked(warehouse, vessel, PredictRequest("turning-circle", source.set_id))
    except KempfError as error:
        return [f"Her circle with 35 deg of rudder is refused: {error.message}", ""]
    rows = []
    for name in _CIRCLE:
        one = made.prediction.figures[name]
        assert one.value is not None
        assert one.low is not None
        assert one.high is not None
        width = 100.0 * (one.high - one.low) / abs(one.value)
        rows.append([name, f"{one.value:.4g}", f"{one.low:.4g} to {one.high:.4g}", f"{width:.0f} %"])
    surge = made.basis.surge
    lines = [
        f"Of the logged speed its equation leaves {1000.0 * surge.error_m_s:.1f} mm/s rms: tau {surge.best[0]:.1f} "
        f"lengths, k_vr {surge.best[1]:.2f}, k_r {surge.best[2]:.2f}, k_d {surge.best[3]:.2f}, k_w "
        f"{surge.best[4]:.4f} ([predict.md](../../docs/predict.md)).",
        "",
        *result_page.table(["her circle with 35 deg of rudder, calm water", "value", "95 % interval", "width"], rows),
        "",
    ]

    def elsewhere(side: Any, rudder_rate_deg_s: float) -> SetPrediction:
        request = PredictRequest("turning-circle", source.set_id, side=side, rudder_rate_deg_s=rudder_rate_deg_s)
        return predict_checked(warehouse, vessel, request)

    return [*lines, *peers.circles_beside(elsewhere)] if others else lines


def _cell(figure: ComparedFigure | None) -> str:
    if figure is None:
        return ""
    one = figure.predicted
    if one.value is None or one.low is None or one.high is None:
        return f"{figure.measured:.3g}: not predicted"
    mark = "" if figure.as_json()["inside"] else ", outside"
    return f"{figure.measured:.3g}: {one.value:.3g} ({one.low:.3g} to {one.high:.3g}{mark})"


def _of(ship: Ship, spec: ModelSpec | None, named: ModelSpec | None, *, others: bool = False) -> list[str]:
    lines = [f"## {ship.name}", ""]
    with TemporaryDirectory() as place:
        warehouse = Warehouse(place)
        measured_ships.take_in(warehouse, ship)
        for source in sources(warehouse, ship.name, spec, named):
            point(warehouse, parameter_sets.get(warehouse, source.set_id))
            turned = any(s.kind == "turning_circle" for s in segments.every(warehouse, ship.name))
            parts = {"circles": circles} if turned else {}
            for name, part in (parts | {"zigzags": partial(zigzags, others=others)}).items():
                try:
                    lines += part(warehouse, ship.name, source)
                except KempfError as error:
                    lines += [f"### Refused: {name} by {source.words}", "", error.message, ""]
    return lines


def main() -> None:
    """Predict both ships and write ``results/predicted_measured.md``."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=Path(__file__).parents[3] / "shared")
    parser.add_argument("--model", type=Path, default=_MODELS / "pond.yaml", help="Of the pond's ship, with effects.")
    given = parser.parse_args()
    lines = [
        "Cells: measured, then predicted with its 95 % interval. Circles are never fitted. A measured manoeuvre is "
        "predicted in its wind as it was logged; a stream is in the measurement alone.",
        "",
        *_of(measured_ships.pond(given.data), None, read_model(given.model)),
        *_of(measured_ships.tank(given.data), read_model(_MODELS / "tank.yaml"), None, others=True),
    ]
    result_page.write("identify.predicted_measured", "Predicted manoeuvres of measured ships", lines)


if __name__ == "__main__":
    main()
