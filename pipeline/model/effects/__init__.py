"""What effects do to the rudder's course before it reaches the hull: the part of the catalogue that no formula can say.

Each maps (time in s, rudder in rad, the effect's parameters) to the rudder in rad that the hull feels; the times are
evenly spaced, and the first parameter is the size, with 0 for an unchanged course.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.effects import backlash, dead_time, rate_limit, rudder_lag
from kempf.schemas.effect import RudderCourse

__all__ = ["RUDDER_COURSES"]

#: by the name that an effect gives as its ``rudder_course``
RUDDER_COURSES: Mapping[RudderCourse, Callable[[Float, Float, Float], Float]] = {
    "backlash": backlash.rudder_course,
    "dead_time": dead_time.rudder_course,
    "rate_limit": rate_limit.rudder_course,
    "rudder_lag": rudder_lag.rudder_course,
}
