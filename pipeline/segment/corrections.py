"""What a person said of the manoeuvres of a log, laid over what the search found in it.

A correction names its manoeuvre by its bounds and not by an id, so that it holds when newer code finds the same
manoeuvre a little earlier or later. Of several corrections of one manoeuvre the last decides.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from kempf.pipeline.segment.zigzags.zigzag import Zigzag
from kempf.schemas.correction import Action, Bounds, Correction
from kempf.schemas.errors import DataRejected

#: bounds are of the same manoeuvre where they share more than this of the shorter one
_SAME = 0.5


@dataclass(frozen=True)
class Standing:
    """How one manoeuvre stands after all that was said of it."""

    subject_utc_ns: Bounds
    #: None: those that it was found with.
    bounds_utc_ns: Bounds | None
    #: Those that it was added with; None where the search found it.
    added_utc_ns: Bounds | None
    #: What was said last.
    action: Action
    reason: str

    @property
    def excluded(self) -> str | None:
        """Why it does not count; None where it does."""
        return self.reason if self.action == "exclude" else None

    def concerns(self, start_utc_ns: int, end_utc_ns: int) -> bool:
        """Whether bounds are those of this manoeuvre, as it was found or as it is now."""
        own = [self.subject_utc_ns] + [self.bounds_utc_ns] * (self.bounds_utc_ns is not None)
        return any(same(bounds, (start_utc_ns, end_utc_ns)) for bounds in own if bounds is not None)


@dataclass(frozen=True, eq=False)
class Marked:
    """A zigzag, and what was said of it; None where nobody said anything."""

    zigzag: Zigzag
    standing: Standing | None = None


def same(one: Bounds, other: Bounds) -> bool:
    """Whether two pairs of bounds are those of one manoeuvre."""
    shared = min(one[1], other[1]) - max(one[0], other[0])
    return shared > _SAME * min(one[1] - one[0], other[1] - other[0])


def standing(corrections: Sequence[Correction]) -> tuple[Standing, ...]:
    """Return how the manoeuvres of one log stand, in the order in which they were first spoken of.

    Parameters
    ----------
    corrections : sequence of Correction
        Of one log, in the order in which they were said.
    """
    standings: list[Standing] = []
    for correction in corrections:
        at = next((k for k, known in enumerate(standings) if known.subject_utc_ns == correction.subject_utc_ns), None)
        if at is None:
            added = correction.bounds_utc_ns if correction.action == "add" else None
            standings.append(
                Standing(
                    correction.subject_utc_ns, correction.bounds_utc_ns, added, correction.action, correction.reason
                )
            )
            continue
        known = standings[at]
        bounds = {"correct": correction.bounds_utc_ns, "accept": known.added_utc_ns}.get(
            correction.action, known.bounds_utc_ns
        )
        standings[at] = replace(known, bounds_utc_ns=bounds, action=correction.action, reason=correction.reason)
    return tuple(standings)


def applied(
    zigzags: Sequence[Zigzag], standings: Sequence[Standing], between: Callable[[Bounds], Zigzag]
) -> tuple[tuple[Marked, ...], tuple[str, ...]]:
    """Lay what was said over the zigzags that were found.

    Parameters
    ----------
    zigzags : sequence of Zigzag
        Those of a log, in order of time.
    standings : sequence of Standing
        `standing` of its corrections.
    between : callable
        Describes the zigzag between two bounds, `kempf.pipeline.segment.zigzags.by_hand.zigzag_between`.

    Returns
    -------
    tuple of Marked
        In order of time: those that do not count are among them. One that was given other bounds takes the place of
        every one that was found there.
    tuple of str
        Of bounds given by a person that hold no zigzag, one sentence each: they stop nothing else.
    """
    by_hand, marked, notes = [], [], []
    for statement in standings:
        if statement.bounds_utc_ns is None:
            continue
        try:
            marked.append(Marked(between(statement.bounds_utc_ns), statement))
            by_hand.append(statement)
        except DataRejected:
            if statement.excluded is None:
                notes.append(
                    f"a zigzag {'added' if statement.action == 'add' else 'corrected'} by hand ({statement.reason}) "
                    "is not there: between its bounds the rudder is not held to one side and then to the other"
                )
    for zigzag in zigzags:
        bounds = zigzag.start_utc_ns, zigzag.end_utc_ns
        if any(statement.concerns(*bounds) for statement in by_hand):
            continue
        marked.append(Marked(zigzag, next((statement for statement in standings if statement.concerns(*bounds)), None)))
    return tuple(sorted(marked, key=lambda mark: (mark.zigzag.start_utc_ns, mark.zigzag.end_utc_ns))), tuple(notes)
