"""The speed of a ship in a turn, identified from what her log showed in the manoeuvres.

    dV/dt = (V_0 (1 - k_r (L r / V_a)^2 - k_d delta^2) - V) V_a / (tau L)

V_0 is the speed at which thrust and resistance balance on a straight course, V_a that of the approach, tau the time in
ship lengths in which she finds it, k_r and k_d what turn and rudder cost of it in the long run, without a dimension.
Both kinds of loss are in Norrbin (1971), "Theory and observations on the use of a mathematical model for ship
manoeuvring in deep and confined waters", SSPA publication 68; the loss by v r is in k_r, as drift goes with turn.

For a given tau all else enters linearly. So tau is gone through on a grid, and at each value the rest is a linear
regression with priors: the posterior is exact but for the grid, and needs no start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.linalg import inv, lstsq, slogdet
from scipy.signal import lfilter

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.schemas.symbols import CHANNEL_SYMBOLS

#: of tau: ships come back to their speed in some lengths to some dozens of them; median, and its logarithm's spread
TAU_MEDIAN, TAU_SPREAD = 8.0, 0.7
#: of k_r: with (L r / V_a)^2 of 0.1 to 0.2 in a hard turn a loss of 20 to 60 %; of k_d: 0.4 rad cost some percent
LOSS_MEAN, LOSS_STD = np.array([2.0, 0.3]), np.array([2.0, 0.3])
#: of V_0 about the speed of the approach, as a share of it
_SETTLED_STD = 0.03
_GRID = np.exp(np.linspace(np.log(1.0), np.log(64.0), 121))
#: no log is better than this share of the approach speed
_LEAST_ERROR = 0.0005
#: a posterior wider than this share of the prior comes from the prior
_FROM_PRIOR = 0.7
_LAGS = 400


@dataclass(frozen=True, eq=False)
class SurgeFit:
    """What the logs say of the speed in turns, as a mixture over tau."""

    #: Shape (g,). tau, in ship lengths, and its probabilities.
    tau: Float
    probability: Float
    #: loss, covariance: Shape (g, 2) and (g, 2, 2). k_r and k_d at every tau; rows of k_d are 0 where it is left out.
    loss: Float
    covariance: Float
    #: Whether k_d is in the model.
    by_rudder: bool
    #: Root mean square of what is left of the logged speed, m/s.
    error_m_s: float
    #: What a user should know of it, sentences.
    remarks: tuple[str, ...]

    @property
    def best(self) -> Float:
        """The most probable tau with its k_r and k_d, shape (3,)."""
        k = int(np.argmax(self.probability))
        return np.array([self.tau[k], *np.maximum(self.loss[k], 0.0)])

    @property
    def std(self) -> Float:
        """Standard deviations of tau, k_r and k_d, shape (3,)."""
        p = self.probability
        means = [p @ self.tau, *(p @ self.loss)]
        spread = p @ (self.tau - means[0]) ** 2
        within = np.einsum("g,gii->i", p, self.covariance) + p @ (self.loss - np.array(means[1:])) ** 2
        return np.sqrt([spread, *within])

    def drawn(self, normal: Float) -> Float:
        """Return tau, k_r and k_d of draws, shape (n, 3), from standard normal numbers, shape (n, 3)."""
        from scipy.stats import norm

        below = np.concatenate([[0.0], np.cumsum(self.probability)])
        middle = 0.5 * (below[:-1] + below[1:])
        at = np.interp(norm.cdf(normal[:, 0]), middle, np.log(self.tau))
        found = np.empty((len(normal), 3))
        for i, (place, z) in enumerate(zip(at, normal[:, 1:], strict=True)):
            k = int(np.argmin(np.abs(np.log(self.tau) - place)))
            C = self.covariance[k]
            first = np.sqrt(C[0, 0])
            along = C[0, 1] / first if first > 0.0 else 0.0
            loss = self.loss[k] + [first * z[0], along * z[0] + np.sqrt(max(C[1, 1] - along**2, 0.0)) * z[1]]
            found[i] = [np.exp(place), *np.maximum(loss, 0.0)]
        return found


def surge_of(runs: Sequence[GridRun], length_m: float) -> SurgeFit:
    """Identify the speed's equation from the manoeuvres of a ship.

    Parameters
    ----------
    runs : sequence of GridRun
        With the speed through the water that the log showed, or over ground where there is none.
    length_m : float
        Of the ship.
    """
    logs = [log for log in (_Log.of(run, length_m) for run in runs) if log is not None]
    if not logs:
        return _prior(("the speed in turns is a guess: no log shows it",))
    plain, both = _posterior(logs, 1), _posterior(logs, 2)
    chosen = both if both.score < plain.score - 2.0 and both.loss_at_best[1] > 0.0 else plain
    remarks = []
    if chosen.fit.std[1] > _FROM_PRIOR * LOSS_STD[0]:
        remarks.append(
            "the logs hardly show what a turn costs of her speed: the loss is that of usual ships, "
            f"{LOSS_MEAN[0]:g} ± {LOSS_STD[0]:g} (L r / V)^2"
        )
    return SurgeFit(**{**vars(chosen.fit), "remarks": tuple(remarks)})


@dataclass(frozen=True, eq=False)
class _Log:
    """One run: time step, speed, what the shaft does, and what costs speed, all over the speed of the approach."""

    step: float
    speed: Float
    shaft: Float
    costs: Float
    approach_m_s: float

    @classmethod
    def of(cls, run: GridRun, length_m: float) -> _Log | None:
        speed, approach = run.speed_m_s, run.approach_m_s
        rate = _yaw_rate(run, length_m)
        if rate is None or not approach > 0.0 or not np.all(np.isfinite(speed)) or speed.size < 20:
            return None
        shaft = np.ones(speed.size)
        if "shaft_speed" in run.channels and run.approach_per_s > 0.0:
            column = 2 + list(CHANNEL_SYMBOLS.values()).index("shaft_speed")
            shaft = run.inputs[:: (run.inputs.shape[0] - 1) // (speed.size - 1), column] / run.approach_per_s
        square = np.maximum(rate**2, 0.0) * (length_m / approach) ** 2
        costs = np.column_stack([square, run.rudder_rad**2])
        return cls(run.step_s * approach / length_m, speed / approach, shaft, costs, approach)

    def columns(self, tau: float, losses: int) -> tuple[Float, Float]:
        """Return the columns of V_0, of the first speed and of the losses, each through the lag of tau."""
        kept = np.exp(-self.step / tau)

        def lagged(course: Float) -> Float:
            mean = 0.5 * (course[1:] + course[:-1])
            found: Float = np.concatenate([[0.0], lfilter([1.0 - kept], [1.0, -kept], mean)])
            return found

        own = np.column_stack([lagged(self.shaft), kept ** np.arange(self.speed.size)])
        lost = np.column_stack([-lagged(self.costs[:, j]) for j in range(losses)])
        return own, lost


def _yaw_rate(run: GridRun, length_m: float) -> Float | None:
    """Return the yaw rate at the instants, rad/s, without the noise that its square would be larger by."""
    rate, heading = run.measured[:, 1], run.measured[:, 2]
    known = np.isfinite(rate)
    time = run.time_s
    if known.mean() < 0.3:
        there = np.isfinite(heading)
        if there.mean() < 0.3:
            return None
        rate = np.gradient(np.interp(time, time[there], heading[there]), run.step_s)
        known = np.isfinite(rate)
    laid = np.interp(time, time[known], rate[known])
    # a ship's rate does not change within a quarter of her length
    width = max(1, round(0.25 * length_m / max(run.approach_m_s, 0.05) / run.step_s))
    window = np.ones(width) / width
    padded = np.pad(laid, (width // 2, width - 1 - width // 2), mode="edge")
    smooth: Float = np.convolve(padded, window, mode="valid")
    return smooth


@dataclass(frozen=True, eq=False)
class _Posterior:
    fit: SurgeFit
    #: Bayesian information criterion.
    score: float
    loss_at_best: Float


def _posterior(logs: Sequence[_Log], losses: int) -> _Posterior:
    """Return the posterior with so many kinds of loss; errors that remember count as fewer."""
    # where the logs alone are best, their errors are smallest: so large they are
    every = [_left(logs, tau, losses) for tau in _GRID]
    left = min(every, key=lambda parts: sum(float(e @ e) for e in parts))
    count = sum(e.size for e in left)
    error = max(float(np.sqrt(sum(float(e @ e) for e in left) / count)), _LEAST_ERROR)
    variance = error**2 * _memory(left)
    independent = count * error**2 / variance
    found = [_solved(logs, tau, losses, variance) for tau in _GRID]
    log_tau = np.log(_GRID / TAU_MEDIAN) / TAU_SPREAD
    # the area of the other parameters counts, as in any marginal likelihood
    score = np.array([cost + logdet for cost, logdet, *_ in found]) + log_tau**2
    p = np.exp(-0.5 * (score - score.min()))
    p /= p.sum()
    loss, covariance = np.zeros((_GRID.size, 2)), np.zeros((_GRID.size, 2, 2))
    for k, (_, _, mean, spread) in enumerate(found):
        loss[k, :losses], covariance[k, :losses, :losses] = mean, spread
    cost = min(entry[0] for entry in found)
    approach = float(np.mean([log.approach_m_s for log in logs]))
    fit = SurgeFit(_GRID, p, loss, covariance, losses == 2, error * approach, ())
    return _Posterior(fit, cost + losses * np.log(max(independent, 2.0)), loss[int(np.argmax(p))])


def _solved(logs: Sequence[_Log], tau: float, losses: int, variance: float) -> tuple[float, float, Float, Float]:
    """Return misfit, log determinant of the information, and mean and covariance of the losses at a tau."""
    information, right, constant, logdet = np.zeros((losses, losses)), np.zeros(losses), 0.0, 0.0
    for log in logs:
        own, lost = log.columns(tau, losses)
        # V_0 has a prior at the approach's speed, the first speed a wide one
        A = own.T @ own / variance + np.diag([1.0 / _SETTLED_STD**2, 1.0])
        b = own.T @ log.speed / variance + np.array([1.0 / _SETTLED_STD**2, 1.0])
        C = own.T @ lost / variance
        solved = np.linalg.solve(A, np.column_stack([b, C]))
        constant += log.speed @ log.speed / variance + 1.0 / _SETTLED_STD**2 + 1.0 - b @ solved[:, 0]
        right += lost.T @ log.speed / variance - C.T @ solved[:, 0]
        information += lost.T @ lost / variance - C.T @ solved[:, 1:]
        logdet += slogdet(A)[1]
    prior = np.diag(1.0 / LOSS_STD[:losses] ** 2)
    whole = information + prior
    target = right + prior @ LOSS_MEAN[:losses]
    mean = np.linalg.solve(whole, target)
    cost = constant + LOSS_MEAN[:losses] @ prior @ LOSS_MEAN[:losses] - target @ mean
    covariance = np.asarray(inv(whole), dtype=np.float64)
    return float(cost), float(logdet + slogdet(whole)[1]), mean, covariance


def _left(logs: Sequence[_Log], tau: float, losses: int) -> list[Float]:
    """Return what the model leaves of every log's speed, without priors.

    V_0 and the first speed of each log are taken out first (Frisch & Waugh 1933), so that the losses alone are solved.
    """
    speeds, costs = [], []
    for log in logs:
        own, lost = log.columns(tau, losses)
        base = np.linalg.qr(own)[0]
        speeds.append(log.speed - base @ (base.T @ log.speed))
        costs.append(lost - base @ (base.T @ lost))
    found = lstsq(np.vstack(costs), np.concatenate(speeds), rcond=1e-10)[0]
    return [speed - cost @ found for speed, cost in zip(speeds, costs, strict=True)]


def _memory(left: Sequence[Float]) -> float:
    """Return how many errors count as one: 1 + 2 sum of the autocorrelations up to where they fade."""
    total = sum(float(e @ e) for e in left)
    if total <= 0.0:
        return 1.0
    found = 1.0
    for lag in range(1, _LAGS):
        correlation = sum(float(e[lag:] @ e[:-lag]) for e in left if e.size > lag) / total
        if correlation < 0.05:
            break
        found += 2.0 * correlation
    return found


def _prior(remarks: tuple[str, ...]) -> SurgeFit:
    p = np.exp(-0.5 * (np.log(_GRID / TAU_MEDIAN) / TAU_SPREAD) ** 2)
    n = _GRID.size
    covariance = np.zeros((n, 2, 2))
    covariance[:, 0, 0] = LOSS_STD[0] ** 2
    loss = np.tile([LOSS_MEAN[0], 0.0], (n, 1))
    return SurgeFit(_GRID, p / p.sum(), loss, covariance, by_rudder=False, error_m_s=float("nan"), remarks=remarks)
