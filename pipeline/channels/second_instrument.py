"""What a second instrument says of a channel, beside the one that serves it."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.grid import gap_limit_s
from kempf.pipeline.channels.series import Series
from kempf.schemas.channels import CHANNELS
from kempf.schemas.units import as_read

#: Within so much two instruments are alike: sentences of one receiver differ by their decimals.
_ALIKE = {"deg": 0.1, "deg/s": 0.01, "m/s": 0.02}
#: common instants from which a difference is stated
_FEWEST = 10
_MOST = 0.95


def difference(name: str, chosen: Series, other: Series) -> str | None:
    """Return by how much the second instrument reads more, and how steadily, in words; None with little in common.

    The median shows an index error, a variation that is not applied or another unit; what is about it a delay, a scale
    or a filter. Which of the two is right is not said here: the other channels show it.

    Parameters
    ----------
    name : str
        The channel.
    chosen, other : Series
        What serves the channel, and what does not.

    Examples
    --------
    >>> time = np.arange(100) * 1_000_000_000
    >>> gyro = Series(time, np.sin(time / 1e10))
    >>> difference("heading", gyro, Series(time, gyro.value + np.deg2rad(2.5)))
    '+2.5 deg in the median, 95 % within 0 deg of that'
    >>> difference("heading", gyro, gyro)
    'alike'
    """
    beside = chosen.at(other.time_utc_ns, gap_limit_s(chosen))
    more = (other.value - beside)[np.isfinite(beside)]
    if more.size < _FEWEST:
        return None
    factor, unit = as_read(CHANNELS[name].unit)
    more = factor * more
    if CHANNELS[name].wrap == "circle":
        # both are unwrapped, each from a turn of its own
        more = more - 360.0 * np.round(np.median(more) / 360.0)
    middle = float(np.median(more))
    about = float(np.quantile(np.abs(more - middle), _MOST))
    # what the rounding of floating-point numbers leaves is no difference
    middle, about = round(middle, 6) + 0.0, round(about, 6)
    if abs(middle) + about <= _ALIKE.get(unit, 0.0):
        return "alike"
    return f"{middle:+.2g} {unit} in the median, {100 * _MOST:.0f} % within {about:.2g} {unit} of that"
