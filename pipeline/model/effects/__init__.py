"""What effects do to the rudder's course before it reaches the hull: the part of the catalogue that no formula can say.

A file has one effect, and maps times in s (increasing, at least two), the rudder in rad (linear between them) and
the size of the effect to the rudder in rad that the hull feels, shape (n,) as both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.effects import backlash, dead_time, rate_limit, rudder_lag
from kempf.schemas.effect import RudderCourse

__all__ = ["RUDDER_COURSES"]


def _where_present(course: Callable[[Float, Float, float], Float]) -> Callable[[Float, Float, Float], Float]:
    """Return what an effect does, given its parameters; of the size 0 it is absent, and one instant has no course."""

    def felt(time_s: Float, rudder_rad: Float, values: Float) -> Float:
        size = float(values[0])
        return course(time_s, rudder_rad, size) if size > 0.0 and time_s.size > 1 else rudder_rad

    return felt


#: by the name that an effect gives as its ``rudder_course``
RUDDER_COURSES: Mapping[RudderCourse, Callable[[Float, Float, Float], Float]] = {
    "backlash": _where_present(backlash.rudder_course),
    "dead_time": _where_present(dead_time.rudder_course),
    "rate_limit": _where_present(rate_limit.rudder_course),
    "rudder_lag": _where_present(rudder_lag.rudder_course),
}
