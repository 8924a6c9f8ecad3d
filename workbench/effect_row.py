"""An effect as a report lists and draws it."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from kempf.schemas.diagnosis_evidence import FittedParameter


@dataclass(frozen=True)
class EffectRow:
    """One effect of the catalogue beside the first model."""

    #: title, verdict, why: The verdict in the report's words.
    title: str
    verdict: str
    why: str
    #: Of the confusion set that the report claims it in; empty where it claims none.
    set_id: str
    #: score, p_adjusted, absorption: NaN where it cannot be tested.
    score: float
    p_adjusted: float
    absorption: float
    #: Expected size of each of its parameters.
    changes: tuple[FittedParameter, ...]

    @property
    def tested(self) -> bool:
        """Whether it has a score."""
        return isfinite(self.score)
