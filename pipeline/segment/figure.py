"""One figure of a manoeuvre with its 95 % interval, or with the reason why there is none."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from kempf.schemas.confidence import NORMAL_95


@dataclass(frozen=True)
class MeasuredFigure:
    """A figure in the unit that its name ends on."""

    #: None where the log does not hold it.
    value: float | None
    #: low, high: 95 % interval; None where it is not known.
    low: float | None
    high: float | None
    #: Why the figure or its interval is not there; empty where both are.
    why: str = ""

    @classmethod
    def of(cls, value: float, std: float, why: str = "") -> MeasuredFigure:
        """Return the figure of an estimate and its standard error; NaN for what is not known, and then why."""
        if not isfinite(value):
            return cls(None, None, None, why)
        if not isfinite(std):
            return cls(value, None, None, why)
        return cls(value, value - NORMAL_95 * std, value + NORMAL_95 * std)

    @property
    def std(self) -> float:
        """Standard error; NaN where it is not known."""
        return float("nan") if self.low is None or self.high is None else (self.high - self.low) / (2.0 * NORMAL_95)
