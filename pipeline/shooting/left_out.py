"""How a model predicts each manoeuvre when it was not fitted to it."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.shooting.shooting_fit import ShootingFit, alone, misfit


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Errors of manoeuvres under parameters that did not see them."""

    #: Shape (runs,). Mean square error in units of the scales, channels summed; infinite where it diverges.
    misfits: Float
    #: One a manoeuvre, shape (w, 3). The same by window and channel.
    errors: tuple[Float, ...]

    @property
    def mean(self) -> float:
        """Mean over the manoeuvres."""
        return float(np.mean(self.misfits))


def left_out(fit: ShootingFit, workers: Executor) -> LeftOut:
    """Leave each manoeuvre out in turn, the parameters one step of Gauss-Newton from those of all.

    A manoeuvre that is left out still has its own constants fitted, and the states at the beginnings of its windows.
    """
    model = fit.shots[0].model
    low = np.concatenate([np.full(6, -np.inf), model.low])
    high = np.concatenate([np.full(6, np.inf), model.high])
    whole = fit.information

    def one(number: int) -> tuple[float, Float]:
        part = fit.parts[number]
        rest = whole - part.information
        scale = np.sqrt(np.maximum(np.diag(rest), 1e-300))
        # at the optimum of all, the others' gradient is the negative of the one left out
        step = np.linalg.lstsq(rest / np.outer(scale, scale), part.gradient / scale, rcond=1e-12)[0] / scale
        shared = np.clip(fit.shared + step, low, high)
        own_misfit, _, errors = alone(fit.shots[number], shared, fit.scales, part.stepped(shared - fit.shared, 0.0))
        return own_misfit, errors

    if len(fit.parts) < 2:
        return LeftOut(np.array([misfit(part.errors) for part in fit.parts]), tuple(p.errors for p in fit.parts))
    results = list(workers.map(one, range(len(fit.parts))))
    return LeftOut(np.array([m for m, _ in results]), tuple(e for _, e in results))
