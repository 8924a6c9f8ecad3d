"""What is known of the speed in turns: a mixture over the time constant and the forms of the loss."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.distributions import normal_up_to
from kempf.pipeline.manoeuvre.surge.usual import BY_DRIFT, BY_RATE, KINDS


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
        part = np.searchsorted(np.cumsum(self.probability), normal_up_to(normal[:, 0]) * (1.0 - 1e-12))
        draws = np.empty((len(normal), 5))
        roots: dict[int, tuple[list[int], Float]] = {}
        for i, (k, z) in enumerate(zip(np.minimum(part, self.tau.size - 1).tolist(), normal[:, 1:], strict=True)):
            if k not in roots:
                roots[k] = self._root(k)
            kinds, root = roots[k]
            loss = self.loss[k].copy()
            loss[kinds] += root @ z[: len(kinds)]
            draws[i] = [self.tau[k], *_costing(loss)]
        return draws

    def _root(self, k: int) -> tuple[list[int], Float]:
        """Return the kinds of loss of a part and the square root of their covariance."""
        C = self.covariance[k]
        kinds = [kind for kind in KINDS if C[kind, kind] > 0.0]
        return kinds, np.linalg.cholesky(C[np.ix_(kinds, kinds)]) if kinds else np.zeros((0, 0))


def _costing(loss: Float) -> Float:
    """Return losses that cost speed; beside drift the yaw rate squared may give some."""
    costs: Float = np.maximum(loss, 0.0)
    if costs[BY_DRIFT] > 0.0:
        costs[BY_RATE] = loss[BY_RATE]
    return costs
