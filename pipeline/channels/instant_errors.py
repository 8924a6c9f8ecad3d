"""How well the instants of a log's instruments are known: an error of these is one error for the whole log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from kempf.pipeline.channels.found_instants import AS_TAKEN, OTHERS, VELOCITY, FoundInstants
from kempf.schemas.enumeration import listed


@dataclass(frozen=True)
class InstantErrors:
    """Standard errors of the instants at which the instruments of a log measured, s; 0 where they are in the log.

    A value in rows that sample their instruments was measured somewhere within the row before it first shows (decisions
    0073 and 0109), one behind a stamp of whole seconds somewhere within that second (decision 0114), and a velocity
    that is smoothed comes late (decision 0045). All are off by as much in all manoeuvres of a log.
    """

    velocity_s: float = 0.0
    heading_s: float = 0.0
    yaw_rate_s: float = 0.0
    rudder_s: float = 0.0
    #: Of the lateness of a velocity that may be smoothed, whether it was undone or not.
    smoothing_s: float = 0.0
    #: What has been found of the others, and was taken out of the instants.
    found: FoundInstants = AS_TAKEN
    #: Time between the rows of a table, s, see `kempf.pipeline.channels.instruments.Instruments`.
    row_s: float = 0.0

    @property
    def known(self) -> bool:
        """Whether all instants are those in the log."""
        return not any((self.velocity_s, self.heading_s, self.yaw_rate_s, self.rudder_s, self.smoothing_s))


#: of a log in which every reading has its instant
IN_THE_LOG = InstantErrors()


def instant_errors(
    instant_std_s: Mapping[str, float], late_std_s: float, found: FoundInstants = AS_TAKEN, row_s: float = 0.0
) -> InstantErrors:
    """Return the errors of the instants of one log.

    Parameters
    ----------
    instant_std_s : mapping of str to float
        See `kempf.pipeline.channels.instruments.Instruments`.
    late_std_s : float
        Standard error of the lateness of a smoothed velocity, s.
    found : FoundInstants, optional
        What was taken out of the instants.
    row_s : float, optional
        Time between the rows of a table, s; 0 of messages.
    """
    velocity = max(instant_std_s.get(name, 0.0) for name in VELOCITY)
    heading, yaw_rate, rudder = (instant_std_s.get(name, 0.0) for name in OTHERS)
    return InstantErrors(velocity, heading, yaw_rate, rudder, late_std_s, found, row_s)


def said_of(instant_std_s: Mapping[str, float]) -> tuple[str, ...]:
    """Return a sentence for every size of the errors of a log's instants.

    Parameters
    ----------
    instant_std_s : mapping of str to float
        See `kempf.pipeline.channels.instruments.Instruments`.
    """
    by_size: dict[str, list[str]] = {}
    for name in (*VELOCITY, *OTHERS):
        if instant_std_s.get(name, 0.0) > 0.0:
            by_size.setdefault(f"{instant_std_s[name]:.1g}", []).append(name.replace("_", " "))
    return tuple(
        f"the log does not have the instants of {listed(names)}: they are known to {size} s (1 s.e.)"
        for size, names in by_size.items()
    )
