"""Figures that are all predicted to one side of what was measured."""

from __future__ import annotations

from dataclasses import replace

import pytest

from kempf.flows.jobs.predict.compare_predicted import ComparedFigure, MeasuredManoeuvre
from kempf.flows.jobs.predict.one_sided import one_sided
from kempf.pipeline.manoeuvre.prediction import PredictedFigure


def manoeuvre(number: int, *figures: tuple[str, float, float | None]) -> MeasuredManoeuvre:
    """One that was sailed to starboard and to port in turn: name, measured and predicted of each figure."""
    every = tuple(ComparedFigure(name, there, None, None, within(value, 0.05)) for name, there, value in figures)
    return MeasuredManoeuvre(f"seg-{number}", "starboard" if number % 2 else "port", 8.0, 0.0, 0.0, "held_out", every)


def within(value: float | None, share: float) -> PredictedFigure:
    """A predicted value with an interval of this share of it to both sides."""
    if value is None:
        return PredictedFigure(None, None, None)
    low, high = sorted(((1.0 - share) * value, (1.0 + share) * value))
    return PredictedFigure(value, low, high)


def rates(factors: list[float]) -> list[MeasuredManoeuvre]:
    signs = [1.0 if number % 2 else -1.0 for number in range(len(factors))]
    return [
        manoeuvre(number, ("steady_yaw_rate_deg_s", 2.0 * sign, 2.0 * sign * factor))
        for number, (sign, factor) in enumerate(zip(signs, factors, strict=True))
    ]


def test_what_is_too_large_in_all_is_said_whatever_the_side() -> None:
    (found,) = one_sided(rates([1.14, 1.2, 1.17, 1.33, 1.15]))
    assert (found.figure, found.manoeuvres) == ("steady_yaw_rate_deg_s", 5)
    shown = (found.median_percent, found.low_percent, found.high_percent)
    assert shown == pytest.approx((17.0, 14.0, 33.0))
    assert found.sentence("steady yaw rate") == (
        "steady yaw rate: predicted too large in all 5 manoeuvres, by 17 % in the median (+14 to +33 %); only 0 of 5 "
        "are within the interval: the model lacks something"
    )


def test_errors_that_the_intervals_allow_for_are_said_to_be_such() -> None:
    wide = [
        replace(one, figures=tuple(replace(f, predicted=replace(f.predicted, low=-9.0, high=9.0)) for f in one.figures))
        for one in rates([1.14, 1.2, 1.17, 1.33])
    ]
    (found,) = one_sided(wide)
    assert found.sentence("steady yaw rate").endswith("4 of 4 are within the interval, which allows for it")


def test_of_opposite_signs_neither_is_the_larger() -> None:
    figures = [("residual_yaw_rate_deg_s", -2.0, 1.0)] * 5
    assert one_sided([manoeuvre(number, figure) for number, figure in enumerate(figures)]) == ()


@pytest.mark.parametrize(
    "factors",
    [[1.14, 1.2, 1.17], [1.14, 1.2, 1.17, 1.33, 0.98], [0.99, 0.98, 0.97, 0.98, 0.96], [1.01, 1.06, 1.07, 1.4]],
    ids=["few", "to both sides", "hardly", "scattered"],
)
def test_what_may_be_chance_or_matters_little_is_not(factors: list[float]) -> None:
    assert one_sided(rates(factors)) == ()


def test_a_figure_without_prediction_counts_not() -> None:
    figures = [("advance_m", 100.0, 80.0)] * 3 + [("advance_m", 100.0, None)]
    assert one_sided([manoeuvre(number, figure) for number, figure in enumerate(figures)]) == ()
