"""Where the fits of diagnosis begin: a plain ship from the runs one by one, and noise levels."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate import maximum_likelihood, pooled_fit
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun, spread
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.search.starts import thinned
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.ship import mariner_like
from kempf.schemas.errors import DataRejected, KempfError
from kempf.schemas.model_spec import ModelSpec

#: intensities to start from, SI: of what drives the wind force, the moment and the current
INTENSITIES = (1e-4, 1e-6, 1e-3)
_SHORT_CLIMB, _ENTRIES = 5, 4
#: instants that a record is thinned to
_INSTANTS = 400


@dataclass(frozen=True, eq=False)
class Start:
    """Hull, shape (6,), and logarithms of the noise levels, shape (runs, 6)."""

    hull: Float
    levels: Float

    def of(self, numbers: Sequence[int]) -> Start:
        """Return the start of some of the runs."""
        return Start(self.hull, self.levels[list(numbers)])


def start_of(
    records: Sequence[Record], runs: Sequence[GridRun], spec: ModelSpec, chosen: Sequence[int], workers: Executor
) -> Start:
    """Race the ships that single runs give over several; the most likely one after a few steps wins.

    Parameters
    ----------
    records : sequence of Record
        One a run.
    runs : sequence of GridRun
    spec : ModelSpec
    chosen : sequence of int
        The runs that race; the others get noise levels of their own and no part in the hull.
    workers : Executor

    Raises
    ------
    DataRejected
        ``no_ship_explains_it``.
    """
    levels = np.array([_levels(record, run) for record, run in zip(records, runs, strict=True)])
    arm = runs[0].ship.arm_per_m
    few = list(chosen)[: _ENTRIES - 1]
    found = list(workers.map(lambda i: _alone(records[i], spec, arm), few))
    alone = [one for one in found if one is not None]
    hulls = [np.median(alone, axis=0), *alone] if alone else []
    hulls = [*hulls[: _ENTRIES - 1], mariner_like(runs[0].ship.length_m).array()]
    raced: list[PooledFit] = []
    for hull in hulls:
        one = pooled_fit.fit(
            *(EffectModel(), [runs[i] for i in few], spec, hull, levels[few], np.zeros(0), workers),
            max_iterations=_SHORT_CLIMB,
        )
        if np.isfinite(one.log_likelihood):
            raced.append(one)
    if not raced:
        raise DataRejected(
            "no_ship_explains_it",
            f"No plain ship gives the {len(chosen)} zigzags a finite likelihood.",
            "Look at the channels (heading, yaw rate, speed, rudder) of these segments.",
        )
    best = max(raced, key=lambda one: one.log_likelihood)
    levels[few] = best.levels
    return Start(best.hull, levels)


def _alone(record: Record, spec: ModelSpec, arm_per_m: float) -> Float | None:
    """Identify one segment by itself; None where that fails."""
    try:
        # a rough hull is enough: it only begins the race
        found = maximum_likelihood.identify(thinned(record, _INSTANTS), spec, arm_per_m, MaximumLikelihoodSettings())
    except KempfError:
        return None
    return found.hull.array() if np.all(np.isfinite(found.hull.array())) else None


def _levels(record: Record, run: GridRun) -> Float:
    """Noise levels to start from: those of the readings, smaller where several were averaged, and a little more."""
    noise = np.nan_to_num(record.noise_start, nan=1e-3)
    readings = np.isfinite(record.measured).sum(axis=0) / np.maximum(np.isfinite(run.measured).sum(axis=0), 1)
    level = np.maximum(noise / np.sqrt(np.maximum(readings, 1.0)), 0.02 * spread(run.measured))
    found: Float = np.log(np.concatenate([INTENSITIES, np.maximum(level, 1e-5)]))
    return found
