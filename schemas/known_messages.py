"""What standard messages mean: the fields that are canonical channels by their definition, and when they are void.

Only what the definition itself fixes, unit, sign and frame, is mapped without a profile. What depends on how a sensor
is mounted or on the frame that a message names is offered as a line for the profile, never taken.

References
----------
ROS REP-103 (units and axes: x forward, y to port, z up; east-north-up), REP-105 (frames), REP-145 (IMU);
sensor_msgs/NavSatFix and sensor_msgs/Imu (comments of their definitions); Foxglove schemas, LocationFix.
"""

from __future__ import annotations

from math import pi

from kempf.schemas.profile import ChannelMap

_FIX = {
    "latitude": ChannelMap(channel="latitude", unit="deg"),
    "longitude": ChannelMap(channel="longitude", unit="deg"),
}

#: Message -> field -> channel, where nothing is left to know. A name is without ``msg/`` and without a leading package
#: path: ``sensor_msgs/NavSatFix``, ``foxglove.LocationFix``. Those of ``kempf_msgs`` are in ``schemas/messages``.
TAKEN: dict[str, dict[str, ChannelMap]] = {
    "sensor_msgs/NavSatFix": _FIX,
    "foxglove.LocationFix": _FIX,
    "foxglove_msgs/LocationFix": _FIX,
    "kempf_msgs/GnssFix": {
        "lat": ChannelMap(channel="latitude", unit="deg"),
        "lon": ChannelMap(channel="longitude", unit="deg"),
    },
    "kempf_msgs/GnssVelocity": {
        "sog": ChannelMap(channel="speed_over_ground", unit="m/s"),
        "cog": ChannelMap(channel="course_over_ground", unit="deg"),
    },
    "kempf_msgs/Heading": {"heading": ChannelMap(channel="heading", unit="deg")},
    "kempf_msgs/RateOfTurn": {"rot": ChannelMap(channel="yaw_rate", unit="deg/min")},
    "kempf_msgs/Rudder": {"rudder": ChannelMap(channel="rudder_angle", unit="deg")},
    "kempf_msgs/WaterSpeed": {"stw": ChannelMap(channel="speed_through_water", unit="m/s")},
    "kempf_msgs/Wind": {
        "wind_angle": ChannelMap(channel="wind_angle", unit="deg"),
        "wind_speed": ChannelMap(channel="wind_speed", unit="m/s"),
    },
    "kempf_msgs/Rpm": {"rpm": ChannelMap(channel="shaft_speed", unit="rpm")},
    "kempf_msgs/Depth": {"depth": ChannelMap(channel="water_depth", unit="m")},
    "kempf_msgs/Roll": {"roll": ChannelMap(channel="roll", unit="deg")},
}

#: yaw of a body with z up, counted from east towards north, as a heading
_YAW_ENU = ChannelMap(channel="heading", unit="rad", positive="port", offset=pi / 2)
_RATE_UP = ChannelMap(channel="yaw_rate", unit="rad/s", positive="port")
_ROLL = ChannelMap(channel="roll", unit="rad")
_PITCH_UP = ChannelMap(channel="pitch", unit="rad", positive="port")
_EAST = ChannelMap(channel="velocity_east", unit="m/s")
_NORTH = ChannelMap(channel="velocity_north", unit="m/s")

#: Message -> field -> what it is if the sensor is mounted and the frame chosen as REP-103 and REP-105 have it.
OFFERED: dict[str, dict[str, ChannelMap]] = {
    "sensor_msgs/Imu": {
        "angular_velocity.z": _RATE_UP,
        "orientation.yaw": _YAW_ENU,
        "orientation.roll": _ROLL,
        "orientation.pitch": _PITCH_UP,
    },
    "geometry_msgs/TwistStamped": {"twist.linear.x": _EAST, "twist.linear.y": _NORTH},
    "geometry_msgs/TwistWithCovarianceStamped": {"twist.twist.linear.x": _EAST, "twist.twist.linear.y": _NORTH},
    "geometry_msgs/Vector3Stamped": {"vector.x": _EAST, "vector.y": _NORTH},
    "geometry_msgs/QuaternionStamped": {"quaternion.yaw": _YAW_ENU},
    "geometry_msgs/PoseStamped": {"pose.orientation.yaw": _YAW_ENU},
    "geometry_msgs/PoseWithCovarianceStamped": {"pose.pose.orientation.yaw": _YAW_ENU},
    "nav_msgs/Odometry": {
        "pose.pose.orientation.yaw": _YAW_ENU,
        "twist.twist.angular.z": _RATE_UP,
        # the twist is in the axes of the child frame, the ship
        "twist.twist.linear.x": ChannelMap(channel="velocity_forward", unit="m/s"),
        "twist.twist.linear.y": ChannelMap(channel="velocity_starboard", unit="m/s", positive="port"),
    },
}

#: Message -> (fields that begin so, field that is negative where they are void).
VOID_WHERE_NEGATIVE: dict[str, tuple[tuple[str, str], ...]] = {
    "sensor_msgs/NavSatFix": (("", "status.status"),),
    "sensor_msgs/Imu": (
        ("orientation.", "orientation_covariance.0"),
        ("angular_velocity.", "angular_velocity_covariance.0"),
    ),
}


def in_ned(mapped: ChannelMap) -> ChannelMap:
    """Return what an offered field is where the axes point north, east and down, or to bow, starboard and down.

    Examples
    --------
    >>> in_ned(OFFERED["sensor_msgs/Imu"]["angular_velocity.z"]).positive
    'starboard'
    >>> in_ned(OFFERED["geometry_msgs/TwistStamped"]["twist.linear.x"]).channel
    'velocity_north'
    """
    other = {"velocity_east": "velocity_north", "velocity_north": "velocity_east"}.get(mapped.channel, mapped.channel)
    return ChannelMap(channel=other, unit=mapped.unit)


def plain_name(schema: str) -> str:
    """Return the name of a message as it stands in the tables above.

    Examples
    --------
    >>> plain_name("sensor_msgs/msg/Imu"), plain_name("foxglove.LocationFix")
    ('sensor_msgs/Imu', 'foxglove.LocationFix')
    """
    return schema.replace("/msg/", "/")
