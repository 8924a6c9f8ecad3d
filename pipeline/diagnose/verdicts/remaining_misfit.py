"""What the last model leaves one leg ahead: how much of it is noise of the experiment, and where it sits."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from kempf.pipeline.estimate.record.record import MEASUREMENTS
from kempf.pipeline.shooting.ahead import Ahead
from kempf.pipeline.shooting.places import MisfitPart, Places, places
from kempf.pipeline.shooting.repeats import Repeats, repeats
from kempf.schemas.enumeration import at_the_beginning

_OF = {"rudder": "rudder", "yaw_rate": "yaw rate", "drift": "drift"}


@dataclass(frozen=True)
class RemainingMisfit:
    """What a model leaves one leg ahead."""

    repeats: Repeats
    #: Of all manoeuvres, each predicted by parameters that have not seen it.
    places: Places


def remaining_misfit(ahead: Ahead, workers: Executor) -> RemainingMisfit | None:
    """Return what a model leaves; None where it runs away."""
    windows = [*(shot.windows for shot in ahead.fit.shots), *ahead.held_windows]
    by_place = places(windows, [*ahead.left_out.errors, *ahead.held.errors])
    if by_place is None:
        return None
    return RemainingMisfit(repeats(ahead.fit, ahead.held_windows, ahead.horizon_s, workers), by_place)


def said(remaining: RemainingMisfit, misfit: str) -> list[str]:
    """Return in a sentence each how much of the misfit is noise, and where it sits.

    Parameters
    ----------
    misfit : str
        The misfit that is meant.
    """
    return [_noise(remaining.repeats, misfit), _sits(remaining.places, misfit)]


def _noise(noise: Repeats, misfit: str) -> str:
    if noise.share is None or noise.std is None:
        few = "no two legs repeat"
        if noise.pairs:
            few = (
                f"only {noise.pairs} pair{' of legs nearly repeats' if noise.pairs == 1 else 's of legs nearly repeat'}"
            )
        return (
            f"How much of {misfit} is noise of the experiment is not known: {few} each other in different manoeuvres."
        )
    share = min(max(noise.share, 0.0), 1.0)
    return (
        f"Of {misfit}, {100.0 * share:.0f} ± {100.0 * noise.std:.0f} % (1 s.e.) is noise of the experiment, by "
        f"{noise.pairs} pairs of legs in {noise.manoeuvres} manoeuvres that nearly repeat each other."
    )


def _sits(by_place: Places, misfit: str) -> str:
    channel = int(np.nanargmax(by_place.channels))
    name, share = MEASUREMENTS[channel].replace("_", " "), 100.0 * by_place.channels[channel]
    sentence = f"{at_the_beginning(misfit)} is largest in {name} ({share:.0f} % of it)"
    regime, manoeuvre = by_place.most("leg", *_OF), by_place.most("manoeuvre")
    named = [_held(place) for place in (regime, manoeuvre) if place is not None]
    if not named:
        return f"{sentence}; no manoeuvre, leg, rudder angle, yaw rate or drift stands out."
    return f"{sentence}; {' and '.join(named)}."


def _held(place: MisfitPart) -> str:
    holds = f"{100.0 * place.share:.0f} % of it in {100.0 * place.of_windows:.0f} % of the time"
    if place.by == "manoeuvre":
        return f"the manoeuvre {place.name} has {holds}"
    if place.by == "leg":
        return f"{f'leg {place.name} of the manoeuvres' if place.name != '0' else 'the approach'} has {holds}"
    part = f"the third of the time with {place.name} {_OF[place.by]}"
    if place.name == "middle":
        part = f"the middle third of the time by {_OF[place.by]}"
    return f"{part} has {100.0 * place.share:.0f} % of it"


def as_json(remaining: RemainingMisfit) -> dict[str, Any]:
    """Return it as JSON content."""
    noise = remaining.repeats
    return {
        "noise_share": noise.share,
        "noise_share_std": noise.std,
        "pairs": noise.pairs,
        "manoeuvres": noise.manoeuvres,
        "channels": dict(zip(MEASUREMENTS, remaining.places.channels, strict=True)),
        "places": [
            {"by": place.by, "name": place.name, "share": place.share, "of_windows": place.of_windows}
            for place in remaining.places.places
        ],
    }
