"""The speed of a ship in a turn, identified from what her log showed in the manoeuvres.

    dV/dt = (V_0 (1 - loss) - V) V_s / (tau L),
    loss = -k_vr L v r / V_s^2 + k_r (L r / V_s)^2 + k_d delta^2 (V / V_s)^p + k_w W / V_s^2

V_s is the speed that the shaft keeps on a straight course, V_0 that of one manoeuvre, tau the time in ship lengths in
which she finds it; the rest is what turn and rudder cost of it in the long run, without a dimension. Thrust falls and
resistance rises with the speed, so that their difference is close to a straight line down to half of it. A ship that
drifts while she turns loses by the momentum of her sideways motion, (m + m_y) v r / (m + m_x), and regains some of it
by X_vr: k_vr / tau is 1 to 1.6 (Yasukawa & Yoshimura 2015, "Introduction of MMG standard method for ship maneuvering
predictions", J. Mar. Sci. Technol. 20; Norrbin 1971, "Theory and observations on the use of a mathematical model for
ship manoeuvring in deep and confined waters", SSPA publication 68). Beside drift the yaw rate squared has either sign:
a centre of gravity before midships pushes her on in a turn, m x_G r^2, and what the hull's longitudinal force has of
it, X_rr, does the one or the other. Where no lateral speed was measured, or where the log shows it better, the loss
goes by the yaw rate alone, as drift goes with turn.

The rudder's drag goes with its force, and so with the power p of the speed that the model has it go by.

W is the wind over the deck, its speed times its part from ahead, less what her own way makes of it in calm air: a head
wind costs speed and a following one gives some. k_w / tau is the air's density times the drag area, over twice the
mass per length: about 0.001 (Isherwood 1972, "Wind resistance of merchant ships", Trans. RINA 115), which for a small
model in a breeze is a tenth of her speed.

Whether it takes her a way or a time to find her speed shows where the shaft turned at several speeds: by a resistance
that goes with the speed squared it is tau lengths at any, by an engine or a resistance of another kind it may be the
same seconds at every. Both are forms, the second as tau lengths at the mean V_s; logs of one shaft speed have the first
alone.

For a given tau and one of the forms all else enters linearly. So tau is gone through on a grid, and at each value the
rest is a linear regression with priors: the posterior is exact but for the grid, and needs no start. Which of the terms
there are beside the one by turning is left to their evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.linalg import inv, lstsq, slogdet
from numpy.typing import NDArray
from scipy.signal import lfilter

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.schemas.symbols import CHANNEL_SYMBOLS

#: of tau: ships come back to their speed in some lengths to some dozens of them; median, and its logarithm's spread
TAU_MEDIAN, TAU_SPREAD = 8.0, 0.7
#: the kinds of loss: by drift and turn, by the turn, by the rudder, by the wind
BY_DRIFT, BY_RATE, BY_RUDDER, BY_WIND = KINDS = range(4)
#: of k_vr / tau, of k_r where turn alone counts, of k_d and of k_w / tau: with (L r / V)^2 of 0.1 to 0.2 in a hard turn
#: a loss of 20 to 60 %; 0.4 rad of rudder cost some percent
LOSS_MEAN, LOSS_STD = np.array([1.3, 2.0, 0.3, 0.001]), np.array([0.6, 2.0, 0.3, 0.001])
#: of k_r / tau beside drift, of either sign: x_G m and X_rr of usual ships come to -0.15 to 0.05
BESIDE_MEAN, BESIDE_STD = -0.05, 0.2
#: of V_0 about V_s: of a run that begins settled, and of one that gathers way; from where on it is the latter
_SETTLED_STD, _UNSETTLED_STD, _UNSETTLED = 0.03, 0.15, 0.1
_GRID = np.exp(np.linspace(np.log(1.0), np.log(64.0), 121))
#: no log is better than this share of the speed
_LEAST_ERROR = 0.0005
#: a posterior wider than this share of the prior comes from the prior
_FROM_PRIOR = 0.7
_LAGS = 400
#: the shaft kept the same speed where no more than this share lies between the largest and the smallest
_SAME_SPEED = 0.02


@dataclass(frozen=True, eq=False)
class SurgeFit:
    """What the logs say of the speed in turns, as a mixture over tau and the forms of the loss."""

    #: Shape (g,). tau, in ship lengths, and its probabilities.
    tau: Float
    probability: Float
    #: loss, covariance: Shape (g, 4) and (g, 4, 4). k_vr, k_r, k_d and k_w of every part; 0 where one is left out.
    loss: Float
    covariance: Float
    #: V_0 / V_s, mean and standard deviation over the manoeuvres.
    settled: tuple[float, float]
    #: Root mean square of what is left of the logged speed, m/s.
    error_m_s: float
    #: What a user should know of it, sentences.
    remarks: tuple[str, ...]
    #: Shape (g,), or (0,) where no part is so. Parts whose tau is a time, in the lengths of `reference_m_s`.
    by_time: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    #: Mean V_s of the manoeuvres, m/s.
    reference_m_s: float = float("nan")

    def at(self, settled_m_s: float) -> SurgeFit:
        """Return the fit for a shaft that keeps a speed, m/s: a time is so many more lengths as she is faster."""
        if not np.any(self.by_time):
            return self
        tau = np.where(self.by_time, self.tau * settled_m_s / self.reference_m_s, self.tau)
        return replace(self, tau=tau, by_time=np.zeros_like(self.by_time), reference_m_s=settled_m_s)

    @property
    def best(self) -> Float:
        """The most probable tau with its k_vr, k_r, k_d and k_w, shape (5,)."""
        k = int(np.argmax(self.probability))
        return np.array([self.tau[k], *_costing(self.loss[k])])

    @property
    def std(self) -> Float:
        """Standard deviations of tau, k_vr, k_r, k_d and k_w, shape (5,)."""
        p = self.probability
        means = [p @ self.tau, *(p @ self.loss)]
        spread = p @ (self.tau - means[0]) ** 2
        within = np.einsum("g,gii->i", p, self.covariance) + p @ (self.loss - np.array(means[1:])) ** 2
        return np.sqrt([spread, *within])

    @property
    def sure(self) -> SurgeFit:
        """The most probable part alone, without errors."""
        k = int(np.argmax(self.probability))
        part = slice(k, k + 1)
        none = np.zeros_like(self.covariance[part])
        by_time = self.by_time[part]
        certain = np.ones(1)
        return replace(
            self, tau=self.tau[part], probability=certain, loss=self.loss[part], covariance=none, by_time=by_time
        )

    def drawn(self, normal: Float) -> Float:
        """Return tau, k_vr, k_r, k_d and k_w of draws, shape (n, 5), from standard normal numbers, shape (n, 5)."""
        from scipy.stats import norm

        part = np.searchsorted(np.cumsum(self.probability), norm.cdf(normal[:, 0]) * (1.0 - 1e-12))
        found = np.empty((len(normal), 5))
        roots: dict[int, tuple[list[int], Float]] = {}
        for i, (k, z) in enumerate(zip(np.minimum(part, self.tau.size - 1).tolist(), normal[:, 1:], strict=True)):
            if k not in roots:
                roots[k] = self._root(k)
            kinds, root = roots[k]
            loss = self.loss[k].copy()
            loss[kinds] += root @ z[: len(kinds)]
            found[i] = [self.tau[k], *_costing(loss)]
        return found

    def _root(self, k: int) -> tuple[list[int], Float]:
        """Return the kinds of loss of a part and the square root of their covariance."""
        C = self.covariance[k]
        kinds = [kind for kind in KINDS if C[kind, kind] > 0.0]
        return kinds, np.linalg.cholesky(C[np.ix_(kinds, kinds)]) if kinds else np.zeros((0, 0))


def _costing(loss: Float) -> Float:
    """Return losses that cost speed; beside drift the yaw rate squared may give some."""
    found: Float = np.maximum(loss, 0.0)
    if found[BY_DRIFT] > 0.0:
        found[BY_RATE] = loss[BY_RATE]
    return found


def surge_of(runs: Sequence[GridRun], length_m: float, rudder_speed_exponent: float = 2.0) -> SurgeFit:
    """Identify the speed's equation from the manoeuvres of a ship.

    Parameters
    ----------
    runs : sequence of GridRun
        With the speed through the water that the log showed, or over ground where there is none.
    length_m : float
        Of the ship.
    rudder_speed_exponent : float, optional
        Power of the speed in the rudder's force.
    """
    logs = [log for log in (_Log.of(run, length_m, rudder_speed_exponent) for run in runs) if log is not None]
    if not logs:
        return _prior(("the speed in turns is a guess: no log shows it",))
    made = _posterior(logs, _forms(logs))
    best = int(np.argmax(made.probability))
    own = BY_DRIFT if made.loss[best, BY_DRIFT] != 0.0 else BY_RATE
    unit = made.tau[best] if own == BY_DRIFT else 1.0
    if np.sqrt(made.covariance[best, own, own]) > _FROM_PRIOR * LOSS_STD[own] * unit:
        words = "k_vr / tau of" if own == BY_DRIFT else "k_r of"
        remark = (
            "the logs hardly show what a turn costs of her speed: the loss is that of usual ships, "
            f"{words} {LOSS_MEAN[own]:g} ± {LOSS_STD[own]:g}"
        )
        return replace(made, remarks=(remark,))
    return made


def _forms(logs: Sequence[_Log]) -> list[tuple[int, ...]]:
    """Return the kinds of loss that may act together, as far as all logs have what they go by."""
    turning: list[tuple[int, ...]] = [(BY_RATE,)]
    if all(np.isfinite(log.costs[:, BY_DRIFT]).all() for log in logs):
        turning = [(BY_DRIFT,), (BY_DRIFT, BY_RATE), *turning]
    forms = [kinds for one in turning for kinds in (one, (*one, BY_RUDDER))]
    if all(np.isfinite(log.costs[:, BY_WIND]).all() for log in logs):
        forms += [(*kinds, BY_WIND) for kinds in forms]
    return forms


def settled_speed(run: GridRun) -> float:
    """Return the speed that the shaft of a run keeps on a straight course, m/s; that of the approach where unknown."""
    if "shaft_speed" not in run.channels or not run.approach_per_s > 0.0:
        return run.approach_m_s
    return run.approach_m_s * float(np.mean(_shaft(run))) / run.approach_per_s


def _shaft(run: GridRun) -> Float:
    return _channel(run, "shaft_speed")


def _head_wind(run: GridRun) -> Float:
    """Return W at the instants, m^2/s^2; NaN where no wind is logged."""
    if not {"wind_speed", "wind_angle"} <= set(run.channels):
        return np.full(run.speed_m_s.size, np.nan)
    over_deck = _channel(run, "wind_speed")
    found: Float = over_deck**2 * np.cos(_channel(run, "wind_angle")) - run.speed_m_s**2
    return found


def _channel(run: GridRun, name: str) -> Float:
    column = 2 + list(CHANNEL_SYMBOLS.values()).index(name)
    found: Float = run.inputs[:: (run.inputs.shape[0] - 1) // (run.speed_m_s.size - 1), column]
    return found


@dataclass(frozen=True, eq=False)
class _Log:
    """One run: time step, speed, what the shaft does, and what costs speed, all over the speed that the shaft keeps."""

    step: float
    speed: Float
    shaft: Float
    #: Shape (n, 4). By kind of loss; NaN where it is not known.
    costs: Float
    settled_m_s: float
    #: Prior standard deviation of V_0 / V_s.
    settled_std: float

    @classmethod
    def of(cls, run: GridRun, length_m: float, exponent: float) -> _Log | None:
        speed, settled = run.speed_m_s, settled_speed(run)
        rate = _yaw_rate(run, length_m)
        if rate is None or not settled > 0.0 or not np.all(np.isfinite(speed)) or speed.size < 20:
            return None
        shaft = np.ones(speed.size)
        if "shaft_speed" in run.channels and run.approach_per_s > 0.0:
            shaft = _shaft(run)
            shaft = shaft / np.mean(shaft)
        lateral, unit = _lateral(run, length_m), length_m / settled
        drift = np.full(speed.size, np.nan) if lateral is None else -lateral * rate * unit / settled
        rudder = run.rudder_rad**2 * np.maximum(speed / settled, 0.0) ** exponent
        costs = np.column_stack([drift, (unit * rate) ** 2, rudder, _head_wind(run) / settled**2])
        gathers_way = abs(speed[0] / settled - 1.0) > _UNSETTLED
        std = _UNSETTLED_STD if gathers_way else _SETTLED_STD
        return cls(run.step_s * settled / length_m, speed / settled, shaft, costs, settled, std)

    def columns(self, tau: float, reference_m_s: float | None = None) -> tuple[Float, Float]:
        """Return the columns of V_0, of the first speed and of all losses, each through the lag of tau.

        It is in lengths at the speed of this log, or of ``reference_m_s``.
        """
        step = self.step if reference_m_s is None else self.step * reference_m_s / self.settled_m_s
        kept = np.exp(-step / tau)

        def lagged(course: Float) -> Float:
            mean = 0.5 * (course[1:] + course[:-1])
            found: Float = np.concatenate([[0.0], lfilter([1.0 - kept], [1.0, -kept], mean)])
            return found

        own = np.column_stack([lagged(self.shaft), kept ** np.arange(self.speed.size)])
        lost = np.column_stack([-lagged(self.costs[:, j]) for j in KINDS])
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
    return _smooth(run, laid, length_m)


def _lateral(run: GridRun, length_m: float) -> Float | None:
    """Return the lateral speed at the instants, m/s, counted from that of the approach; None where not measured."""
    known = np.isfinite(run.measured[:, 0])
    if known.mean() < 0.3:
        return None
    smooth = _smooth(run, np.interp(run.time_s, run.time_s[known], run.measured[known, 0]), length_m)
    # what a stream or a wind gives her before she turns costs nothing
    first = max(1, round(0.5 * length_m / max(run.approach_m_s, 0.05) / run.step_s))
    return smooth - float(np.median(smooth[:first]))


def _smooth(run: GridRun, laid: Float, length_m: float) -> Float:
    """Return a course without its noise: a ship's motion does not change within a quarter of her length."""
    width = max(1, round(0.25 * length_m / max(run.approach_m_s, 0.05) / run.step_s))
    padded = np.pad(laid, (width // 2, width - 1 - width // 2), mode="edge")
    smooth: Float = np.convolve(padded, np.ones(width) / width, mode="valid")
    return smooth


Columns = list[tuple[Float, Float]]


def _posterior(logs: Sequence[_Log], forms: Sequence[tuple[int, ...]]) -> SurgeFit:
    """Return the posterior over all forms of the loss and all tau; errors that remember count as fewer."""
    settled = [log.settled_m_s for log in logs]
    mean = float(np.mean(settled))
    references = (None, mean) if max(settled) > (1.0 + _SAME_SPEED) * min(settled) else (None,)
    grid = [(reference, tau) for reference in references for tau in _GRID]
    columns = [[log.columns(tau, reference) for log in logs] for reference, tau in grid]
    freed = [_freed(logs, own) for own in columns]
    # where the logs alone are best, their errors are smallest: so large they are
    every = [_left(own, kinds) for kinds in forms for own in freed]
    left = min(every, key=lambda parts: sum(float(e @ e) for e in parts))
    count = sum(e.size for e in left)
    error = max(float(np.sqrt(sum(float(e @ e) for e in left) / count)), _LEAST_ERROR)
    variance = error**2 * _memory(left)
    reduced = [[_Reduced.of(log, one, variance) for log, one in zip(logs, own, strict=True)] for own in columns]
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
    kept = np.array(parts[int(np.argmax(p))][3].settled)
    by_time = np.array([part[0] is not None for part in parts])
    return SurgeFit(
        *(tau, p, loss, covariance, (float(np.mean(kept)), float(np.std(kept))), error * mean, ()),
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
    def of(cls, log: _Log, columns: tuple[Float, Float], variance: float) -> _Reduced:
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


def _freed(logs: Sequence[_Log], columns: Columns) -> Columns:
    """Return speed and losses of every log at one tau without what V_0 and the first speed explain.

    So the losses alone are to be solved for (Frisch & Waugh 1933).
    """
    found = []
    for log, (own, lost) in zip(logs, columns, strict=True):
        base = np.linalg.qr(own)[0]
        found.append((log.speed - base @ (base.T @ log.speed), lost - base @ (base.T @ lost)))
    return found


def _left(freed: Columns, kinds: Sequence[int]) -> list[Float]:
    """Return what the model leaves of every log's speed, without priors; see `_freed`."""
    chosen = [(speed, lost[:, list(kinds)]) for speed, lost in freed]
    whole, right = np.vstack([lost for _, lost in chosen]), np.concatenate([speed for speed, _ in chosen])
    found = lstsq(whole, right, rcond=1e-10)[0]
    return [speed - lost @ found for speed, lost in chosen]


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
    loss, covariance = np.zeros((n, 4)), np.zeros((n, 4, 4))
    loss[:, BY_RATE], covariance[:, BY_RATE, BY_RATE] = LOSS_MEAN[BY_RATE], LOSS_STD[BY_RATE] ** 2
    return SurgeFit(_GRID, p / p.sum(), loss, covariance, (1.0, _SETTLED_STD), float("nan"), remarks)
