"""Measurements that a fit left out as gross errors, by their instants: so that a comparison leaves the same out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from kempf.pipeline.estimate.record.average import cells
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.record.record import MEASUREMENTS


def left_out(run: GridRun, instants_s: Mapping[str, Sequence[float]]) -> GridRun:
    """Return a run without the measurements that a fit left out, as `instants_left_out` gave them.

    Parameters
    ----------
    instants_s : mapping of str to sequence of float
        Seconds from the beginning of the run, by measurement.
    """
    measured = run.measured.copy()
    for name, instants in instants_s.items():
        rows = cells(np.asarray(instants, dtype=np.float64), run.step_s)
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
