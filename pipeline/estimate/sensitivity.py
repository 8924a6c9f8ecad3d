"""How the whitened innovations of a run move with every parameter: differences of whole passes of the filter.

For Gaussian innovations e with variance S the log-likelihood is -(log S + e^2 / S) / 2 a measurement. With
u = (e / sqrt S, (e^2 / S - 1) / sqrt 2) and J = (-de / sqrt S, d log S / sqrt 2) the score is J' u and the expected
information J' J (Harvey 1989, "Forecasting, structural time series models and the Kalman filter", sec. 3.4).
Whatever an effect is (a term, a lag of the rudder, an error of a sensor), its J is the difference of two passes: built
from predicted states, with all that the filter absorbs of it, by no formula that could be wrong for it alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filtered import Passed, RunFilter
from kempf.pipeline.estimate.level_bounds import next_to_nothing
from kempf.schemas.instrument_noise import lasting
from kempf.schemas.model_spec import N_HULL

_ROOT_2 = float(np.sqrt(2.0))
N_LEVELS = 6
#: steps of the differences: of hull parameters and effects in parts of a typical value, of a noise level's logarithm
_HULL_STEP, _EFFECT_STEP, _LEVEL_STEP = 1e-4, 1e-2, 1e-3
#: part of a variance that a level's step adds to it
_ADDED = float(np.expm1(2.0 * _LEVEL_STEP))
#: logarithm by which a level may lie below what is next to nothing: none that is bounded lies lower
_DEEPEST = 100.0
#: of that of an effect, the least step of lasting noise
_LEAST_STEP = 1e-2


@dataclass(frozen=True, eq=False)
class Point:
    """Where a model stands: parameters of one run."""

    #: Shape (6,).
    hull: Float
    #: Shape (p,). Of the effects.
    values: Float
    #: Shape (6,). Logarithms of the noise levels.
    levels: Float

    def vector(self) -> Float:
        """Return all of it, shape (12 + p,)."""
        return np.concatenate([self.hull, self.values, self.levels])

    def moved(self, index: int, by: float) -> Point:
        """Return the point with one number of `vector` changed."""
        vector = self.vector()
        vector[index] += by
        p = self.values.size
        return Point(vector[:N_HULL], vector[N_HULL : N_HULL + p], vector[N_HULL + p :])


def passed(filtered: RunFilter, point: Point) -> Passed:
    """Run the filter at a point."""
    return filtered.run_filter(point.hull, np.exp(point.levels), point.values)


def passes(filtered: RunFilter, points: Sequence[Point]) -> list[Passed]:
    """Run the filter at several points at once."""
    hulls, levels = (np.stack(part, axis=-1) for part in ([p.hull for p in points], [p.levels for p in points]))
    return filtered.run_filters(hulls, np.exp(levels), np.stack([p.values for p in points], axis=-1))


def whitened(base: Passed) -> Float:
    """Return u, shape (2 m,): over the measurements made, whitened innovations, then what shows their spread."""
    made = np.isfinite(base.innovation)
    z = base.innovation[made] / np.sqrt(base.variance[made])
    return np.concatenate([z, (z * z - 1.0) / _ROOT_2])


def difference(base: Passed, other: Passed, step: float) -> Float:
    """Return one column of J, shape (2 m,), from a pass a step away; not finite where the filter runs away."""
    made = np.isfinite(base.innovation)
    S = base.variance[made]
    with np.errstate(invalid="ignore", divide="ignore"):
        first = -(other.innovation[made] - base.innovation[made]) / np.sqrt(S)
        return np.concatenate([first, np.log(other.variance[made] / S) / _ROOT_2]) / step


def active(filtered: RunFilter) -> list[int]:
    """Return which numbers of `Point.vector` this run has."""
    shared = N_HULL + len(filtered.model.names)
    return [*range(shared), *(shared + i for i, used in enumerate(filtered.levels_used()) if used)]


def _steps(filtered: RunFilter, point: Point) -> tuple[Float, Float]:
    """Return how far every number of `Point.vector` is moved, and by what the difference is divided.

    Away from a bound where one is near. Near nothing innovations go with a level's square: by a part of its own size
    they would move by less than the digits of a pass, so a level next to nothing is moved by a part of what is not.
    """
    hull = _HULL_STEP * _typical(filtered, point)
    effects = []
    for (effect, parameter), value in zip(filtered.model.parameters, point.values, strict=True):
        step = _EFFECT_STEP * abs(parameter.steps[0])
        if lasting(effect):
            # an instrument's noise may be a small part of the usual, and what is measured goes with its square
            step = min(step, max(_EFFECT_STEP * abs(value), _LEAST_STEP * step))
        effects.append(-step if value + step > parameter.high else step)
    # the variance with the step, beside the one without it
    least = next_to_nothing(filtered.spec)
    small = least > point.levels
    # a level that these data do not have may be the logarithm of nothing at all
    more = 1.0 + _ADDED * np.exp(2.0 * np.clip(least - point.levels, 0.0, _DEEPEST))
    by = np.where(small, 0.5 * np.log(more), _LEVEL_STEP)
    divisor = np.where(small, 0.5 * (more - 1.0), _LEVEL_STEP)
    return np.concatenate([hull, np.array(effects), by]), np.concatenate([hull, np.array(effects), divisor])


def _typical(filtered: RunFilter, point: Point) -> Float:
    """Size of the hull parameters, also of one that happens to be near 0."""
    L = filtered.run.ship.length_m
    typical: Float = np.maximum(np.abs(point.hull), 0.02 * np.array([1 / L, 1.0, 1 / L**2, 1 / L, 1 / L, 1 / L**2]))
    return typical


def columns(filtered: RunFilter, point: Point, base: Passed, wanted: Sequence[int]) -> list[Float]:
    """Return columns of J, each of shape (2 m,), by a pass of the filter for each, several passes at once.

    Parameters
    ----------
    base : Passed
        The pass there.
    wanted : sequence of int
        Places in `Point.vector`.
    """
    by, divisors = (part[list(wanted)].tolist() for part in _steps(filtered, point))
    return _differences(base, passes(filtered, _beside(point, wanted, by)), divisors)


def with_columns(filtered: RunFilter, point: Point, wanted: Sequence[int]) -> tuple[Passed, list[Float]]:
    """Return the pass at a point and columns of J, as `columns` does: together in lanes, which costs a pass less."""
    by, divisors = (part[list(wanted)].tolist() for part in _steps(filtered, point))
    base, *others = passes(filtered, [point, *_beside(point, wanted, by)])
    return base, _differences(base, others, divisors)


def _beside(point: Point, wanted: Sequence[int], by: Sequence[float]) -> list[Point]:
    return [point.moved(index, step) for index, step in zip(wanted, by, strict=True)]


def _differences(base: Passed, others: Sequence[Passed], divisors: Sequence[float]) -> list[Float]:
    return [difference(base, other, divisor) for other, divisor in zip(others, divisors, strict=True)]
