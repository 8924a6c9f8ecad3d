"""What the last model leaves one leg ahead: how much of it is noise of the experiment, and where it sits."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from kempf.pipeline.shooting.ahead import Ahead
from kempf.pipeline.shooting.places import Place, Places, places
from kempf.pipeline.shooting.repeats import Repeats, repeats

_CHANNELS = ("lateral_speed", "yaw_rate", "heading")
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
    found = places(windows, [*ahead.left_out.errors, *ahead.held.errors])
    if found is None:
        return None
    return RemainingMisfit(repeats(ahead.fit, ahead.held_windows, ahead.horizon_s, workers), found)


def said(remaining: RemainingMisfit, what: str) -> list[str]:
    """Return in a sentence each how much of the misfit is noise, and where it sits.

    Parameters
    ----------
    what : str
        The misfit that is meant.
    """
    return [_noise(remaining.repeats, what), _sits(remaining.places, what)]


def _noise(found: Repeats, what: str) -> str:
    if found.share is None or found.std is None:
        few = "no two legs repeat"
        if found.pairs:
            few = (
                f"only {found.pairs} pair{' of legs nearly repeats' if found.pairs == 1 else 's of legs nearly repeat'}"
            )
        return f"How much of {what} is noise of the experiment is not known: {few} each other in different manoeuvres."
    share = min(max(found.share, 0.0), 1.0)
    return (
        f"Of {what}, {100.0 * share:.0f} ± {100.0 * found.std:.0f} % (1 s.e.) is noise of the experiment, by "
        f"{found.pairs} pairs of legs in {found.manoeuvres} manoeuvres that nearly repeat each other."
    )


def _sits(found: Places, what: str) -> str:
    channel = int(np.nanargmax(found.channels))
    name, share = _CHANNELS[channel].replace("_", " "), 100.0 * found.channels[channel]
    said = f"{what[:1].upper()}{what[1:]} is largest in {name} ({share:.0f} % of it)"
    regime, manoeuvre = found.most("leg", *_OF), found.most("manoeuvre")
    named = [_held(place) for place in (regime, manoeuvre) if place is not None]
    if not named:
        return f"{said}; no manoeuvre, leg, rudder angle, yaw rate or drift stands out."
    return f"{said}; {' and '.join(named)}."


def _held(place: Place) -> str:
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
    found = remaining.repeats
    return {
        "noise_share": found.share,
        "noise_share_std": found.std,
        "pairs": found.pairs,
        "manoeuvres": found.manoeuvres,
        "channels": dict(zip(_CHANNELS, remaining.places.channels, strict=True)),
        "places": [
            {"by": one.by, "name": one.name, "share": one.share, "of_windows": one.of_windows}
            for one in remaining.places.places
        ],
    }
