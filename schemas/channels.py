"""The canonical channels: the one glossary of what a ship measures, in SI units and radians.

Every other room uses these names; a column is a channel's name and its unit, ``yaw_rate_rad_s``.
Signs: heading clockwise from north, yaw rate and rudder positive when they turn the bow to starboard, roll positive
starboard down, wind angle where the wind blows from, clockwise from the bow.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Literal

#: How the values of a channel wrap: round the whole circle, not at all.
Wrap = Literal["circle", "none"]
#: The source of every reading of delimited text; those of other logs are the names of sentences and topics.
ROW = "row"


@dataclass(frozen=True)
class Channel:
    """One canonical quantity.

    Parameters
    ----------
    name : str
        Name without unit.
    unit : str
        SI unit, as written in the Parquet field metadata.
    low, high : float
        Physical range in that unit; a value outside is rejected as ``out_of_range``.
    wrap : {"circle", "none"}
        Whether the value is an angle on the full circle (unwrapped before it is averaged or interpolated).
    words : str
        Plain description.
    """

    name: str
    unit: str
    low: float
    high: float
    wrap: Wrap
    words: str

    @property
    def column(self) -> str:
        """Column name: the channel and its unit.

        Examples
        --------
        >>> CHANNELS["yaw_rate"].column
        'yaw_rate_rad_s'
        """
        suffix = {"m/s": "m_s", "rad/s": "rad_s", "1/s": "per_s"}.get(self.unit, self.unit)
        return f"{self.name}_{suffix}"


_ALL = (
    Channel("latitude", "rad", -pi / 2, pi / 2, "none", "GNSS latitude, north positive"),
    Channel("longitude", "rad", -pi, pi, "none", "GNSS longitude, east positive"),
    Channel("speed_over_ground", "m/s", 0.0, 60.0, "none", "GNSS speed over ground"),
    Channel("course_over_ground", "rad", -2 * pi, 2 * pi, "circle", "GNSS course over ground, clockwise from north"),
    Channel("velocity_north", "m/s", -60.0, 60.0, "none", "velocity over ground towards north"),
    Channel("velocity_east", "m/s", -60.0, 60.0, "none", "velocity over ground towards east"),
    Channel("heading", "rad", -2 * pi, 2 * pi, "circle", "direction of the bow, clockwise from true north"),
    Channel("yaw_rate", "rad/s", -2.0, 2.0, "none", "rate of turn, positive to starboard"),
    Channel("rudder_angle", "rad", -pi / 2, pi / 2, "none", "rudder feedback, positive turns the ship to starboard"),
    Channel("rudder_order", "rad", -pi / 2, pi / 2, "none", "ordered rudder, positive turns the ship to starboard"),
    Channel("speed_through_water", "m/s", -10.0, 60.0, "none", "log speed through the water, ahead positive"),
    Channel("wind_speed", "m/s", 0.0, 100.0, "none", "relative wind speed"),
    Channel("wind_angle", "rad", -2 * pi, 2 * pi, "circle", "where the relative wind blows from, clockwise from bow"),
    Channel("shaft_speed", "1/s", -60.0, 60.0, "none", "propeller revolutions, ahead positive"),
    Channel("water_depth", "m", 0.0, 12000.0, "none", "water depth below the transducer or keel"),
    Channel("roll", "rad", -pi / 2, pi / 2, "none", "roll angle, starboard down positive"),
    Channel("pitch", "rad", -pi / 2, pi / 2, "none", "pitch angle, bow up positive"),
    Channel("lateral_speed_through_water", "m/s", -20.0, 20.0, "none", "log speed sideways, starboard positive"),
    Channel("distance_through_water", "m", 0.0, 1e10, "none", "distance through the water that the log has counted"),
    Channel("true_wind_speed", "m/s", 0.0, 100.0, "none", "wind speed over ground"),
    Channel("true_wind_direction", "rad", -2 * pi, 2 * pi, "circle", "where the wind blows from, clockwise from north"),
    Channel("velocity_forward", "m/s", -60.0, 60.0, "none", "velocity over ground along the bow, ahead positive"),
    Channel("velocity_starboard", "m/s", -60.0, 60.0, "none", "velocity over ground across the bow, to starboard"),
)

#: Every canonical channel by name, in the order of the tables.
CHANNELS: dict[str, Channel] = {channel.name: channel for channel in _ALL}

#: Columns of the channels, in the order of the tables.
CHANNEL_COLUMNS: tuple[str, ...] = tuple(channel.column for channel in _ALL)
