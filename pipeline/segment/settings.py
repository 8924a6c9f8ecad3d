"""What counts as a zigzag: every threshold of the search, none of them a fixed duration.

Times are stated as shares of a leg or a ramp of the manoeuvre itself, so a tank model, a tanker and a small unmanned
boat are judged alike.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SegmentSettings:
    """Thresholds of the search for zigzags.

    Attributes
    ----------
    smallest_rudder_deg, largest_rudder_deg : float
        Range of the rudder delta0, deg.
    smallest_heading_deg, largest_heading_deg : float
        Range of the switching heading psi0, deg. A Williamson turn shifts the rudder at 60 deg: no zigzag.
    search_band : float
        Half width of the band in which the rudder counts as held while delta0 is still unknown, as a share of it.
    held_band : float
        The same once delta0 and its neutral offset are known.
    held_slack_deg : float
        Smallest half width of that band, deg.
    rudder_scatter : float
        Largest difference of one leg's rudder from the median of its side, as a share of delta0.
    switching_scatter : float
        Largest difference of one switching heading from the symmetric ones K0 +- psi0, as a share of psi0.
    switching_slack_deg : float
        The same in deg: what a helmsman or a compass cannot do better. The larger of both holds.
    approach_share : float
        Largest distance of the heading at the first execute from K0, as a share of psi0 (or the slack).
    steady_share : float
        Largest yaw rate at the first execute, as a share of the mean absolute one at the later executes.
    approach_rudder_share : float
        Largest rudder of the approach, as a share of delta0.
    rate_share : float
        Slowest movement of the rudder at a switching, as a share of the quickest.
    gap_share : float
        Longest gap in heading or rudder, as a share of the shorter leg beside it, that does not break the manoeuvre.
    switchings_without_approach : int
        Switchings that must agree where no steady approach gives K0: K0 and psi0 are two unknowns, and four leave
        two checks.
    """

    smallest_rudder_deg: float = 2.0
    largest_rudder_deg: float = 45.0
    smallest_heading_deg: float = 0.5
    largest_heading_deg: float = 45.0
    search_band: float = 0.25
    held_band: float = 0.1
    held_slack_deg: float = 0.25
    rudder_scatter: float = 0.07
    switching_scatter: float = 0.2
    switching_slack_deg: float = 0.6
    approach_share: float = 0.35
    steady_share: float = 0.35
    approach_rudder_share: float = 0.65
    rate_share: float = 0.25
    gap_share: float = 0.5
    switchings_without_approach: int = 4
