"""What the delimited and the MCAP logger call the channels, in which unit and to how many decimals they write them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.schemas.channels import CHANNELS
from kempf.schemas.units import factor_to_si

Float = NDArray[np.float64]


@dataclass(frozen=True)
class LoggerField:
    """One field of the logger.

    Parameters
    ----------
    name : str
        Column, or key in the JSON message.
    channel : str
        Canonical channel.
    unit : str
        As written.
    decimals : int
        Written.
    topic, schema : str
        MCAP topic and the name of its schema.
    instrument : str
        Which measures it.
    """

    name: str
    channel: str
    unit: str
    decimals: int
    topic: str
    schema: str
    instrument: str

    @property
    def column(self) -> str:
        """Canonical column."""
        return CHANNELS[self.channel].column

    def written(self, value_si: Float) -> Float:
        """Return SI values in the unit of the field, rounded as they are written; never a negative zero."""
        scaled = value_si / factor_to_si(self.unit, CHANNELS[self.channel].unit, self.name)
        rounded: Float = np.round(scaled, self.decimals) + 0.0
        if CHANNELS[self.channel].wrap == "circle":
            rounded = np.where(rounded >= 360.0, 0.0, rounded)
        return rounded


#: In the order of the columns and of the MCAP channels.
LOGGER_FIELDS: tuple[LoggerField, ...] = (
    LoggerField("sog", "speed_over_ground", "m/s", 5, "/gnss/velocity", "GnssVelocity", "gnss"),
    LoggerField("cog", "course_over_ground", "deg", 5, "/gnss/velocity", "GnssVelocity", "gnss"),
    LoggerField("lat", "latitude", "deg", 8, "/gnss/fix", "GnssFix", "gnss"),
    LoggerField("lon", "longitude", "deg", 8, "/gnss/fix", "GnssFix", "gnss"),
    LoggerField("heading", "heading", "deg", 5, "/gyro/heading", "Heading", "heading"),
    LoggerField("rot", "yaw_rate", "deg/min", 5, "/gyro/rate_of_turn", "RateOfTurn", "yaw_rate"),
    LoggerField("rudder", "rudder_angle", "deg", 5, "/steering/rudder", "Rudder", "rudder"),
    LoggerField("rudder_order", "rudder_order", "deg", 5, "/steering/order", "RudderOrder", "rudder_order"),
    LoggerField("stw", "speed_through_water", "m/s", 5, "/log/speed", "WaterSpeed", "log"),
    LoggerField("wind_angle", "wind_angle", "deg", 5, "/wind/relative", "Wind", "wind"),
    LoggerField("wind_speed", "wind_speed", "m/s", 5, "/wind/relative", "Wind", "wind"),
    LoggerField("rpm", "shaft_speed", "rpm", 5, "/shaft/rpm", "Rpm", "shaft"),
    LoggerField("depth", "water_depth", "m", 5, "/echo/depth", "Depth", "depth"),
    LoggerField("roll", "roll", "deg", 5, "/mru/roll", "Roll", "roll"),
)
