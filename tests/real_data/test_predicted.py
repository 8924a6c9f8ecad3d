"""`kempf predict --compare` with the measured circles of a model on a pond, from a model of her zigzags."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kempf.flows.jobs.compare.compare_vessel import compare_vessel
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN
from kempf.flows.jobs.identify.vessel_model import store_model
from kempf.flows.jobs.ingest.files import read_model
from kempf.flows.jobs.predict.compare_predicted import measured_beside
from kempf.flows.jobs.predict.predict_request import PredictRequest
from kempf.flows.jobs.predict.predict_vessel import models_of_set, predict_with
from tests.real_data.voyage import Voyage

MODEL = Path(__file__).parents[2] / "docs" / "models" / "pond.yaml"


def test_circles_are_laid_beside_predictions_in_their_own_wind_and_way(pond: Voyage) -> None:
    vessel = pond.ship.name
    made, _ = store_model(pond.warehouse, choose(pond.warehouse, vessel), read_model(MODEL), NONE_OF_ONES_OWN)
    request = PredictRequest("turning-circle", made.parameter_set_id, 35.0)
    predicted = predict_with(models_of_set(pond.warehouse, vessel, request), request, count=32)
    beside = measured_beside(pond.warehouse, predicted)
    assert sorted(one.side for one in beside) == ["port", "starboard", "starboard", "starboard"]
    assert {one.sample for one in beside} == {"held_out"}
    figures = [{figure.name: figure for figure in one.figures} for one in beside]
    # a hull of this block loses about half of her speed, hard over; the zigzags show less of it than the circle to port
    lost = [(one["speed_loss_percent"].measured, one["speed_loss_percent"].predicted.value) for one in figures]
    np.testing.assert_allclose([p for _, p in lost], [m for m, _ in lost], atol=14.0)
    rates = [one["steady_yaw_rate_deg_s"] for one in figures]
    assert all(0.8 < float(rate.predicted.value or 0.0) / rate.measured < 1.35 for rate in rates)
    # her speed before the execute is the one that her shaft keeps, as her random manoeuvres show it
    (kept, std) = predicted.basis.surge.settled
    assert 0.95 < kept < 1.1
    assert std < 0.2
    # a free run is as far ahead: the comparison shows what those parameters make of it beside the likelihood's
    compared = compare_vessel(pond.warehouse, vessel, made.parameter_set_id).as_json()["summary"]
    for sample in ("fitted", "held_out"):
        mean = compared[sample]
        assert mean["free_run_error_percent_fitted_to_legs"]["mean"] < 0.6 * mean["free_run_error_percent"]["mean"]
