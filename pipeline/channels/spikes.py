"""Single readings that leap away from their neighbours."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.robust_std import robust_std
from kempf.pipeline.channels.series import Series

_FEWEST = 12
#: half width, in readings, and limit, in robust standard deviations, of the search
_NEIGHBOURS = 5
_SPIKE = 8.0


def without_spikes(series: Series) -> tuple[Series, int]:
    """Return the series without single readings that leap away from their neighbours, and how many these were.

    References
    ----------
    Pearson (2002), "Outliers in process modeling and identification", IEEE Trans. Control Syst. Technol. 10: the
    Hampel filter.
    """
    n = len(series)
    if n < _FEWEST:
        return series, 0
    window = np.lib.stride_tricks.sliding_window_view(
        np.pad(series.value, _NEIGHBOURS, mode="reflect"), 2 * _NEIGHBOURS + 1
    )
    centre = np.median(window, axis=1)
    away = np.abs(series.value - centre)
    # the scale of the whole series: the neighbours alone may all be equal in a coarse channel
    scale = max(robust_std(away), 1e-2 * float(np.median(np.abs(series.value))))
    keep = away <= _SPIKE * scale
    return Series(series.time_utc_ns[keep], series.value[keep]), int(n - np.count_nonzero(keep))
