"""Bounds of the noise levels, and the two ways to count those of the disturbances.

A fit takes logarithms of six levels: the intensities of what drives wind force, moment and current, per root second,
and the standard deviations of the three measurements. Of a force that forgets slowly an intensity is what a trial
shows; the level in the long run, which `kempf.schemas.model_spec.NOISE_PARAMETERS` names and a person reads, follows
from it and the rate: sigma sqrt(2 mu), see `kempf.pipeline.model.disturbances`.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.schemas.model_spec import ModelSpec

#: of the levels in the long run, order of `kempf.schemas.model_spec.NOISE_PARAMETERS`
SIGMA_LOW = (1e-6, 1e-9, 3e-3, 1e-5, 1e-7, 1e-6)
SIGMA_HIGH = (10.0, 0.1, 100.0, 10.0, 0.5, 1.0)
#: below these innovations hardly know of a level
_NEXT_TO_NOTHING = (1e-4, 1e-7, 3e-3, 1e-4, 1e-6, 1e-5)


def to_intensities(spec: ModelSpec) -> Float:
    """Return what the logarithm of an intensity is more than that of the level in the long run, shape (6,)."""
    rates = (spec.wind_correlation_rate_per_s, spec.moment_correlation_rate_per_s, spec.current_correlation_rate_per_s)
    return np.concatenate([0.5 * np.log(2.0 * np.array(rates)), np.zeros(3)])


def next_to_nothing(spec: ModelSpec) -> Float:
    """Return the logarithms of intensities and standard deviations below which they are next to nothing, shape (6,)."""
    logarithms: Float = np.log(_NEXT_TO_NOTHING) + to_intensities(spec)
    return logarithms


def level_bounds(spec: ModelSpec) -> tuple[Float, Float]:
    """Return the least and the largest logarithms of intensities and standard deviations, shape (6,) each."""
    more = to_intensities(spec)
    return np.log(SIGMA_LOW) + more, np.log(SIGMA_HIGH) + more
