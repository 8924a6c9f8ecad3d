"""Whether the readings of the logs are close enough together for the ship whose motion they show (decision 0112)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

from kempf.pipeline.estimate.record.grid_run import GridRun

#: time between readings, in times in which she sails her own length, beyond which motion is not resolved; and what to
#: log. By eq. (16) a yaw rate settles within 1 / (abs(a22) V), a third to two thirds of that time
_TOO_FAR, _ENOUGH = 0.2, 0.1
#: said of an effect that only the likelihood sees in such readings
MAY_IMITATE = "improves the fit, and may imitate what she does between two readings"


@dataclass(frozen=True)
class Unresolved:
    """The rudder or the heading is read too seldom: what she does between its readings is a guess, a straight line."""

    #: ``rudder`` or ``heading``: The one that is read more seldom.
    channel: str
    #: Time between its readings, s.
    period_s: float
    #: Time in which she sails her own length, s.
    length_s: float

    @property
    def says(self) -> str:
        """What is wrong with the readings, a clause."""
        every, length = f"{self.period_s:.2g} s", f"{self.length_s:.2g} s"
        return f"the {self.channel} is read every {every}, and she sails her own length in {length}"

    @property
    def needed(self) -> str:
        """What to log, a sentence."""
        return f"Log rudder and heading at {ceil(1.0 / (_ENOUGH * self.length_s))} Hz or faster."


def unresolved(runs: Sequence[GridRun]) -> Unresolved | None:
    """Return which readings are too far apart in half of the manoeuvres or more; None where they are close enough.

    Where the length of the ship is not known they are taken to be close enough for her.

    Parameters
    ----------
    runs : sequence of GridRun
        At least one; of those concerned the middle one counts.
    """
    found = [one for run in runs if (one := _of_run(run)) is not None]
    if 2 * len(found) < len(runs):
        return None
    found.sort(key=lambda one: one.period_s / one.length_s)
    return found[len(found) // 2]


def _of_run(run: GridRun) -> Unresolved | None:
    if not run.approach_m_s > 0.0:
        return None
    length_s = run.ship.length_m / run.approach_m_s
    channel, period_s = max(("rudder", run.rudder_period_s), ("heading", run.heading_period_s), key=lambda one: one[1])
    return Unresolved(channel, period_s, length_s) if period_s > _TOO_FAR * length_s else None
