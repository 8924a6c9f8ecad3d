"""The regression of logged speeds on what costs them, at every time constant and with every form of the loss."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.linalg import inv, lstsq, slogdet

from kempf.pipeline.channels.series import Float
from kempf.pipeline.manoeuvre.surge.logged_speed import LoggedSpeed
from kempf.pipeline.manoeuvre.surge.surge_fit import SurgeFit
from kempf.pipeline.manoeuvre.surge.usual import (
    BESIDE_MEAN,
    BESIDE_STD,
    BY_DRIFT,
    BY_RATE,
    LOSS_MEAN,
    LOSS_STD,
    TAU,
    TAU_MEDIAN,
    TAU_SPREAD,
)

#: no log is better than this share of the speed
_LEAST_ERROR = 0.0005
_LAGS = 400
#: the shaft kept the same speed where no more than this share lies between the largest and the smallest
_SAME_SPEED = 0.02

#: of every log its speed and its losses, without what V_0 and the first speed explain
Columns = list[tuple[Float, Float]]


def posterior_of(logs: Sequence[LoggedSpeed], forms: Sequence[tuple[int, ...]]) -> SurgeFit:
    """Return the posterior over all forms of the loss and all tau; errors that remember count as fewer."""
    settled = [log.settled_m_s for log in logs]
    mean = float(np.mean(settled))
    references = (None, mean) if max(settled) > (1.0 + _SAME_SPEED) * min(settled) else (None,)
    grid = [(reference, tau) for reference in references for tau in TAU]
    columns = [[log.columns(tau, reference) for log in logs] for reference, tau in grid]
    freed = [_freed(logs, own) for own in columns]
    # where the logs alone are best, their errors are smallest: so large they are
    every = [_left(own, kinds) for kinds in forms for own in freed]
    left = min(every, key=lambda parts: sum(float(e @ e) for e in parts))
    count = sum(e.size for e in left)
    error = max(float(np.sqrt(sum(float(e @ e) for e in left) / count)), _LEAST_ERROR)
    variance = error**2 * _memory(left)
    reduced = [[_Reduced.of(log, pair, variance) for log, pair in zip(logs, own, strict=True)] for own in columns]
    parts = [
        (reference, tau, kinds, _solved(own, tau, kinds))
        for kinds in forms
        for (reference, tau), own in zip(grid, reduced, strict=True)
    ]
    tau = np.array([part[1] for part in parts])
    # the area of the other parameters counts, as in any marginal likelihood
    score = np.array([part[3].score for part in parts]) + (np.log(tau / TAU_MEDIAN) / TAU_SPREAD) ** 2
    p = np.exp(-0.5 * (score - score.min()))
    p /= p.sum()
    loss, covariance = np.zeros((tau.size, 4)), np.zeros((tau.size, 4, 4))
    for k, (_, _, kinds, solved) in enumerate(parts):
        loss[k, kinds] = solved.mean
        covariance[k][np.ix_(kinds, kinds)] = solved.covariance
    ratios = np.array(parts[int(np.argmax(p))][3].settled)
    by_time = np.array([part[0] is not None for part in parts])
    return SurgeFit(
        *(tau, p, loss, covariance, (float(np.mean(ratios)), float(np.std(ratios))), error * mean, ()),
        by_time=by_time,
        reference_m_s=mean,
    )


@dataclass(frozen=True, eq=False)
class _Solved:
    """What the logs say at one tau with some kinds of loss."""

    #: Minus twice the logarithm of the evidence, but for constants.
    score: float
    mean: Float
    covariance: Float
    #: V_0 / V_s of every log.
    settled: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class _Reduced:
    """What a log says at one tau of all losses, over the error's variance, V_0 and the first speed taken out."""

    #: information, right: Shape (4, 4) and (4,). Of the losses.
    information: Float
    right: Float
    constant: float
    logdet: float
    #: V_0 / V_s without losses, and by how much each lowers it, shape (5,).
    settled: Float

    @classmethod
    def of(cls, log: LoggedSpeed, columns: tuple[Float, Float], variance: float) -> _Reduced:
        own, lost = columns
        # V_0 has a prior at V_s, the first speed a wide one
        precision = np.array([1.0 / log.settled_std**2, 1.0])
        A = own.T @ own / variance + np.diag(precision)
        b = own.T @ log.speed / variance + precision
        C = own.T @ lost / variance
        solved = np.linalg.solve(A, np.column_stack([b, C]))
        return cls(
            information=lost.T @ lost / variance - C.T @ solved[:, 1:],
            right=lost.T @ log.speed / variance - C.T @ solved[:, 0],
            constant=float(log.speed @ log.speed / variance + precision.sum() - b @ solved[:, 0]),
            logdet=float(slogdet(A)[1]),
            settled=solved[0],
        )


def _solved(logs: Sequence[_Reduced], tau: float, kinds: Sequence[int]) -> _Solved:
    """Return the posterior of the losses at a tau."""
    kinds = list(kinds)
    information = np.sum([log.information[np.ix_(kinds, kinds)] for log in logs], axis=0)
    right = np.sum([log.right[kinds] for log in logs], axis=0)
    constant, logdet = sum(log.constant for log in logs), sum(log.logdet for log in logs)
    unit = np.array([tau, 1.0, 1.0, tau])[kinds]
    mean_before, std_before = LOSS_MEAN[kinds] * unit, LOSS_STD[kinds] * unit
    if BY_DRIFT in kinds and BY_RATE in kinds:
        beside = kinds.index(BY_RATE)
        mean_before[beside], std_before[beside] = BESIDE_MEAN * tau, BESIDE_STD * tau
    prior = np.diag(1.0 / std_before**2)
    whole = information + prior
    target = right + prior @ mean_before
    mean = np.asarray(np.linalg.solve(whole, target), dtype=np.float64)
    cost = constant + mean_before @ prior @ mean_before - target @ mean
    area = logdet + slogdet(whole)[1] - slogdet(prior)[1]
    covariance = np.asarray(inv(whole), dtype=np.float64)
    settled = tuple(float(log.settled[0] - log.settled[1:][kinds] @ mean) for log in logs)
    return _Solved(float(cost + area), mean, covariance, settled)


def _freed(logs: Sequence[LoggedSpeed], columns: Columns) -> Columns:
    """Return speed and losses of every log at one tau without what V_0 and the first speed explain.

    So the losses alone are to be solved for (Frisch & Waugh 1933).
    """
    residuals = []
    for log, (own, lost) in zip(logs, columns, strict=True):
        base = np.linalg.qr(own)[0]
        residuals.append((log.speed - base @ (base.T @ log.speed), lost - base @ (base.T @ lost)))
    return residuals


def _left(freed: Columns, kinds: Sequence[int]) -> list[Float]:
    """Return what the model leaves of every log's speed, without priors; see `_freed`."""
    chosen = [(speed, lost[:, list(kinds)]) for speed, lost in freed]
    whole, right = np.vstack([lost for _, lost in chosen]), np.concatenate([speed for speed, _ in chosen])
    coefficients = lstsq(whole, right, rcond=1e-10)[0]
    return [speed - lost @ coefficients for speed, lost in chosen]


def _memory(left: Sequence[Float]) -> float:
    """Return how many errors count as one: 1 + 2 sum of the autocorrelations up to where they fade."""
    total = sum(float(e @ e) for e in left)
    if total <= 0.0:
        return 1.0
    count = 1.0
    for lag in range(1, _LAGS):
        correlation = sum(float(e[lag:] @ e[:-lag]) for e in left if e.size > lag) / total
        if correlation < 0.05:
            break
        count += 2.0 * correlation
    return count
