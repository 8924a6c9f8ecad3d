"""What decides whether a change is reported; every number stands here."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ChangeSettings:
    """Settings of the search for changes."""

    #: Probability of reporting a change of a ship that did not change.
    level: float = 0.05
    #: Simulated histories without change that the level is calibrated on.
    draws: int = 499
    #: Of them: equal histories give equal answers.
    seed: int = 1946
    #: Occasions that must lie on either side of a step: one alone may be a trial that went wrong.
    smallest_side: int = 2
    #: How many degrees of freedom the sets' own covariances are worth against their scatter.
    prior_dof: float = 4.0
    #: Degrees of freedom of Student's t in the simulated histories: some trials go worse than their covariances say.
    tail_dof: float = 8.0
    #: Factor on the level inside: how far the scatter between trials is from known shows in no simulated history. At 1
    #: the false alarms of histories of 4 or 5 scattering sets lay above the level.
    caution: float = 0.6
    #: Sets begun within this time are one occasion, s.
    occasion_s: float = 12 * 3600.0
    #: Probability with which the smallest change that is reported would be seen.
    power: float = 0.9

    @property
    def fewest(self) -> int:
        """Occasions without which nothing can be tested."""
        return 2 * self.smallest_side
