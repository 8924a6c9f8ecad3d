"""Figures that measured manoeuvres all have to one side of what is predicted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from statistics import mean, median, stdev

from kempf.flows.jobs.predict.compare_predicted import ComparedFigure, MeasuredManoeuvre

#: manoeuvres, and standard errors of their mean, from which it is hardly chance that all lie to one side
_FEWEST, _CLEAR = 4, 3.0
#: relative error below which nobody minds
_LEAST = 0.05


@dataclass(frozen=True)
class OneSided:
    """A figure that is predicted too large in all measured manoeuvres, or too small in all."""

    #: Name of the figure.
    figure: str
    manoeuvres: int
    #: Predicted over measured, less 1, per cent: the middle one, the smallest and the largest.
    median_percent: float
    low_percent: float
    high_percent: float
    #: How many of the measured ones lie in the interval of their prediction.
    inside: int

    def sentence(self, words: str) -> str:
        """Say it.

        Parameters
        ----------
        words : str
            What the figure is called.
        """
        return (
            f"{words}: predicted too {'large' if self.median_percent > 0.0 else 'small'} in all {self.manoeuvres} "
            f"manoeuvres, by {abs(self.median_percent):.0f} % in the median ({self.low_percent:+.0f} to "
            f"{self.high_percent:+.0f} %); "
            + (
                f"{self.inside} of {self.manoeuvres} are within the interval, which allows for it"
                if 2 * self.inside >= self.manoeuvres
                else f"only {self.inside} of {self.manoeuvres} are within the interval: the model lacks something"
            )
        )


def one_sided(measured: Sequence[MeasuredManoeuvre]) -> tuple[OneSided, ...]:
    """Return the figures that are predicted too large in all manoeuvres or too small in all, in their order.

    Parameters
    ----------
    measured : sequence of MeasuredManoeuvre
        To both sides: figures that change their sign with the side are compared by their size.
    """
    by_figure: dict[str, list[ComparedFigure]] = {}
    for manoeuvre in measured:
        for beside in manoeuvre.figures:
            # steps of spirals are numbered by the angles of each
            if manoeuvre.orders_deg and "." in beside.name:
                continue
            # of opposite signs neither is the larger one
            if beside.predicted.value is not None and beside.predicted.value * beside.measured > 0.0:
                by_figure.setdefault(beside.name, []).append(beside)
    found = []
    for name, every in by_figure.items():
        errors = [abs(one.predicted.value or 0.0) / abs(one.measured) - 1.0 for one in every]
        if len(errors) >= _FEWEST and _clearly_one_sided(errors):
            inside = sum(one.inside is True for one in every)
            middle, low, high = (100.0 * error for error in (median(errors), min(errors), max(errors)))
            found.append(OneSided(name, len(errors), middle, low, high, inside))
    return tuple(found)


def _clearly_one_sided(errors: Sequence[float]) -> bool:
    if min(errors) * max(errors) <= 0.0 or abs(median(errors)) < _LEAST:
        return False
    return abs(mean(errors)) > _CLEAR * stdev(errors) / sqrt(len(errors))
