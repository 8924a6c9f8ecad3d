"""What a diagnosis comes to."""

from __future__ import annotations

from typing import Literal

from kempf.pipeline.diagnose.diagnosis import Diagnosis

Verdict = Literal["adequate", "explained", "ambiguous", "partly_explained", "unexplained", "insufficient_data"]


def verdict(diagnosis: Diagnosis) -> Verdict:
    """Return what the diagnosis comes to."""
    if diagnosis.before is None:
        return "insufficient_data"
    if diagnosis.something_left:
        return "partly_explained" if len(diagnosis.steps) > 1 else "unexplained"
    sizes = [len(step.chosen_from) for step in diagnosis.steps[1:]]
    if not sizes:
        return "adequate"
    last = diagnosis.steps[-1].ahead
    if last is not None and last.disagrees is not None:
        # the flexible reference, one step ahead, may see nothing left: disturbances carry it
        return "partly_explained"
    return "explained" if max(sizes) == 1 else "ambiguous"


def share_explained(diagnosis: Diagnosis) -> float | None:
    """Return the part of the misfit one leg ahead, in manoeuvres left out, that the last model explains."""
    first, last = diagnosis.steps[0].ahead, diagnosis.steps[-1].ahead
    if first is None or last is None or last is first:
        return None
    return 1.0 - last.left_out.mean / first.left_out.mean
