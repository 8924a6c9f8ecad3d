"""What is measured of the motion and predicted: yaw rate, heading and lateral speed, as they are named and shown."""

from __future__ import annotations

from dataclasses import dataclass

from kempf.schemas.units import as_read


@dataclass(frozen=True)
class MotionChannel:
    """One of them."""

    name: str
    #: SI.
    unit: str

    @property
    def words(self) -> str:
        """Name as a person reads it."""
        return self.name.replace("_", " ")

    @property
    def suffix(self) -> str:
        """What the name of a column in SI ends with, such as ``rad_s``."""
        return self.unit.replace("/", "_")

    @property
    def shown(self) -> tuple[str, float]:
        """Unit that a person reads it in, and the factor to it from SI.

        Examples
        --------
        >>> MOTION["lateral_speed"].shown, MOTION["yaw_rate"].shown[0]
        (('m/s', 1.0), 'deg/s')
        """
        factor, unit = as_read(self.unit)
        return unit, factor


#: By name, in the order in which they are shown.
MOTION: dict[str, MotionChannel] = {
    channel.name: channel
    for channel in (
        MotionChannel("yaw_rate", "rad/s"),
        MotionChannel("heading", "rad"),
        MotionChannel("lateral_speed", "m/s"),
    )
}
