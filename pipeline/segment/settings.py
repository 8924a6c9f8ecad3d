"""What counts as a zigzag: every threshold of the search, none of them a fixed duration.

Times are stated as shares of a leg or a ramp of the manoeuvre itself, so a tank model, a tanker and a small unmanned
boat are judged alike.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SegmentSettings:
    """Thresholds of the search for zigzags."""

    #: smallest_rudder_deg, largest_rudder_deg: Range of the rudder delta0, deg.
    smallest_rudder_deg: float = 2.0
    largest_rudder_deg: float = 45.0
    #: smallest_heading_deg, largest_heading_deg: Range of the switching heading psi0, deg. A Williamson turn shifts the
    #: rudder at 60 deg: no zigzag.
    smallest_heading_deg: float = 0.5
    largest_heading_deg: float = 45.0
    #: Half width of the band in which the rudder counts as held while delta0 is still unknown, as a share of it.
    search_band: float = 0.25
    #: The same once delta0 and its neutral offset are known.
    held_band: float = 0.1
    #: Smallest half width of that band, deg.
    held_slack_deg: float = 0.25
    #: Largest difference of one leg's rudder from the median of its side, as a share of delta0.
    rudder_scatter: float = 0.07
    #: Largest difference of one switching heading from the symmetric ones K0 +- psi0, as a share of psi0.
    switching_scatter: float = 0.2
    #: The same in deg: what a helmsman or a compass cannot do better. The larger of both holds.
    switching_slack_deg: float = 0.6
    #: Largest distance of the heading at the first execute from K0, as a share of psi0 (or the slack).
    approach_share: float = 0.35
    #: Largest yaw rate at the first execute, as a share of the mean absolute one at the later executes.
    steady_share: float = 0.35
    #: Largest rudder of the approach, as a share of delta0.
    approach_rudder_share: float = 0.65
    #: Slowest movement of the rudder at a switching, as a share of the quickest.
    rate_share: float = 0.25
    #: Longest gap in heading or rudder, as a share of the shorter leg beside it, that does not break the manoeuvre.
    gap_share: float = 0.5
    #: Switchings that must agree where no steady approach gives K0: K0 and psi0 are two unknowns, and four leave two
    #: checks.
    switchings_without_approach: int = 4
    #: Switchings that must agree where the ship was still turning at K0: that heading is one check more, angles as they
    #: are ordered for a trial are another.
    switchings_from_turning: int = 3


#: The thresholds by which logs are searched.
STANDARD = SegmentSettings()
