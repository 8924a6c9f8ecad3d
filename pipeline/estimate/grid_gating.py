"""Gross errors on the grid: single measurements far from their prediction, left out before anything is judged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.record.record import MEASUREMENTS

#: robust standard deviations beyond which a measurement is gross, and within which its neighbours must lie
_GROSS, _SOUND = 6.0, 4.0
#: more than this share of a channel is no set of gross errors but a model that does not fit
_MOST = 0.02


def left_out(run: GridRun, instants_s: Mapping[str, Sequence[float]]) -> GridRun:
    """Return a run without the measurements that a fit left out, as `instants_left_out` told them.

    Parameters
    ----------
    run : GridRun
    instants_s : mapping of str to sequence of float
        Seconds from the beginning of the run, by measurement.
    """
    measured = run.measured.copy()
    for name, instants in instants_s.items():
        rows = np.rint(np.asarray(instants) / run.step_s).astype(np.int64)
        measured[rows[rows < measured.shape[0]], MEASUREMENTS.index(name)] = np.nan
    return replace(run, measured=measured)


def instants_left_out(before: GridRun, after: GridRun) -> dict[str, list[float]]:
    """Return the instants, s from the beginning, at which a run lost measurements, by measurement.

    Parameters
    ----------
    before, after : GridRun
        The same run with and without them.
    """
    gone = np.isfinite(before.measured) & ~np.isfinite(after.measured)
    return {name: before.time_s[gone[:, i]].tolist() for i, name in enumerate(MEASUREMENTS) if gone[:, i].any()}


def without_gross_errors(fit: PooledFit) -> tuple[list[GridRun], int]:
    """Return the runs of a fit without single gross errors, and how many measurements went.

    A misfit of the model comes in stretches; an error of a reading stands alone. Only the second kind is taken out.
    """
    runs, count = [], 0
    for filtered, line in zip(fit.runs, fit.linearised, strict=True):
        z = line.passed.innovation / np.sqrt(line.passed.variance)
        measured = filtered.run.measured.copy()
        for i in range(3):
            column = np.abs(z[:, i])
            made = np.flatnonzero(np.isfinite(column))
            if made.size < 10:
                continue
            scale = max(1.0, float(np.median(column[made])) / 0.6745)
            size = column[made] / scale
            beside = np.minimum(np.roll(size, 1), np.roll(size, -1))
            gross = (size > _GROSS) & (beside < _SOUND)
            if 0 < np.count_nonzero(gross) <= max(1, _MOST * made.size):
                measured[made[gross], i] = np.nan
                count += int(np.count_nonzero(gross))
        runs.append(replace(filtered.run, measured=measured))
    return runs, count
