"""Settings of a diagnosis, by themselves: what is stored is looked up by them without anything being computed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DiagnosisSettings:
    """Settings of a diagnosis; all of them are part of its identity.

    Attributes
    ----------
    level : float
        Adjusted p-value below which a candidate is refitted.
    refits : int
        At most, of one step.
    most_steps : int
        Effects added at most.
    """

    level: float = 0.01
    refits: int = 6
    most_steps: int = 4


STANDARD = DiagnosisSettings()
