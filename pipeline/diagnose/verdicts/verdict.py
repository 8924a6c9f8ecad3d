"""What a diagnosis comes to."""

from __future__ import annotations

from math import isfinite
from typing import Literal

from kempf.pipeline.diagnose.steps.by_prediction import FEWEST
from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis
from kempf.pipeline.shooting.ahead import Ahead

Verdict = Literal["adequate", "explained", "ambiguous", "partly_explained", "unexplained", "insufficient_data"]


def verdict(diagnosis: Diagnosis) -> Verdict:
    """Return what the diagnosis comes to."""
    nothing_claimed = len(diagnosis.steps) == 1
    if diagnosis.before is None or (nothing_claimed and len(diagnosis.fitted) + len(diagnosis.held) < FEWEST):
        # of two manoeuvres predictions do not choose, so that nothing is known of most effects
        return "insufficient_data"
    if diagnosis.something_left:
        return "unexplained" if nothing_claimed else "partly_explained"
    sizes = [len(step.chosen_from) for step in diagnosis.steps[1:]]
    last = diagnosis.steps[-1].ahead
    if last is not None and last.disagrees is not None:
        # the flexible reference, one step ahead, may see nothing left: disturbances carry it
        return "unexplained" if nothing_claimed else "partly_explained"
    if nothing_claimed:
        return "adequate"
    return "explained" if max(sizes) == 1 else "ambiguous"


def share_explained(diagnosis: Diagnosis) -> float | None:
    """Return the part of the misfit one leg ahead, in manoeuvres left out, that the last model explains."""
    return _explained(diagnosis.steps[0].ahead, diagnosis.steps[-1].ahead)


def share_of_given(diagnosis: Diagnosis) -> float | None:
    """Return the part of the plain model's misfit that the effects explain which the model had already."""
    return _explained(diagnosis.given[0].ahead, diagnosis.steps[0].ahead) if diagnosis.given else None


def _explained(first: Ahead | None, last: Ahead | None) -> float | None:
    if first is None or last is None or last is first:
        return None
    share = 1.0 - last.left_out.mean / first.left_out.mean
    return share if isfinite(share) else None
