"""What a person says of one manoeuvre."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

#: ``correct``: other bounds. ``exclude``: it counts no longer. ``accept``: it counts, as it was found or added.
#: ``add``: a zigzag that the search did not find.
Action = Literal["correct", "exclude", "accept", "add"]

#: first and last instant, UTC nanoseconds
Bounds = tuple[int, int]


@dataclass(frozen=True)
class Correction:
    """What a person said of one manoeuvre."""

    action: Action
    #: First and last instant of the manoeuvre as it was found or added, UTC nanoseconds.
    subject_utc_ns: Bounds
    #: Those that it is given, UTC nanoseconds; None where it is given none.
    bounds_utc_ns: Bounds | None
    reason: str
