"""Parameters fitted to legs, brought to what the ship's own zigzags did closed loop.

A fit of legs weighs the few first ones of the manoeuvres as all others, and where something is lacking it may bend all
of them one way: then the overshoots are off together, by much more than the covariance has. So the parameters are
estimated once more: the fit of legs is what is known before, with a covariance so many times larger as the overshoots
ask for, and the overshoots of the fitted zigzags are what is measured, with an error that no parameters take away.
Both numbers by their marginal likelihood (MacKay 1992, "Bayesian interpolation", Neural Computation 4), the rest by
Gauss-Newton. The prediction is so fitted at the horizon that it is used for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.manoeuvre.draws import Identified
from kempf.pipeline.manoeuvre.own_zigzags import READ_DEG
from kempf.pipeline.manoeuvre.sailed import Manoeuvre
from kempf.pipeline.manoeuvre.ship import Ship

#: fewer overshoots bring nothing nearer
_FEWEST = 6
#: of the difference quotients, in standard errors
_STEP = 0.2
#: how many times wider the errors are, and what error of an overshoot is left, deg
_TIMES = np.exp(np.linspace(0.0, np.log(32.0), 21))
_LEFT_DEG = READ_DEG * np.exp(np.linspace(0.0, np.log(40.0), 21))
_ITERATIONS = 4


@dataclass(frozen=True, eq=False)
class OwnZigzag:
    """One zigzag of the ship."""

    #: The model on its day.
    model: Identified
    manoeuvre: Manoeuvre
    #: By figure of the manoeuvre.
    measured: dict[str, float]


def conditioned(model: Identified, zigzags: Sequence[OwnZigzag]) -> Identified:
    """Return a model brought to the overshoots of zigzags; the model itself where that brings it no nearer.

    Parameters
    ----------
    zigzags : sequence of OwnZigzag
        That the model was fitted to, never one that is to judge it.
    """
    before: Float = np.concatenate([model.hull, model.effects])
    measured = np.array([value for zigzag in zigzags for value in zigzag.measured.values()])
    if measured.size < _FEWEST:
        return model
    start, H = _sailed(zigzags, before), _slopes(zigzags, before, model.covariance)
    good = np.isfinite(measured - start) & np.isfinite(H).all(axis=1)
    if np.count_nonzero(good) < _FEWEST:
        return model
    times, left = _levels((measured - start)[good], H[good], model.covariance)
    prior: Float = times**2 * model.covariance
    theta: Float = before
    spread: Float = prior
    for _ in range(_ITERATIONS):
        off = measured - _sailed(zigzags, theta)
        H = _slopes(zigzags, theta, model.covariance)
        used = np.isfinite(off) & np.isfinite(H).all(axis=1)
        gain, spread = _gain(H[used], prior, left)
        theta = _within(model, before + gain @ (off[used] + H[used] @ (theta - before)))
    there = measured - _sailed(zigzags, theta)
    # where she ceases to be a ship, or is no nearer, the legs have the last word
    if not np.all(np.isfinite(there[good])) or np.sum(there[good] ** 2) >= np.sum((measured - start)[good] ** 2):
        return model
    return replace(model, hull=theta[:6], effects=theta[6:], covariance=spread, conditioned=True)


def _within(model: Identified, theta: Float) -> Float:
    low, high = model.waters.model.low, model.waters.model.high
    return np.concatenate([theta[:6], np.clip(theta[6:], low, high)])


def _gain(H: Float, prior: Float, left: float) -> tuple[Float, Float]:
    """Return how errors of overshoots move the parameters, and their covariance then."""
    whole = H @ prior @ H.T + left**2 * np.eye(len(H))
    gain: Float = np.asarray(np.linalg.solve(whole, H @ prior).T, dtype=np.float64)
    spread: Float = prior - gain @ H @ prior
    return gain, 0.5 * (spread + spread.T)


def _levels(off: Float, H: Float, covariance: Float) -> tuple[float, float]:
    """Return how many times wider the errors are and what is left of an overshoot, most likely."""
    best, levels = -np.inf, (1.0, READ_DEG)
    for times in _TIMES:
        for left in _LEFT_DEG:
            whole = times**2 * H @ covariance @ H.T + left**2 * np.eye(off.size)
            score = -np.linalg.slogdet(whole)[1] - off @ np.linalg.solve(whole, off)
            if score > best:
                best, levels = score, (float(times), float(left))
    return levels


def _sailed(zigzags: Sequence[OwnZigzag], theta: Float) -> Float:
    """Return the overshoots of ships with these parameters, NaN where one runs away."""
    overshoots: list[float] = []
    for zigzag in zigzags:
        own = zigzag.model
        ship = Ship(own.waters, theta[:6], _within(own, theta)[6:], own.surge_here.best, own.rudder_rate.rad_s)
        sailed = zigzag.manoeuvre.sailed(ship)
        overshoots += [np.nan if sailed is None else sailed.figures[name] for name in zigzag.measured]
    return np.array(overshoots)


def _slopes(zigzags: Sequence[OwnZigzag], theta: Float, covariance: Float) -> Float:
    """Return the derivatives of the overshoots by the parameters, shape (n, 6 + p)."""
    steps = _STEP * np.sqrt(np.diag(covariance))
    base, H = _sailed(zigzags, theta), np.zeros((sum(len(zigzag.measured) for zigzag in zigzags), theta.size))
    for k in np.flatnonzero(steps > 0.0):
        moved = theta.copy()
        moved[k] += steps[k]
        H[:, k] = (_sailed(zigzags, moved) - base) / steps[k]
    return H
