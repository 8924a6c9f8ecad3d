"""What manoeuvre is to be predicted, and whether it can be sailed."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import isfinite, radians
from typing import TYPE_CHECKING, Literal

from kempf.schemas.errors import UsageError
from kempf.schemas.side import Side

if TYPE_CHECKING:
    from kempf.pipeline.manoeuvre.rudder_rate import RudderRate
    from kempf.pipeline.manoeuvre.sailed import Manoeuvre

Kind = Literal["turning-circle", "zigzag", "pull-out", "spiral"]
#: rudder of a manoeuvre where none is asked for, deg
USUAL_RUDDER_DEG: dict[Kind, float] = {"turning-circle": 35.0, "pull-out": 20.0, "spiral": 20.0}


@dataclass(frozen=True)
class PredictRequest:
    """What is asked for."""

    kind: Kind
    #: Parameter set by id or alias; None takes the vessel's current one.
    set_id: str | None = None
    #: Magnitude; None takes the usual one of the manoeuvre.
    rudder_deg: float | None = None
    #: Heading and rudder of a zigzag.
    angles_deg: tuple[float, float] = (20.0, 20.0)
    #: Of the turn, or of the first execute.
    side: Side = "starboard"
    #: Of the approach; None takes the mean of those that were sailed.
    speed_m_s: float | None = None
    #: Of another steering gear; None takes the rudder's rate that the logs show.
    rudder_rate_deg_s: float | None = None

    @property
    def rudder_rate(self) -> RudderRate | None:
        """Of another steering gear, as that of the logs is given; None where there is none."""
        from kempf.pipeline.manoeuvre.rudder_rate import RudderRate

        rate = self.rudder_rate_deg_s
        return None if rate is None else RudderRate(radians(rate), 0.0, 0, "")


def manoeuvre_of(request: PredictRequest) -> Manoeuvre:
    """Return the manoeuvre that is asked for; errors are those of `required`."""
    # the kernels that sail them take a while to load, and whoever only asks does not need them
    from kempf.pipeline.manoeuvre.pull_out import PredictedPullOut
    from kempf.pipeline.manoeuvre.spiral import PredictedSpiral
    from kempf.pipeline.manoeuvre.turning_circle import PredictedCircle
    from kempf.pipeline.manoeuvre.zigzag import PredictedZigzag

    required(request)
    side = 1 if request.side == "starboard" else -1
    if request.kind == "zigzag":
        heading, rudder = request.angles_deg
        return PredictedZigzag(radians(heading), radians(rudder), side)
    angle = _rudder_deg(request)
    if request.kind == "turning-circle":
        return PredictedCircle(radians(angle), side)
    return PredictedPullOut(radians(angle), side) if request.kind == "pull-out" else PredictedSpiral(radians(angle))


def angles_of(text: str, option: str = "") -> tuple[float, float]:
    """Return heading and rudder of a zigzag, deg.

    Parameters
    ----------
    option : str, optional
        Option that gave them, for the message.

    Raises
    ------
    UsageError
        ``angles_unreadable``.

    Examples
    --------
    >>> angles_of("20/10")
    (20.0, 10.0)
    """
    match = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*/\s*(\d+(?:\.\d+)?)\s*", text)
    if match is None:
        raise UsageError(
            "angles_unreadable",
            f"{option} {text[:60]!r} is no pair of angles.".lstrip(),
            "Give heading and rudder, such as 20/20.",
        )
    return float(match[1]), float(match[2])


def _rudder_deg(request: PredictRequest) -> float:
    return USUAL_RUDDER_DEG[request.kind] if request.rudder_deg is None else request.rudder_deg


def required(request: PredictRequest) -> None:
    """Require a request that can be sailed.

    Raises
    ------
    UsageError
        ``speed_out_of_range``, ``rudder_rate_out_of_range``, ``rudder_out_of_range``, ``angles_out_of_range``.
    """
    if request.kind == "zigzag":
        heading, rudder = request.angles_deg
        if not (0.0 < heading <= 90.0 and 0.0 < rudder <= 60.0):
            raise UsageError(
                "angles_out_of_range",
                f"The zigzag is {heading:g}/{rudder:g}, expected a heading above 0 up to 90 deg and a rudder up to 60.",
                "Give heading and rudder in degrees, such as --angles 10/10.",
            )
    elif not 0.0 < (angle := _rudder_deg(request)) <= 60.0:
        raise UsageError(
            "rudder_out_of_range",
            f"The rudder is {angle:g} deg, expected more than 0 and up to 60.",
            "Give its magnitude in degrees with --rudder; --side says to which side.",
        )
    if request.speed_m_s is not None and not (isfinite(request.speed_m_s) and request.speed_m_s > 0.0):
        raise UsageError(
            "speed_out_of_range",
            f"The approach speed is {request.speed_m_s:g} m/s, expected more than 0.",
            "Give the speed through the water in m/s with --speed, or leave it out.",
        )
    if request.rudder_rate_deg_s is not None and not 0.0 < request.rudder_rate_deg_s < float("inf"):
        raise UsageError(
            "rudder_rate_out_of_range",
            f"The rudder's rate is {request.rudder_rate_deg_s:g} deg/s, expected more than 0.",
            "Give the rate at which the gear puts the rudder over with --rudder-rate, or leave it out.",
        )
