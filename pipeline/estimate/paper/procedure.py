"""The paper's procedure, eqs. (11)-(15), for any linear vehicle with H = [E H1], every pass on record.

Least squares with the disturbances taken as zero; a filter built from it that estimates states and disturbances;
measurements and dynamics corrected by the disturbances; least squares again, and so on. It regresses on noisy
measurements and need not settle: how it ended is part of the result. The ship is one vehicle, see
`kempf.pipeline.estimate.paper.ship`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filters.kalman_filter import Filtered, run_filter
from kempf.pipeline.estimate.paper.least_squares import Regression, regress
from kempf.pipeline.estimate.paper.vehicle import LinearVehicle
from kempf.schemas.errors import DataRejected

End = Literal["converged", "cycling", "diverged", "still moving"]

#: disturbances that move the measurements by more than this many times what was measured are none
_ABSURD = 10.0
#: a cycle returns to where it was within this share of its longest stride, all the way round
_SAME = 0.02


@dataclass(frozen=True)
class ProcedureSettings:
    """Settings of the procedure."""

    #: Passes after the first approximation; the paper shows 25.
    iterations: int = 25
    #: Converged when no regressor's part in the states' increments changes by more than this share of the increments,
    #: root mean squares both.
    tolerance: float = 1e-4
    #: R is never taken smaller than half the residual variance of the last regression. The residual of eq. (14) holds
    #: the noise at both ends of a step: half of it is R where A is near unity and the model true, and more where it is
    #: not.
    floor: bool = True
    #: Make all passes although it has converged.
    run_on: bool = False
    #: Leading rows that the regressions leave out while the filter settles; the paper leaves out none.
    skip: int = 0


@dataclass(frozen=True, eq=False)
class ProcedurePass:
    """One pass."""

    #: [A B] after this pass; pass 0 is the first approximation.
    regression: Regression
    #: Against the pass before, see `ProcedureSettings.tolerance`; NaN in pass 0.
    change: float
    #: Shape (n_state, n_state). That the filter of this pass used; NaN in pass 0.
    R: Float
    #: States, then disturbances, with [A B] of the pass *before*; None in pass 0.
    filtered: Filtered | None


@dataclass(frozen=True, eq=False)
class ProcedureCourse:
    """How the procedure went."""

    #: The first approximation, then one an iteration.
    passes: tuple[ProcedurePass, ...]
    #: One of {"converged", "cycling", "diverged", "still moving"}.
    end: End
    #: The same in words with its figures.
    reason: str
    #: Passes after which a cycle repeats.
    period: int | None
    #: States and disturbances that the measurements do not determine with the [A B] of the first approximation.
    hidden: tuple[str, ...]
    #: States and disturbances with the [A B] of the last pass; None where the filter does not exist.
    last: Filtered | None


def iterate(
    vehicle: LinearVehicle, measured: Float, inputs: Float, R: Float, settings: ProcedureSettings
) -> ProcedureCourse:
    """Run the procedure on one record.

    Parameters
    ----------
    measured : ndarray, shape (n, n_state)
        Y of eq. (2) at equal steps; a row that holds a NaN is left out of the regression and bridged by the filter.
    inputs : ndarray, shape (n, n_input)
        Over the step that follows each row.
    R : ndarray, shape (n_state, n_state)
        Covariance of the measurement noise, as known beforehand.

    Raises
    ------
    DataRejected
        ``segment_too_short``: fewer whole steps than unknowns in a row of [A B].
    """
    now = _whole_steps(vehicle, measured, settings.skip)
    regression = regress(measured[now], inputs[now], measured[now + 1])
    scale = _scale(measured, inputs, now)
    passes = [ProcedurePass(regression, np.nan, np.full_like(R, np.nan), None)]
    states, targets = measured[now], measured[now + 1]
    end: tuple[End, str, int | None] | None = None
    converged = ""
    for count in range(1, settings.iterations + 1):
        bounded = _bounded(R, regression, states, inputs[now], targets) if settings.floor else R
        filtered = _filtered(vehicle, regression, measured, inputs, bounded)
        if filtered is None:
            end = ("diverged", f"diverged in iteration {count}: the filter of the last parameters does not exist", None)
            break
        W, entering = filtered.updated[:, len(vehicle.states) :], vehicle.entering(regression.A)
        size = _size(vehicle, W, entering, measured)
        if not size < _ABSURD:
            words = f"disturbances {size:.0f} times what was measured"
            end = ("diverged", f"diverged in iteration {count}: the filter finds {words}", None)
            break
        corrected = measured - W @ vehicle.carried.T  # (15)
        states, targets = corrected[now], corrected[now + 1] - W[now] @ entering.T
        previous, regression = regression, regress(states, inputs[now], targets)
        change = _distance(regression, previous, scale)
        passes.append(ProcedurePass(regression, change, bounded, filtered))
        if change < settings.tolerance and not converged:
            converged = f"converged in iteration {count}: it changed [A B] by {change:.1e}"
            if not settings.run_on:
                break
    if end is None:
        end = ("converged", converged, None) if converged else judge(passes, scale)
    bounded = _bounded(R, regression, states, inputs[now], targets) if settings.floor else R
    last = _filtered(vehicle, regression, measured, inputs, bounded)
    return ProcedureCourse(tuple(passes), end[0], end[1], end[2], vehicle.hidden(passes[0].regression.A), last)


def judge(passes: list[ProcedurePass], scale: Float) -> tuple[End, str, int | None]:
    """Say of passes that did not converge whether they repeat themselves, or go ever further.

    Parameters
    ----------
    scale : ndarray, shape (n_state, n_state + n_input)
        Part of one unit of each element in the increments.

    Returns
    -------
    end : {"cycling", "diverged", "still moving"}
    reason : str
    period : int or None
    """
    fits = [p.regression for p in passes]
    strides = [_distance(later, earlier, scale) for later, earlier in zip(fits[1:], fits, strict=False)]
    for period in range(2, (len(fits) - 1) // 2 + 1):
        ring = range(len(fits) - period, len(fits))
        back = max(_distance(fits[k], fits[k - period], scale) for k in ring)
        if back < _SAME * max(strides[-period:]):
            return "cycling", f"cycling with period {period}: the passes repeat without settling", period
    if not strides:
        return "still moving", "no iteration was asked for: this is the first approximation", None
    if strides[-1] > max(1.0, strides[0]):
        words = f"by {strides[-1]:.1e} times the states' own increments, more than the first"
        return "diverged", f"diverged: the last pass moved the parameters {words}", None
    words = f"the iterations ran out while the parameters still moved, by {strides[-1]:.1e} in the last one"
    return "still moving", words, None


def _whole_steps(vehicle: LinearVehicle, measured: Float, skip: int) -> NDArray[np.int64]:
    whole = np.all(np.isfinite(measured), axis=1)
    now = np.flatnonzero(whole[:-1] & whole[1:])
    now = now[now >= skip]
    unknown = len(vehicle.states) + len(vehicle.inputs)
    if now.size <= unknown:
        raise DataRejected(
            "segment_too_short",
            f"The record holds {now.size} pairs of whole samples; each row of [A B] has {unknown} unknowns.",
            "Give a longer record, or fill the gaps.",
            {"pairs": int(now.size), "needed": unknown + 1},
        )
    return now


def _scale(measured: Float, inputs: Float, now: NDArray[np.int64]) -> Float:
    """Rms of each regressor over the rms increment of each state, shape (n_state, n_state + n_input)."""
    regressors = np.sqrt(np.mean(np.square(np.column_stack([measured[now], inputs[now]])), axis=0))
    increments = np.sqrt(np.mean(np.square(measured[now + 1] - measured[now]), axis=0))
    scale: Float = regressors / np.maximum(increments, 1e-300)[:, None]
    return np.where(np.isfinite(scale), scale, 0.0)


def _distance(one: Regression, other: Regression, scale: Float) -> float:
    moved = np.hstack([one.A - other.A, one.B - other.B])
    return float(np.max(np.abs(moved) * scale))


def _bounded(R: Float, regression: Regression, states: Float, inputs: Float, targets: Float) -> Float:
    """R with its diagonal no smaller than half the residual variance of the last regression."""
    residual = targets - states @ regression.A.T - inputs @ regression.B.T
    missing = np.maximum(0.5 * np.mean(residual**2, axis=0) - np.diag(R), 0.0)
    result: Float = R + np.diag(missing)
    return result


def _filtered(
    vehicle: LinearVehicle, regression: Regression, measured: Float, inputs: Float, R: Float
) -> Filtered | None:
    """Step 2: the filter (3)-(5) with the last parameters; None where it does not exist."""
    P0 = vehicle.initial_covariance
    system = vehicle.augmented(regression.A, regression.B)
    start = np.zeros(P0.shape[0])
    with np.errstate(all="ignore"):  # parameters that run away overflow here, which is reported
        try:
            filtered = run_filter(system.A, system.B, system.G, system.H, R, measured, inputs, start, P0)
        except np.linalg.LinAlgError:
            return None
    return filtered if np.all(np.isfinite(filtered.updated)) else None


def _size(vehicle: LinearVehicle, W: Float, entering: Float, measured: Float) -> float:
    """Rms of what the disturbances do to measurements and states in a step, over the rms of the measurements."""
    spread = np.sqrt(np.nanmean(np.square(measured), axis=0))
    effects = [np.sqrt(np.mean(np.square(W @ way.T), axis=0)) for way in (vehicle.carried, entering)]
    return float(max(np.max(effect / np.maximum(spread, 1e-300)) for effect in effects))
