"""Ships of the simulator as the identified model takes them, and a covariance like that of one zigzag."""

from __future__ import annotations

from dataclasses import astuple

import numpy as np

from kempf.pipeline.model.ship import Hull
from kempf.pipeline.simulate.hulls import HULLS

#: about the standard errors of a 20-minute 20/20 zigzag, relative, and a correlation between sway and yaw
RELATIVE = np.array([0.03, 0.035, 0.02, 0.015, 0.03, 0.01])


def hull_of(name: str) -> Hull:
    return Hull(*astuple(HULLS[name].parameters))


def covariance_of(hull: Hull, relative: np.ndarray = RELATIVE) -> np.ndarray:
    std = relative * np.abs(hull.array())
    correlation = np.eye(6) + 0.5 * (np.ones((6, 6)) - np.eye(6))
    return correlation * np.outer(std, std)


def draws_of(hull: Hull, covariance: np.ndarray, n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).multivariate_normal(hull.array(), covariance, n, method="cholesky")
