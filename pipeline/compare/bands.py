"""Whitened innovations by frequency: the share of each band against the share that it has in white noise.

The periodogram of white noise is the same at all frequencies, also where measurements are missing and zeros stand in
their places; its mean over K frequencies is chi-squared with 2 K degrees of freedom (Priestley 1981, "Spectral analysis
and time series", sec. 6.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compare.group import BAND
from kempf.pipeline.distributions import beta_quantile, beta_tail
from kempf.pipeline.estimate.record.record import MEASUREMENTS
from kempf.pipeline.predict.run_residuals import RunResiduals
from kempf.schemas.motion_channel import MOTION

#: edges of the bands, Hz: octaves, so that the waves a ship meets lie within 0.08 to 0.16 Hz
EDGES_HZ = tuple(0.0025 * 2.0**k for k in range(14))

_FEWEST = 20


def by_band(residuals: Sequence[RunResiduals]) -> dict[str, list[dict[str, Any]]]:
    """Return what each band of frequencies holds, by channel.

    Returns
    -------
    dict of str to list of dict
        ``low_hz``, ``high_hz``, ``share`` of the whitened innovations' power, ``expected_share``, ``ratio`` of both (1
        when white) with its 99 % ``band``, ``outside``, ``p_value`` of a ratio as large, ``peak_hz`` where the power is
        largest, and ``free_run_rms``: the free run's error within the band, in ``unit``.
    """
    by_channel = {}
    for i, name in enumerate(MEASUREMENTS):
        parts = [part for part in (_spectra(run, i) for run in residuals) if part is not None]
        if parts:
            by_channel[name] = _bands(parts, name)
    return by_channel


@dataclass(frozen=True, eq=False)
class _Spectra:
    """Of one run up to half the rate of the channel, shape (k,) each.

    ``power`` is that of the whitened innovations, 1 a frequency where they are white; ``error`` is the part of the free
    run's mean square error that each frequency holds.
    """

    frequency: Float
    power: Float
    error: Float


def _spectra(run: RunResiduals, channel: int) -> _Spectra | None:
    z, e = run.whitened[:, channel], run.free.error[:, channel]
    instants, known = np.flatnonzero(np.isfinite(z)), np.isfinite(e)
    if instants.size < _FEWEST:
        return None
    stride = max(1, round(float(np.median(np.diff(instants)))))
    frequency: Float = np.fft.rfftfreq(z.size, run.filtered.run.step_s).astype(np.float64)
    kept = (frequency > 0.0) & (frequency <= 0.5 / (run.filtered.run.step_s * stride) * (1.0 + 1e-9))
    power: Float = np.abs(np.fft.rfft(np.nan_to_num(z))) ** 2 / instants.size
    # both halves of the spectrum, and the mirror images of a channel that is measured at some instants only
    twice = 2.0 * stride / (z.size * max(int(np.count_nonzero(known)), 1))
    error: Float = twice * np.abs(np.fft.rfft(np.where(known, np.nan_to_num(e), 0.0))) ** 2
    return _Spectra(frequency[kept], power[kept], error[kept])


def _bands(parts: Sequence[_Spectra], name: str) -> list[dict[str, Any]]:
    unit, factor = MOTION[name].shown
    frequency, power, error = (
        np.concatenate([getattr(part, of) for part in parts]) for of in ("frequency", "power", "error")
    )
    whole, bands = float(np.sum(power)), []
    edges = [0.0, *EDGES_HZ]
    for low, high in pairwise(edges):
        inside = (frequency >= low) & (frequency < high)
        k, rest = int(np.count_nonzero(inside)), int(np.count_nonzero(~inside))
        if k == 0 or rest == 0:
            continue
        share, expected = float(np.sum(power[inside])) / whole, k / frequency.size
        bounds = beta_quantile(np.array([0.5 - BAND / 2.0, 0.5 + BAND / 2.0]), k, rest) / expected
        ratio = share / expected
        bands.append(
            {
                "low_hz": low,
                "high_hz": min(high, float(np.max(frequency))),
                "share": share,
                "expected_share": expected,
                "ratio": ratio,
                "band": [float(bounds[0]), float(bounds[1])],
                "outside": not bounds[0] <= ratio <= bounds[1],
                "p_value": beta_tail(share, k, rest),
                "peak_hz": float(frequency[inside][int(np.argmax(power[inside]))]),
                "free_run_rms": factor * float(np.sqrt(np.sum(error[inside]) / len(parts))),
                "unit": unit,
            }
        )
    return bands
