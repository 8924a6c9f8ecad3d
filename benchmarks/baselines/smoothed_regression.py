"""Kalman filter, Rauch-Tung-Striebel smoother, least squares on the smoothed accelerations; and again.

The procedure of Alexandersson, Mao & Ringsberg (2022), "System identification of vessel manoeuvring models", Ocean
Engineering 266, 112940, and of their package vessel-manoeuvring-models, here for the linear model and for measured
lateral speed and yaw rate: a ship whose parameters are guessed is the process of the filter, the smoothed states are
differentiated, a regression gives the next ship. With the logged speed as an input the filter is linear and varies
with time, so there is nothing for an extended filter to linearise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.baselines.multiple_models import accelerations
from benchmarks.baselines.start import named, ranked_starts
from benchmarks.baselines.step import exact_step
from kempf.pipeline.channels.series import Float
from kempf.pipeline.compiled import njit
from kempf.pipeline.estimate.classical.report import NO_UNCERTAINTY, estimate_of
from kempf.pipeline.estimate.classical.resample import even, step_of
from kempf.pipeline.estimate.paper.least_squares import regress
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.result import Estimate
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import ModelSpec

#: from the rows of [a11 a12 b1], [a21 a22 b2] to the order of the parameters
_ORDER = [0, 1, 3, 4, 2, 5]


@dataclass(frozen=True)
class SmoothedRegressionSettings:
    """Settings of the procedure."""

    #: Common step, s; None takes the GNSS period.
    step_s: float | None = None
    #: Passes of filter, smoother and regression at most.
    iterations: int = 50
    #: White acceleration in the filter, as a share of the accelerations' rms over the record.
    process_share: float = 0.3
    #: Regress on V^2 too, as the package's linear model does: a constant force and moment. Without it everything that
    #: acts is taken for the ship.
    constant: bool = True
    #: Converged when no parameter changes by more than this share.
    tolerance: float = 1e-4


def identify(record: Record, spec: ModelSpec, arm_per_m: float, settings: SmoothedRegressionSettings) -> Estimate:
    """Estimate the hull by regression on smoothed accelerations, from the Mariner-like ship that fits best.

    Parameters
    ----------
    spec : ModelSpec
        Its wind and current are left out.
    arm_per_m : float
        Without meaning here.

    Returns
    -------
    Estimate
        Standard errors are those of the regression, which takes smoothed values for independent ones.

    Raises
    ------
    DataRejected
        No plausible ship stays bounded over the record.
    """
    used = even(record, settings.step_s)
    starts = ranked_starts(used)
    if not starts:
        raise DataRejected(
            "no_ship_explains_it",
            "No Mariner-like ship of any length stays bounded when she is simulated over this record.",
            "Look at the speed and the rudder over the segment.",
        )
    (length, hull), blind_to = starts[0], "wind and current"
    if settings.constant:
        blind_to = "current, and of wind only what is constant"
    pushed = np.zeros(2)
    covariance = NO_UNCERTAINTY
    iterations: list[dict[str, Any]] = [{"iteration": 0, **named(hull)}]
    converged, reason = False, "the iterations ran out while the parameters still moved"
    for count in range(1, settings.iterations + 1):
        states = smooth(used, hull, pushed, settings)
        if states is None:
            reason = f"diverged in iteration {count}: the ship of the last regression does not stay bounded"
            break
        found = _regression(used, states, constant=settings.constant)
        if found is None:
            reason = f"diverged in iteration {count}: no finite regression"
            break
        last, (hull, pushed, covariance) = hull, found
        iterations.append({"iteration": count, **named(hull)})
        change = float(np.max(np.abs(hull - last) / np.maximum(np.abs(hull), 1e-300)))
        if change < settings.tolerance:
            converged, reason = True, f"the last pass changed the parameters by {change:.1e}"
            break
    return estimate_of(
        "ekf-ols",
        used,
        hull,
        covariance,
        converged=converged,
        reason=reason,
        report={
            "start": f"Mariner scaled to {length:g} m",
            "process_share": settings.process_share,
            # dv/dt and dr/dt over V^2 that act all the time, 1/m and 1/m^2
            "constant": [float(c) for c in pushed],
        },
        spec=spec,
        iterations=tuple(iterations),
        blind_to=blind_to,
        warnings=("standard errors take smoothed values for independent ones: they are far too small",),
    )


def _regression(record: Record, states: Float, *, constant: bool) -> tuple[Float, Float, Float] | None:
    """Return hull, shape (6,), constant, shape (2,), and the hull's covariance of one regression; None if not finite.

    ::

        dx/dt = [V v, V r, V^2 delta, V^2] theta
    """
    V = record.speed_m_s
    rates = np.column_stack([np.gradient(states[:, i], step_of(record)) for i in range(2)])
    inputs = np.column_stack([V**2 * record.rudder_rad, V**2]) if constant else (V**2 * record.rudder_rad)[:, None]
    found = regress(states * V[:, None], inputs, rates)
    rows = np.hstack([found.A, found.B[:, :1]])
    pushed = found.B[:, 1] if constant else np.zeros(2)
    if not (np.all(np.isfinite(rows)) and np.all(np.isfinite(pushed))):
        return None
    width = 2 + inputs.shape[1]
    order = [0, 1, width, width + 1, 2, width + 2]
    return rows.ravel()[_ORDER], pushed, found.covariance[np.ix_(order, order)]


def smooth(record: Record, hull: Float, pushed: Float, settings: SmoothedRegressionSettings) -> Float | None:
    """Return the smoothed (v, r), shape (n, 2), of a hull; None where she does not stay bounded.

    Parameters
    ----------
    record : Record
        At equal steps.
    hull : ndarray, shape (6,)
    pushed : ndarray, shape (2,)
        dv/dt and dr/dt over V^2 that act all the time, 1/m and 1/m^2.
    """
    step, measured = step_of(record), np.ascontiguousarray(record.measured[:, :2])
    stated = np.nan_to_num(record.noise_start[:2], nan=0.0)
    if stated[1] == 0.0:
        stated[1] = record.noise_start[2] / (np.sqrt(2.0) * step)
    noise = np.maximum(stated, 1e-3 * np.nanstd(measured, axis=0)) ** 2
    process = (settings.process_share * accelerations(measured, step)) ** 2 * step
    states = np.empty_like(measured)
    pushing = np.concatenate([hull[:4], pushed])
    bounded = _smooth(hull, pushing, process, noise, step, record.speed_m_s, record.rudder_rad, measured, states)
    return states if bounded and np.all(np.isfinite(states)) else None


@njit(cache=True, nogil=True, error_model="numpy")
def _sandwich(A, P, Q, out):  # type: ignore[no-untyped-def]
    """Out = A (P + Q) A' + Q for symmetric P and diagonal Q, written out: it compiles in a fraction of the time."""
    p00, p01, p11 = P[0, 0] + Q[0], P[0, 1], P[1, 1] + Q[1]
    b00, b01 = A[0, 0] * p00 + A[0, 1] * p01, A[0, 0] * p01 + A[0, 1] * p11
    b10, b11 = A[1, 0] * p00 + A[1, 1] * p01, A[1, 0] * p01 + A[1, 1] * p11
    out[0, 0] = b00 * A[0, 0] + b01 * A[0, 1] + Q[0]
    out[1, 1] = b10 * A[1, 0] + b11 * A[1, 1] + Q[1]
    out[0, 1] = b00 * A[1, 0] + b01 * A[1, 1]
    out[1, 0] = out[0, 1]


