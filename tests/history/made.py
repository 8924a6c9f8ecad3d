"""Histories made up with known truth: parameters of the mariner, covariances like those of identified zigzags."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.history.sets import ParameterHistory
from kempf.schemas.model_spec import HULL_PARAMETERS

NAMES, UNITS = tuple(HULL_PARAMETERS), tuple(HULL_PARAMETERS.values())
TRUTH = np.array([-0.00479, -0.335, -0.000131, -0.013, -0.00106, 6.28e-05])
DAY_NS = 86_400_000_000_000
START_NS = 1_600_000_000_000_000_000
#: Relative standard errors and correlations of a simulated and identified 20/20 zigzag of 20 min.
STD = np.array([0.0237, 0.0323, 0.0131, 0.0086, 0.0339, 0.0024])
CORRELATION = np.array(
    [
        [1.0, 0.9769, -0.49934, -0.46723, -0.93183, 0.24758],
        [0.9769, 1.0, -0.63916, -0.59205, -0.97163, 0.20649],
        [-0.49934, -0.63916, 1.0, 0.98328, 0.7223, 0.39571],
        [-0.46723, -0.59205, 0.98328, 1.0, 0.69901, 0.48172],
        [-0.93183, -0.97163, 0.7223, 0.69901, 1.0, -0.12831],
        [0.24758, 0.20649, 0.39571, 0.48172, -0.12831, 1.0],
    ]
)


def relative_covariance(size: float = 1.0) -> np.ndarray:
    """The covariance relative to the truth, standard errors times a factor, shape (6, 6)."""
    return size**2 * CORRELATION * np.outer(STD, STD)


def history(
    n: int = 20,
    *,
    shift: np.ndarray | None = None,
    scatter: float = 0.01,
    worse: float = 1.0,
    apart_days: float = 30.0,
    seed: int = 0,
) -> ParameterHistory:
    """n sets; ``shift`` of shape (n, 6) is relative, ``worse`` a factor that the covariances do not tell."""
    random = np.random.default_rng(seed)
    S = np.array([relative_covariance(random.uniform(0.7, 1.6)) for _ in range(n)]).reshape(n, 6, 6)
    e = worse * np.einsum("iab,ib->ia", np.linalg.cholesky(S), random.standard_normal((n, 6)))
    e += scatter * random.standard_normal((n, 6))
    value = TRUTH * (1.0 + e + (0.0 if shift is None else shift))
    time = START_NS + (np.arange(n) * apart_days * DAY_NS).astype(np.int64)
    return ParameterHistory(NAMES, UNITS, time, value, S * np.outer(TRUTH, TRUTH))


def step(n: int, k: int, **relative: float) -> np.ndarray:
    """A step after k sets, shape (n, 6)."""
    size = np.array([relative.get(name, 0.0) for name in NAMES])
    return np.outer(np.arange(n) >= k, size)
