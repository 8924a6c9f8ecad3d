"""Correlations of whitened innovations with themselves and with what the ship was given, at lags up to a minute.

For a right model each lies within +-2.58 / sqrt(N) with probability 99 % (Ljung 1999, "System identification", sec.
16.6); all lags together are put to the test of Ljung & Box (1978, Biometrika 65).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.compare.group import BAND, TWO_SIDED
from kempf.pipeline.distributions import chi2_tail, normal_up_to
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.record.record import MEASUREMENTS
from kempf.pipeline.predict.run_residuals import RunResiduals
from kempf.schemas.symbols import CHANNEL_SYMBOLS

#: lags go up to this time, and to so many steps at most
_LONGEST_S, _MOST = 60.0, 120
#: pairs below which a lag is left out
_FEWEST_PAIRS = 20


def correlations(residuals: Sequence[RunResiduals]) -> dict[str, Any]:
    """Return auto- and cross-correlations of every channel's whitened innovations, over all runs together.

    Returns
    -------
    dict
        By channel ``auto`` and ``cross`` with ``rudder``, ``rudder_rate``, ``heading_sine``, ``heading_cosine``,
        ``speed`` and, where the wind was logged, ``wind`` (squared speed times the sine of its angle): ``lag_s``,
        ``rho``, ``band``, ``outside`` (how many lags; neighbours go together where what was given is smooth),
        ``expected_outside``, ``largest``, ``largest_lag_s`` and ``p_adjusted``, the probability of as large a one at
        any of the lags (Bonferroni); of ``auto`` also ``ljung_box``, its degrees of freedom and p-value. A positive
        lag: what was given came first.
    """
    step = residuals[0].filtered.run.step_s
    most = int(min(_LONGEST_S / step, _MOST))
    given = [given_to(run.filtered.run) for run in residuals]
    names = [name for name in given[0] if all(name in series for series in given)]
    by_channel: dict[str, Any] = {}
    for i, channel in enumerate(MEASUREMENTS):
        z = [run.whitened[:, i] for run in residuals]
        if sum(int(np.count_nonzero(np.isfinite(column))) for column in z) < _FEWEST_PAIRS:
            continue
        lags = list(range(1, most + 1))
        auto, pairs = _pooled(z, z, lags)
        cross = {}
        for name in names:
            rho, counts = _pooled(z, [series[name] for series in given], [0, *lags])
            cross[name] = _summary(rho, counts, step * np.array([0, *lags]))
        by_channel[channel] = {
            "auto": {**_summary(auto, pairs, step * np.array(lags)), **_ljung_box(auto, pairs)},
            "cross": cross,
        }
    return by_channel


def given_to(run: GridRun) -> dict[str, Float]:
    """Return what a run was given, without its mean, shape (n,) each; what does not change is left out."""
    given = {
        "rudder": run.rudder_rad,
        "rudder_rate": np.gradient(run.rudder_rad, run.step_s),
        "heading_sine": np.sin(run.heading_rad),
        "heading_cosine": np.cos(run.heading_rad),
        "speed": run.speed_m_s,
    }
    if {"wind_speed", "wind_angle"} <= run.channels:
        rows = (run.inputs.shape[0] - 1) // (run.measured.shape[0] - 1)
        symbols = list(CHANNEL_SYMBOLS)
        speed, angle = (run.inputs[::rows, 2 + symbols.index(s)] for s in ("U", "gamma"))
        given["wind"] = speed**2 * np.sin(angle)
    return {name: value - np.mean(value) for name, value in given.items() if np.ptp(value) > 0.0}


def _pooled(z: Sequence[Float], other: Sequence[Float], lags: Sequence[int]) -> tuple[Float, Float]:
    """Return the correlation of z now with the other so many steps before, and the number of pairs, over all runs."""
    rho, pairs = np.full(len(lags), np.nan), np.zeros(len(lags))
    for k, lag in enumerate(lags):
        product, power_now, power_before, count = 0.0, 0.0, 0.0, 0
        for a, b in zip(z, other, strict=True):
            # a run may be shorter than the longest lag
            now, before = a[lag:], b[: max(b.size - lag, 0)]
            good = np.isfinite(now) & np.isfinite(before)
            product += float(now[good] @ before[good])
            power_now += float(now[good] @ now[good])
            power_before += float(before[good] @ before[good])
            count += int(np.count_nonzero(good))
        if count >= _FEWEST_PAIRS and power_now > 0.0 and power_before > 0.0:
            rho[k], pairs[k] = product / np.sqrt(power_now * power_before), count
    return rho, pairs


def _summary(rho: Float, pairs: Float, lag_s: Float) -> dict[str, Any]:
    good = np.isfinite(rho)
    if not good.any():
        nothing = {"band": None, "outside": 0, "expected_outside": 0.0, "largest": None, "largest_lag_s": None}
        return {"lag_s": [], "rho": [], **nothing, "p_adjusted": None}
    rho, pairs, lag_s = rho[good], pairs[good], lag_s[good]
    at = int(np.argmax(np.abs(rho)))
    return {
        "lag_s": lag_s.tolist(),
        "rho": rho.tolist(),
        "band": TWO_SIDED / float(np.sqrt(np.median(pairs))),
        "outside": int(np.count_nonzero(np.abs(rho) * np.sqrt(pairs) > TWO_SIDED)),
        "expected_outside": (1.0 - BAND) * rho.size,
        "largest": float(rho[at]),
        "largest_lag_s": float(lag_s[at]),
        "p_adjusted": min(1.0, 2.0 * rho.size * float(normal_up_to(-np.max(np.abs(rho) * np.sqrt(pairs))))),
    }


def _ljung_box(rho: Float, pairs: Float) -> dict[str, Any]:
    good = np.isfinite(rho)
    freedom = int(np.count_nonzero(good))
    statistic = float(np.sum(rho[good] ** 2 * (pairs[good] + 2.0)))
    p_value = chi2_tail(statistic, freedom) if freedom else None
    return {"ljung_box": statistic, "degrees_of_freedom": freedom, "p_value": p_value}
