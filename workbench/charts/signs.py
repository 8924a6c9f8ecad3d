"""Which way the values of a channel are positive, as the figures say it; `kempf.schemas.channels` defines it."""

from __future__ import annotations

from collections.abc import Mapping

STARBOARD = "starboard +"
#: By channel; one that cannot be negative, or is a direction of the compass, has none.
SIGNS: Mapping[str, str] = {
    **dict.fromkeys(("rudder_angle", "rudder_order", "yaw_rate"), STARBOARD),
    **dict.fromkeys(("lateral_speed", "lateral_speed_through_water", "velocity_starboard"), STARBOARD),
    "velocity_north": "north +",
    "velocity_east": "east +",
    "velocity_forward": "ahead +",
    "roll": "starboard down +",
    "pitch": "bow up +",
}
