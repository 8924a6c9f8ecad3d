"""What is said of a stretch: the ranked effects as JSON content, and sentences that a naval architect can act on."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from kempf.pipeline.diagnose.screening.effect_score import Solved
from kempf.pipeline.diagnose.settings import STANDARD
from kempf.pipeline.diagnose.stretches.stretch import FEWEST, Explained, StretchEffect
from kempf.pipeline.diagnose.verdicts.effect_finding import POWER, channels_say
from kempf.schemas.enumeration import listed

#: p-value below which the stretch as a whole is worse than a right model leaves it
_MISFIT = 0.01
#: names in a sentence
_MOST_NAMES = 4
Verdict = Literal["stands_out", "nothing_stands_out", "too_short"]


def verdict(stretch: Explained) -> Verdict:
    """Return whether an effect stands out in a stretch."""
    if stretch.too_short:
        return "too_short"
    return "stands_out" if _standing_out(stretch) else "nothing_stands_out"


def as_json(stretch: Explained) -> dict[str, Any]:
    """Return what is said of a stretch, JSON content; what is not finite is None."""
    return {
        "verdict": verdict(stretch),
        "sentences": _sentences(stretch),
        "instants": stretch.instants,
        "measurements": stretch.measurements,
        "times_a_right_model": stretch.square / stretch.measurements if stretch.measurements else None,
        "p_misfit": stretch.p_misfit,
        "misfit": stretch.beyond,
        "stretches_of_this_length": stretch.of_its_length,
        "level": STANDARD.level,
        "effects": [_effect(stretch, candidate) for candidate in stretch.effects],
    }


def _standing_out(stretch: Explained) -> list[StretchEffect]:
    return [
        candidate
        for candidate in stretch.effects
        if candidate.p_adjusted < STANDARD.level and not why_not_testable(candidate)
    ]


def why_not_testable(candidate: StretchEffect) -> str:
    """Say why a stretch shows nothing of an effect; empty where it does."""
    by_channels = channels_say(candidate.missing, candidate.measured_by)
    if by_channels:
        return by_channels
    if not np.isfinite(candidate.here.score):
        share = "" if np.isnan(candidate.absorption) else f", which absorbs {100.0 * candidate.absorption:.4g} % of it"
        return f"the stretch does not distinguish it from the model as it is{share}"
    known = np.isfinite(candidate.here.std)
    parameters = [p for p, m in zip(candidate.effect.parameters, known, strict=True) if m]
    reach = np.array([max(abs(p.low), abs(p.high)) for p in parameters])
    if np.all(reach < POWER * candidate.here.std[known]):
        error = f"{candidate.here.std[known][0]:.2g} {parameters[0].unit.removesuffix('1')}".rstrip()
        return f"in so short a stretch its standard error, {error}, is as large as any size that is physical"
    return ""


def _effect(stretch: Explained, candidate: StretchEffect) -> dict[str, Any]:
    untestable = why_not_testable(candidate)
    stands_out = not untestable and candidate.p_adjusted < STANDARD.level
    scored = bool(np.isfinite(candidate.here.score))
    return {
        "effect": candidate.effect.name,
        "title": candidate.effect.title,
        "verdict": "not_testable" if untestable else "stands_out" if stands_out else "not_seen",
        "why": untestable,
        "score": _number(candidate.here.score),
        "p_value": candidate.p_value if scored else None,
        "p_adjusted": candidate.p_adjusted if scored else None,
        # where the stretch was chosen because it is the worst of all as long as it
        "p_if_worst": min(1.0, stretch.of_its_length * candidate.p_adjusted) if scored else None,
        "explained": candidate.explained if scored else None,
        "explained_of_misfit": _of_misfit(stretch, candidate) if scored else None,
        "size": _size(candidate, candidate.here) if scored else {},
        "absorption": _number(candidate.absorption),
        "everywhere": {"score": _number(candidate.everywhere.score), "size": _size(candidate, candidate.everywhere)},
        "alike": list(candidate.alike),
    }


def _of_misfit(stretch: Explained, candidate: StretchEffect) -> float | None:
    """Return what an effect would take of what a right model would not leave; None where it leaves as much."""
    if stretch.p_misfit >= _MISFIT or stretch.beyond <= 0.0:
        return None
    return float(np.clip(candidate.explained / stretch.beyond, 0.0, 1.0))


def _size(candidate: StretchEffect, sized: Solved) -> dict[str, dict[str, Any]]:
    return {
        p.name: {"value": _number(value), "std": _number(std), "unit": p.unit}
        for p, value, std in zip(candidate.effect.parameters, sized.change, sized.std, strict=True)
    }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _sentences(stretch: Explained) -> list[str]:
    if stretch.too_short:
        return [
            f"Too short: {stretch.instants} instants with a measurement; at least {FEWEST} are needed for a score of "
            "them alone. Take a longer stretch."
        ]
    ratio = stretch.square / stretch.measurements
    worse = stretch.p_misfit < _MISFIT
    lines = [
        f"The squared errors one step ahead are {ratio:.2g} times what a right model leaves in {stretch.measurements} "
        f"measurements at {stretch.instants} instants"
        + (f" (p = {stretch.p_misfit:.1g})." if worse else ": no more than chance allows.")
    ]
    best = _standing_out(stretch)
    if not best:
        lines.append(
            "Nothing stands out: a right model leaves as much for an effect of the catalogue to explain."
            if not worse
            else "No effect of the catalogue stands out: what is wrong here is none of them, too weak in so short a "
            "stretch, or noise that this stretch has more of."
        )
        return lines
    first = best[0]
    share = _of_misfit(stretch, first)
    line = f"Ranked first is {first.effect.title}"
    line += f", which would explain {100.0 * share:.0f} % of the misfit" if share is not None else ""
    lines.append(line + f" (adjusted p = {first.p_adjusted:.1g}).")
    alike = [candidate.effect.title for candidate in best[1:] if candidate.effect.name in first.alike]
    if alike:
        more = f" and {len(alike) - _MOST_NAMES} more" if len(alike) > _MOST_NAMES else ""
        lines.append(f"The stretch does not distinguish it from {listed(alike[:_MOST_NAMES])}{more}.")
    if min(1.0, stretch.of_its_length * first.p_adjusted) >= STANDARD.level:
        lines.append(
            f"If it was picked as the worst of the {stretch.of_its_length} stretches as long as it, chance alone "
            "leaves as much in one of them."
        )
    lines.append("This ranks; whether an effect is there, a diagnosis of all manoeuvres decides.")
    return lines
