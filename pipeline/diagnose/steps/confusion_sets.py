"""Confusion sets: effects that these data cannot distinguish."""

from __future__ import annotations

from collections.abc import Sequence

from kempf.pipeline.diagnose.screening.effect_score import cosine_squared
from kempf.pipeline.diagnose.screening.screen import Candidate
from kempf.pipeline.diagnose.steps.confirm import Confirmation

#: share of what one effect explains that another would explain alike, above which they are put to the same test
ALIKE = 0.9
#: refits within this of the best information criterion are not distinguished from it
WINDOW = 6.0


def alike(candidate: Candidate, other: Candidate) -> float:
    """Return the squared cosine between what two effects would explain, 0 to 1."""
    return cosine_squared(candidate.direction, other.direction)


def shortlist(candidates: Sequence[Candidate], level: float, count: int) -> list[Candidate]:
    """Return the candidates worth a refit: significant, the highest scores, and what looks like the highest."""
    significant = [candidate for candidate in candidates if candidate.p_adjusted < level]
    if not significant:
        return []
    chosen = significant[:count]
    chosen += [candidate for candidate in significant[count : 2 * count] if alike(candidate, chosen[0]) > ALIKE]
    return chosen


def undecided(confirmed: Sequence[tuple[Candidate, Confirmation]]) -> list[tuple[Candidate, Confirmation]]:
    """Return the confirmed candidates within `WINDOW` of the best, simplest first, then the best."""
    if not confirmed:
        return []
    best = min(confirmation.bic_change for _, confirmation in confirmed)
    close = [pair for pair in confirmed if pair[1].bic_change <= best + WINDOW]
    return sorted(close, key=lambda pair: (len(pair[0].effect.parameters), pair[1].bic_change, pair[0].effect.name))
