"""Sway, yaw and surge of one or more runs as one linear system: what GNSS, gyro and compass say without a log.

State (v, r, F, M, psi, gyro bias, c_1, c_2, m, V, V_0, k, path). The lateral model takes a given speed for its own, so
that the whole is linear; the speed it estimates is fed back by the caller. The current ties the two halves together:

    y_v = v - c_N sin K + c_E cos K - m sin(K - K_0)        y_u = V + c_N cos K + c_E sin K

The first of these separates a current along the course from the speed while the heading swings, and so do runs on other
headings, which share V_0 and k. m is what the linear hull lacks and a current along the course would look like, to
each run its own.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from itertools import pairwise

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filters.smoother import LinearSystem
from kempf.pipeline.estimate.no_log.lateral_steps import HEADING, SWAY, YAW, SlowForces, lateral_steps
from kempf.pipeline.estimate.no_log.longitudinal import (
    LOSS,
    N_LONGITUDINAL,
    PATH,
    SETTLED,
    SPEED,
    Surge,
    discretise_surge,
)
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.model.chain import N_CHAIN
from kempf.pipeline.model.ship import Hull

BIAS = N_CHAIN
CURRENT = slice(N_CHAIN + 1, N_CHAIN + 3)
MISFIT = N_CHAIN + 3
FIRST_LONGITUDINAL = N_CHAIN + 4
V, V0, LOST, SUM = (FIRST_LONGITUDINAL + i for i in (SPEED, SETTLED, LOSS, PATH))
N_STATE = FIRST_LONGITUDINAL + 4
#: columns of the measurements
Y_V, Y_R, Y_PSI, Y_U = range(4)
_LONGEST_PAUSE_S = 0.4


@dataclass(frozen=True)
class LateralFit:
    """What the lateral fit of one run gives to the joint system."""

    hull: Hull
    forces: SlowForces
    #: current_m_s, current_rate_per_s: sigma_V and mu_V of eq. (16).
    current_m_s: float
    current_rate_per_s: float
    #: Standard deviations of y_v, y_r and y_psi.
    noise: tuple[float, float, float]


@dataclass(frozen=True)
class Priors:
    """What is known before the first measurement, standard deviations."""

    #: sway_m_s, yaw_rad_s, force_m_s2, moment_rad_s2, heading_rad, bias_rad_s: Wide, but for what the model does not
    #: have: those are 0.
    sway_m_s: float
    yaw_rad_s: float
    force_m_s2: float
    moment_rad_s2: float
    heading_rad: float
    bias_rad_s: float
    #: Of each component of the current.
    current_m_s: float
    #: Of V at the beginning of a run, about the GNSS speed along the bow.
    speed_m_s: float
    #: Mean and standard deviation of V_0.
    settled_m_s: tuple[float, float]
    #: Of k, about 0.
    loss_m: float
    #: Of what the linear hull lacks and the lateral fit takes for a current along the course.
    misfit_m_s: float
    #: What the current changes between two runs, over the root of the time between them.
    drift_m_s_per_root_s: float


@dataclass(frozen=True, eq=False)
class MotionRun:
    """One run on the instants of its record."""

    record: Record
    #: Shape (n,). GNSS speed along the bow, NaN where not measured.
    along_m_s: Float
    #: Shape (n,). r^2 for the loss of speed, rad^2/s^2.
    squared_rate: Float

    @property
    def base_heading_rad(self) -> float:
        """Mean heading, rad."""
        return float(np.nanmean(self.record.heading_rad))


def coarsened(record: Record) -> Record:
    """Return the record without most of the instants at which nothing but the compass was read.

    Beside a rate gyro they tell the speed nothing, and cost most. One is kept where nothing else was measured for a
    while, for the course of the rudder.
    """
    if not record.used[Y_R]:
        return record
    needed = np.any(np.isfinite(record.measured[:, [Y_V, Y_R]]), axis=1)
    needed[[0, -1]] = True
    keep, last = needed.copy(), -np.inf
    for k, instant in enumerate(record.time_s):
        keep[k] = needed[k] or instant - last > _LONGEST_PAUSE_S
        last = instant if keep[k] else last
    n = record.time_s.size
    columns = {field.name: getattr(record, field.name) for field in fields(record)}
    rows = {k: v[keep] for k, v in columns.items() if isinstance(v, np.ndarray) and v.shape[0] == n}
    return replace(record, **rows)


def run_of(record: Record) -> MotionRun:
    """Place the GNSS speed along the bow on the instants of the record; the turning is not known yet and is 0."""
    along = np.full(record.time_s.size, np.nan)
    since = (record.lateral.time_utc_ns - record.start_utc_ns).astype(np.float64) * 1e-9
    row = np.clip(np.searchsorted(record.time_s, since - 1e-6), 0, record.time_s.size - 1)
    here = np.abs(record.time_s[row] - since) < 1e-6
    # what was taken out of y_v as a gross error is one in the other component of the same reading
    here &= np.isfinite(record.measured[row, Y_V])
    along[row[here]] = record.lateral.forward_m_s[here]
    return MotionRun(record, along, np.zeros(record.time_s.size))


def join(runs: tuple[MotionRun, ...], fits: tuple[LateralFit, ...], priors: Priors, current: str) -> LinearSystem:
    """Join runs, in the order of time, to one system; `set_surge` then gives it its longitudinal half.

    Parameters
    ----------
    runs : tuple of MotionRun
        Their ``record.speed_m_s`` is the speed that the lateral model takes.
    fits : tuple of LateralFit
        One a run.
    current : {"earth", "lateral", "none"}
        See `kempf.schemas.model_spec.ModelSpec`. ``lateral``: V_T across the bow, and beside it a current along it that
        only V_0 separates from the speed.
    """
    parts = [_lateral_half(run, fit, current) for run, fit in zip(runs, fits, strict=True)]
    for number in range(1, len(runs)):
        before, here = runs[number - 1].record, runs[number].record
        gap_s = (here.start_utc_ns - before.start_utc_ns) * 1e-9 - float(before.time_s[-1])
        _bridge(parts[number], runs[number], gap_s, priors, current)
    x0, P0 = _initial(runs[0], priors, current)
    Phi, g, Q, Y, H, R = (np.concatenate([part[i] for part in parts]) for i in range(6))
    return LinearSystem(Phi, g, Q, Y, H, R, x0, P0)


def spans(runs: tuple[MotionRun, ...]) -> tuple[slice, ...]:
    """Return the rows of each run in the joint system."""
    edges = np.cumsum([0, *(run.record.time_s.size for run in runs)])
    return tuple(slice(int(a), int(b)) for a, b in pairwise(edges))


def set_surge(
    system: LinearSystem, runs: tuple[MotionRun, ...], surge: Surge, along_noise_m_s: float, averaged: int
) -> None:
    """Write the longitudinal half into a joint system, in place: it is what a search changes again and again.

    Parameters
    ----------
    system : LinearSystem
        Of `join`.
    along_noise_m_s : float
        Standard deviation of y_u.
    averaged : int
        Index of the run over which the state ``path`` sums up V.
    """
    own = slice(FIRST_LONGITUDINAL, N_STATE)
    for number, (run, span) in enumerate(zip(runs, spans(runs), strict=True)):
        rows = slice(span.start + 1, span.stop)
        squared = 0.5 * (run.squared_rate[1:] + run.squared_rate[:-1])
        Phi, Q = discretise_surge(surge, np.diff(run.record.time_s), squared)
        if number != averaged:
            Phi[:, PATH], Q[:, PATH], Q[:, :, PATH] = np.eye(N_LONGITUDINAL)[PATH], 0.0, 0.0
        system.Phi[rows, own, own], system.Q[rows, own, own] = Phi, Q
    system.R[:, Y_U] = along_noise_m_s**2


def _lateral_half(run: MotionRun, fit: LateralFit, current: str) -> tuple[Float, ...]:
    """Return Phi, g, Q, Y, H, R of one run; its first step and its longitudinal half are left as the identity."""
    record, n = run.record, run.record.time_s.size
    step_s = np.diff(record.time_s)
    speed = 0.5 * (record.speed_m_s[1:] + record.speed_m_s[:-1])
    rudder = np.column_stack([record.rudder_rad[:-1], record.rudder_rad[1:]])
    Phi, g, Q = np.tile(np.eye(N_STATE), (n, 1, 1)), np.zeros((n, N_STATE)), np.zeros((n, N_STATE, N_STATE))
    chain = lateral_steps(fit.hull, fit.forces, step_s, speed, rudder)
    Phi[1:, :N_CHAIN, :N_CHAIN], g[1:, :N_CHAIN], Q[1:, :N_CHAIN, :N_CHAIN] = chain
    decay = np.exp(-fit.current_rate_per_s * step_s)
    # V_T takes in what the swinging heading does to the current; the stream along the course does not vary like that
    for i in range(CURRENT.start, CURRENT.stop if current == "earth" else CURRENT.start + 1):
        Phi[1:, i, i], Q[1:, i, i] = decay, fit.current_m_s**2 * (1.0 - decay**2)
    Y = np.column_stack([record.measured, run.along_m_s])
    H, R = np.zeros((n, 4, N_STATE)), np.ones((n, 4))
    H[:, Y_V, SWAY] = H[:, Y_R, YAW] = H[:, Y_R, BIAS] = H[:, Y_PSI, HEADING] = H[:, Y_U, V] = 1.0
    H[:, Y_V, CURRENT], H[:, Y_U, CURRENT] = _current_rows(record, current)
    if current == "earth":
        heading = np.nan_to_num(record.heading_rad, nan=run.base_heading_rad)
        H[:, Y_V, MISFIT] = -np.sin(heading - run.base_heading_rad)
    R[:, :Y_U] = np.square(fit.noise)
    return Phi, g, Q, Y, H, R


def _current_rows(record: Record, current: str) -> tuple[Float, Float]:
    """Return how (c_1, c_2) enter y_v and y_u, shapes (n, 2)."""
    if current == "earth":
        # in a gap of the heading neither is measured
        heading = np.nan_to_num(record.heading_rad)
        sine, cosine = np.sin(heading), np.cos(heading)
        return np.column_stack([-sine, cosine]), np.column_stack([cosine, sine])
    here = float(current == "lateral")
    return np.tile([here, 0.0], (record.time_s.size, 1)), np.tile([0.0, here], (record.time_s.size, 1))


def _initial(run: MotionRun, priors: Priors, current: str) -> tuple[Float, Float]:
    """Return mean, shape (n_state,), and covariance, shape (n_state, n_state), before the first measurement."""
    x0, std = np.zeros(N_STATE), np.zeros(N_STATE)
    std[:N_CHAIN] = priors.sway_m_s, priors.yaw_rad_s, priors.force_m_s2, priors.moment_rad_s2, priors.heading_rad
    std[BIAS], std[LOST] = priors.bias_rad_s, priors.loss_m
    std[MISFIT] = priors.misfit_m_s
    std[CURRENT] = priors.current_m_s if current != "none" else 0.0
    x0[V], std[V] = _first_speed(run), priors.speed_m_s
    x0[V0], std[V0] = priors.settled_m_s
    return x0, np.diag(std**2)


def _first_speed(run: MotionRun) -> float:
    return float(run.along_m_s[np.flatnonzero(np.isfinite(run.along_m_s))[0]])


def _bridge(part: tuple[Float, ...], run: MotionRun, gap_s: float, priors: Priors, current: str) -> None:
    """Write the step from the run before to this one: motion and forces begin anew, current, V_0, k and bias stay.

    m begins anew too: what a linear hull lacks depends on how far and how fast she is swung.
    """
    Phi, g, Q = part[:3]
    x0, P0 = _initial(run, priors, current)
    anew = [*range(N_CHAIN), MISFIT, V]
    Phi[0, anew, anew] = 0.0
    g[0, anew] = x0[anew]
    Q[0, anew, anew] = np.diag(P0)[anew]
    if current != "none":
        for i in range(CURRENT.start, CURRENT.stop):
            Q[0, i, i] = priors.drift_m_s_per_root_s**2 * max(gap_s, 0.0)