@njit(cache=True, nogil=True, error_model="numpy")
def _smooth(hull, pushing, process, noise, step_s, speed, rudder, measured, states):  # type: ignore[no-untyped-def]
    """Filter forwards, smooth backwards (Rauch, Tung & Striebel 1965, AIAA J. 3); False for an absurd hull."""
    n = measured.shape[0]
    A, g, again, push = np.zeros((n, 2, 2)), np.zeros(2), np.zeros((2, 2)), np.zeros(2)
    before, P_before = np.zeros((n, 2)), np.zeros((n, 2, 2))
    x, P = np.zeros((n, 2)), np.zeros((n, 2, 2))
    # the trapezoid of the covariance's integral: half of it enters before the step, half after
    Q = 0.5 * step_s * process
    P_before[0, 0, 0], P_before[0, 1, 1] = 4.0, 0.04
    for k in range(n):
        if k > 0:
            V = 0.5 * (speed[k - 1] + speed[k])
            if not exact_step(hull, V, step_s, rudder[k - 1], rudder[k], A[k], g):
                return False
            exact_step(pushing, V, step_s, 1.0, 1.0, again, push)
            for i in range(2):
                before[k, i] = A[k, i, 0] * x[k - 1, 0] + A[k, i, 1] * x[k - 1, 1] + g[i] + push[i]
            _sandwich(A[k], P[k - 1], Q, P_before[k])
        for i in range(2):
            x[k, i] = before[k, i]
            for j in range(2):
                P[k, i, j] = P_before[k, i, j]
        for i in range(2):
            if np.isnan(measured[k, i]):
                continue
            S, e = P[k, i, i] + noise[i], measured[k, i] - x[k, i]
            p0, p1 = P[k, 0, i], P[k, 1, i]
            x[k, 0] += p0 * e / S
            x[k, 1] += p1 * e / S
            P[k, 0, 0] -= p0 * p0 / S
            P[k, 0, 1] -= p0 * p1 / S
            P[k, 1, 0] -= p0 * p1 / S
            P[k, 1, 1] -= p1 * p1 / S
        if not (abs(x[k, 0]) + abs(x[k, 1]) < 1e6):
            return False
    states[n - 1, 0], states[n - 1, 1] = x[n - 1, 0], x[n - 1, 1]
    for k in range(n - 2, -1, -1):
        F, M = A[k + 1], P_before[k + 1]
        determinant = M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]
        d0, d1 = states[k + 1, 0] - before[k + 1, 0], states[k + 1, 1] - before[k + 1, 1]
        # the gain is P A' M^-1; from the right: M^-1 d, then A', then P
        m0, m1 = (M[1, 1] * d0 - M[0, 1] * d1) / determinant, (M[0, 0] * d1 - M[1, 0] * d0) / determinant
        t0, t1 = F[0, 0] * m0 + F[1, 0] * m1, F[0, 1] * m0 + F[1, 1] * m1
        states[k, 0] = x[k, 0] + P[k, 0, 0] * t0 + P[k, 0, 1] * t1
        states[k, 1] = x[k, 1] + P[k, 1, 0] * t0 + P[k, 1, 1] * t1
    return True
