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
    # what readings too far apart leave of a misfit is not the model's
    if too_few(diagnosis) or (nothing_claimed and diagnosis.unresolved is not None):
        return "insufficient_data"
    if diagnosis.something_left or diagnosis.unresolved is not None:
        return "unexplained" if nothing_claimed else "partly_explained"
    sizes = [len(step.chosen_from) for step in diagnosis.steps[1:]]
    last = diagnosis.steps[-1].ahead
    if last is not None and last.disagrees is not None:
        # the flexible reference, one step ahead, may see nothing left: disturbances carry it
        return "unexplained" if nothing_claimed else "partly_explained"
    if nothing_claimed:
        return "adequate"
    return "explained" if max(sizes) == 1 else "ambiguous"


def too_few(diagnosis: Diagnosis) -> bool:
    """Return whether there are too few manoeuvres for a verdict.

    Of two manoeuvres predictions do not choose, so that nothing is known of most effects that are not claimed.
    """
    few = len(diagnosis.fitted) + len(diagnosis.held) < FEWEST
    return diagnosis.before is None or (few and len(diagnosis.steps) == 1)


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
