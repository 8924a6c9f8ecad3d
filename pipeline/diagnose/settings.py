"""Settings of a diagnosis, by themselves: what is stored is looked up by them without anything being computed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DiagnosisSettings:
    """Settings of a diagnosis; all of them are part of its identity."""

    #: Adjusted p-value below which a candidate is refitted.
    level: float = 0.01
    #: At most, of one step.
    refits: int = 6
    #: Standard errors, allowing for errors that hang together within a leg, from which a candidate is certain.
    certain_std: float = 3.0
    #: Effects added at most.
    most_steps: int = 4


STANDARD = DiagnosisSettings()
