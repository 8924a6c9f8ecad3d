"""A predicted manoeuvre: figures with their intervals, which hold those of every model that fits as well."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.manoeuvre.covered import Beyond, beyond
from kempf.pipeline.manoeuvre.criteria import Judged, judge
from kempf.pipeline.manoeuvre.draws import DRAWS, Identified
from kempf.pipeline.manoeuvre.sailed import Manoeuvre, Reach, Sailed
from kempf.pipeline.segment.particulars import Particulars
from kempf.schemas.errors import DataRejected

#: an interval holds 95 %; it needs so many of the ships that were drawn
_TAIL, ENOUGH = 2.5, 0.8
#: from this share of its draws on a model is called unstable
_MOSTLY = 0.5


@dataclass(frozen=True)
class PredictedFigure:
    """A number with its 95 % interval; all None where too few ships have it."""

    value: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True, eq=False)
class OfModel:
    """What one model predicts."""

    model: Identified
    #: Of the estimates.
    sailed: Sailed | None
    #: Of the draws that are ships.
    drawn: tuple[Sailed, ...]
    #: How many draws are none.
    no_ships: int
    #: How many of all draws are unstable on a straight course.
    unstable: int

    @property
    def sails(self) -> bool:
        """Whether the ship of the estimates sails the manoeuvre, and enough of those that were drawn."""
        return self.sailed is not None and len(self.drawn) >= ENOUGH * (len(self.drawn) + self.no_ships)

    @property
    def figures(self) -> dict[str, PredictedFigure]:
        """By name, from this model alone."""
        return figures_of(self.sailed, [self])


@dataclass(frozen=True, eq=False)
class Prediction:
    """A predicted manoeuvre."""

    manoeuvre: Manoeuvre
    figures: Mapping[str, PredictedFigure]
    #: The model that was asked for first.
    models: tuple[OfModel, ...]
    extrapolated: tuple[Beyond, ...]
    imo: tuple[Judged, ...]
    #: Models that fit as well as the first one, whose ships run away or never come to the end: in no figure.
    run_away: tuple[Identified, ...] = ()

    @property
    def sailed(self) -> Sailed:
        """What the ship of the estimates does."""
        sailed = self.models[0].sailed
        assert sailed is not None
        return sailed

    @property
    def drawn(self) -> list[Sailed]:
        """What all ships do."""
        return [sailed for model in self.models for sailed in model.drawn]

    @property
    def no_ships(self) -> int:
        """How many draws are no ships."""
        return sum(model.no_ships for model in self.models)

    @property
    def share_unstable(self) -> float:
        """Share of all draws that are unstable on a straight course."""
        return sum(model.unstable for model in self.models) / (len(self.drawn) + self.no_ships)


def predict(
    models: Sequence[Identified],
    manoeuvre: Manoeuvre,
    logs: Reach,
    vessel: Particulars,
    count: int = DRAWS,
) -> Prediction:
    """Predict a manoeuvre.

    Parameters
    ----------
    models : sequence of Identified
        The one that is asked for, then those that fit as well. Of these a model whose ships do not
        sail the manoeuvre is left out: what fits the logs as well may be no ship beyond them.
    logs : Reach
        How far out the logs go.
    vessel : Particulars
        For the criteria.
    count : int, optional
        Ships drawn from every model, a power of two.

    Raises
    ------
    DataRejected
        ``predicts_no_ship``: the ship of the first model's estimates, or too many of those that its errors allow, does
        not sail it.
    """
    every = [_of_model(model, manoeuvre, count) for model in models]
    first = every[0].sailed
    if first is None or not every[0].sails:
        raise _no_ship(every[0], manoeuvre, logs, count)
    sailing = tuple(model for model in every if model.sails)
    samples, drawn = _samples(sailing), sum(len(model.drawn) + model.no_ships for model in sailing)
    speed, extrapolated = models[0].waters.approach_m_s, beyond(first.reach, logs)
    return Prediction(
        manoeuvre,
        figures_of(first, sailing),
        sailing,
        extrapolated,
        judge(manoeuvre, samples, drawn, vessel, speed, extrapolated),
        tuple(model.model for model in every if not model.sails),
    )


def figures_of(sailed: Sailed | None, models: Sequence[OfModel]) -> dict[str, PredictedFigure]:
    """Return the figures of a ship, each with the interval from the lowest to the highest that one of the models has.

    So it holds 95 % whichever of them is the ship. Percentiles of all their draws together would not: beside a model
    that is surer they cut into the interval of the one that was asked for.
    """
    each = [_samples([model]) for model in models]
    figures = {}
    for name, values in _samples(models).items():
        of_each = [of_model[name] for of_model in each if name in of_model]
        there = [drawn[np.isfinite(drawn)] for drawn in of_each]
        # a model few of whose ships come to a figure has no interval of it
        many = [kept for kept, drawn in zip(there, of_each, strict=True) if kept.size >= ENOUGH * drawn.size]
        value = sailed.figures[name] if sailed is not None else np.nan
        if not many or sum(kept.size for kept in there) < ENOUGH * values.size or not np.isfinite(value):
            figures[name] = PredictedFigure(None, None, None)
        else:
            ends = np.array([np.percentile(kept, [_TAIL, 100.0 - _TAIL]) for kept in many])
            figures[name] = PredictedFigure(float(value), float(ends[:, 0].min()), float(ends[:, 1].max()))
    return figures


def _samples(models: Sequence[OfModel]) -> dict[str, Float]:
    drawn = [sailed for model in models for sailed in model.drawn]
    return {name: np.array([sailed.figures[name] for sailed in drawn]) for name in (drawn[0].figures if drawn else ())}


def _of_model(model: Identified, manoeuvre: Manoeuvre, count: int) -> OfModel:
    ships = list(model.ships(count))
    drawn = tuple(sailed for sailed in map(manoeuvre.sailed, ships) if sailed is not None)
    unstable = sum(ship.unstable for ship in ships)
    return OfModel(model, manoeuvre.sailed(model.ship), drawn, count - len(drawn), unstable)


def _no_ship(first: OfModel, manoeuvre: Manoeuvre, logs: Reach, count: int) -> DataRejected:
    model, itself, lost = first.model, first.sailed is None, first.no_ships
    whose = "the ship of the estimates and " if itself else ""
    share = first.unstable / count
    why = (
        "An unstable hull without damping that grows with the motion turns without limit."
        if share >= _MOSTLY
        else "Straight on she is stable, but in a turn this hard her speed falls and she slides: what holds a hull "
        "back there is not in the model, as no manoeuvre that it was identified from is as hard."
    )
    return DataRejected(
        "predicts_no_ship",
        f"{model.name} predicts no {manoeuvre.name}: {whose}{lost} of {count} ships that its errors allow run away or "
        f"never come to its end. {why}",
        "Sail a turning circle or a spiral beside the zigzags and let `kempf diagnose` look for the damping; or "
        "predict with a set that has it, or with less rudder: the logs cover "
        f"{degrees(logs.rudder_rad):.3g} deg.",
        {"no_ships": lost, "draws": count, "estimates_sail": not itself, "share_unstable": share},
    )
