"""What a fit has found of instants of measurement that were not quite known (decision 0111)."""

from __future__ import annotations

from dataclasses import dataclass

from kempf.schemas.units import SECOND_NS

#: channels that a velocity over ground comes from, and those of the others in the order of the fields
VELOCITY = (
    *("speed_over_ground", "course_over_ground", "velocity_north", "velocity_east"),
    *("velocity_forward", "velocity_starboard"),
)
OTHERS = ("heading", "yaw_rate", "rudder_angle")
#: what the receiver gives beside the velocity, by which one sees that this is late
_FIXES = ("latitude", "longitude")


@dataclass(frozen=True)
class FoundInstants:
    """By how much the instruments of a log measured before the instants that were taken, s."""

    velocity_s: float = 0.0
    heading_s: float = 0.0
    yaw_rate_s: float = 0.0
    #: Of the rudder: by how much behind them, as a dead time is.
    rudder_s: float = 0.0

    def by_channel(self) -> dict[str, int]:
        """Return by how much every channel is to be set back, ns: whole ones, so that it can be taken back."""
        velocity, *others = (
            round(by_s * SECOND_NS) for by_s in (self.velocity_s, self.heading_s, self.yaw_rate_s, -self.rudder_s)
        )
        return {**dict.fromkeys((*VELOCITY, *_FIXES), velocity), **dict(zip(OTHERS, others, strict=True))}


#: of a log whose instants are taken as they are
AS_TAKEN = FoundInstants()
