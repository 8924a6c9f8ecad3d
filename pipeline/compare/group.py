"""What is said of a group of instants: whitened innovations beside those of a right model, and the free run's error.

Whitened innovations of a right model are independent with variance 1 (Mehra & Peschon 1971, "An innovations approach
to fault detection and diagnosis in dynamic systems", Automatica 7): the mean square of n is chi-squared over n.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.distributions import chi2_quantile, normal_quantile
from kempf.pipeline.estimate.record.record import MEASUREMENTS
from kempf.pipeline.predict.run_residuals import Samples
from kempf.schemas.motion_channel import MOTION

#: probability of the bands
BAND = 0.99
#: half the width of such a band about a normal number, in standard deviations
TWO_SIDED = float(normal_quantile(0.5 + BAND / 2.0))


def rms_band(n: int) -> tuple[float, float]:
    """Return between which bounds the rms of n whitened innovations of a right model lies, with probability `BAND`.

    Examples
    --------
    >>> low, high = rms_band(500)
    >>> round(low, 2), round(high, 2)
    (0.92, 1.08)
    """
    low, high = chi2_quantile(np.array([0.5 - BAND / 2.0, 0.5 + BAND / 2.0]), n) / n
    return float(np.sqrt(low)), float(np.sqrt(high))


def group(samples: Samples, inside: NDArray[np.bool_]) -> dict[str, Any]:
    """Describe some instants, all channels together and each.

    Parameters
    ----------
    inside : ndarray of bool, shape (N,)

    Returns
    -------
    dict
        ``n``, ``whitened_rms``, ``band``, ``outside`` of all channels, and under ``channels`` the same of each with
        ``whitened_mean``, ``mean_band`` and ``free_run_rms`` in ``unit``. Numbers of an empty group are None.
    """
    whitened, free = samples.whitened[inside], samples.free_error[inside]
    channels = {}
    for i, name in enumerate(MEASUREMENTS):
        if not np.isfinite(samples.whitened[:, i]).any() and not np.isfinite(samples.free_error[:, i]).any():
            continue
        unit, factor = MOTION[name].shown
        error = free[np.isfinite(free[:, i]), i]
        z = whitened[np.isfinite(whitened[:, i]), i]
        channels[name] = {
            **_spread(z),
            "whitened_mean": float(np.mean(z)) if z.size else None,
            "mean_band": TWO_SIDED / float(np.sqrt(z.size)) if z.size else None,
            "free_run_rms": factor * float(np.sqrt(np.mean(error**2))) if error.size else None,
            "unit": unit,
        }
    return {**_spread(whitened[np.isfinite(whitened)]), "channels": channels}


def _spread(z: Float) -> dict[str, Any]:
    if not z.size:
        return {"n": 0, "whitened_rms": None, "band": None, "outside": False}
    rms, band = float(np.sqrt(np.mean(z**2))), rms_band(z.size)
    return {"n": int(z.size), "whitened_rms": rms, "band": list(band), "outside": not band[0] <= rms <= band[1]}
