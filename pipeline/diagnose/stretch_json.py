"""What is said of a stretch: the ranked effects as JSON content, and sentences that a naval architect can act on."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from kempf.pipeline.diagnose.effect_finding import POWER, channels_say
from kempf.pipeline.diagnose.effect_score import Solved
from kempf.pipeline.diagnose.settings import STANDARD
from kempf.pipeline.diagnose.stretch import FEWEST, Explained, StretchEffect
from kempf.schemas.enumeration import listed

#: p-value below which the stretch as a whole is worse than a right model leaves it
_MISFIT = 0.01
#: names in a sentence
_MOST_NAMES = 4
Verdict = Literal["stands_out", "nothing_stands_out", "too_short"]


def verdict(found: Explained) -> Verdict:
    """Return whether an effect stands out in a stretch."""
    if found.too_short:
        return "too_short"
    return "stands_out" if _standing_out(found) else "nothing_stands_out"


def as_json(found: Explained) -> dict[str, Any]:
    """Return what is said of a stretch, JSON content; what is not finite is None."""
    return {
        "verdict": verdict(found),
        "sentences": _sentences(found),
        "instants": found.instants,
        "measurements": found.measurements,
        "times_a_right_model": found.square / found.measurements if found.measurements else None,
        "p_misfit": found.p_misfit,
        "misfit": found.beyond,
        "stretches_of_this_length": found.of_its_length,
        "level": STANDARD.level,
        "effects": [_effect(found, one) for one in found.effects],
    }


def _standing_out(found: Explained) -> list[StretchEffect]:
    return [one for one in found.effects if one.p_adjusted < STANDARD.level and not why_not_testable(one)]


def why_not_testable(one: StretchEffect) -> str:
    """Say why a stretch shows nothing of an effect; empty where it does."""
    by_channels = channels_say(one.missing, one.measured_by)
    if by_channels:
        return by_channels
    if not np.isfinite(one.here.score):
        share = "" if np.isnan(one.absorption) else f", which absorbs {100.0 * one.absorption:.4g} % of it"
        return f"the stretch does not distinguish it from the model as it is{share}"
    made = np.isfinite(one.here.std)
    parameters = [p for p, m in zip(one.effect.parameters, made, strict=True) if m]
    reach = np.array([max(abs(p.low), abs(p.high)) for p in parameters])
    if np.all(reach < POWER * one.here.std[made]):
        error = f"{one.here.std[made][0]:.2g} {parameters[0].unit.removesuffix('1')}".rstrip()
        return f"in so short a stretch its standard error, {error}, is as large as any size that is physical"
    return ""


def _effect(found: Explained, one: StretchEffect) -> dict[str, Any]:
    untestable = why_not_testable(one)
    stands_out = not untestable and one.p_adjusted < STANDARD.level
    scored = bool(np.isfinite(one.here.score))
    return {
        "effect": one.effect.name,
        "title": one.effect.title,
        "verdict": "not_testable" if untestable else "stands_out" if stands_out else "not_seen",
        "why": untestable,
        "score": _number(one.here.score),
        "p_value": one.p_value if scored else None,
        "p_adjusted": one.p_adjusted if scored else None,
        # where the stretch was chosen because it is the worst of all as long as it
        "p_if_worst": min(1.0, found.of_its_length * one.p_adjusted) if scored else None,
        "explained": one.explained if scored else None,
        "explained_of_misfit": _of_misfit(found, one) if scored else None,
        "size": _size(one, one.here) if scored else {},
        "absorption": _number(one.absorption),
        "everywhere": {"score": _number(one.everywhere.score), "size": _size(one, one.everywhere)},
        "alike": list(one.alike),
    }


def _of_misfit(found: Explained, one: StretchEffect) -> float | None:
    """Return what an effect would take of what a right model would not leave; None where it leaves as much."""
    if found.p_misfit >= _MISFIT or found.beyond <= 0.0:
        return None
    return float(np.clip(one.explained / found.beyond, 0.0, 1.0))


def _size(one: StretchEffect, sized: Solved) -> dict[str, dict[str, Any]]:
    return {
        p.name: {"value": _number(value), "std": _number(std), "unit": p.unit}
        for p, value, std in zip(one.effect.parameters, sized.change, sized.std, strict=True)
    }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _sentences(found: Explained) -> list[str]:
    if found.too_short:
        return [
            f"Too short: {found.instants} instants with a measurement; at least {FEWEST} are needed for a score of "
            "them alone. Take a longer stretch."
        ]
    ratio = found.square / found.measurements
    worse = found.p_misfit < _MISFIT
    said = [
        f"The squared errors one step ahead are {ratio:.2g} times what a right model leaves in {found.measurements} "
        f"measurements at {found.instants} instants"
        + (f" (p = {found.p_misfit:.1g})." if worse else ": no more than chance allows.")
    ]
    best = _standing_out(found)
    if not best:
        said.append(
            "Nothing stands out: a right model leaves as much for an effect of the catalogue to explain."
            if not worse
            else "No effect of the catalogue stands out: what is wrong here is none of them, too weak in so short a "
            "stretch, or noise that this stretch has more of."
        )
        return said
    first = best[0]
    share = _of_misfit(found, first)
    line = f"First {first.effect.title}"
    line += f", which would explain {100.0 * share:.0f} % of the misfit" if share is not None else ""
    said.append(line + f" (adjusted p = {first.p_adjusted:.1g}).")
    alike = [one.effect.title for one in best[1:] if one.effect.name in first.alike]
    if alike:
        more = f" and {len(alike) - _MOST_NAMES} more" if len(alike) > _MOST_NAMES else ""
        said.append(f"The stretch does not distinguish it from {listed(alike[:_MOST_NAMES])}{more}.")
    if min(1.0, found.of_its_length * first.p_adjusted) >= STANDARD.level:
        said.append(
            f"If it was picked as the worst of the {found.of_its_length} stretches as long as it, chance alone leaves "
            "as much in one of them."
        )
    said.append("This ranks; whether an effect is there, a diagnosis of all manoeuvres decides.")
    return said
