"""The speed's equation of a ship from her manoeuvres; that of usual ships where her logs do not show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.manoeuvre.surge.logged_speed import LoggedSpeed
from kempf.pipeline.manoeuvre.surge.posterior import posterior_of
from kempf.pipeline.manoeuvre.surge.surge_fit import SurgeFit
from kempf.pipeline.manoeuvre.surge.usual import (
    BY_DRIFT,
    BY_RATE,
    BY_RUDDER,
    BY_WIND,
    LOSS_MEAN,
    LOSS_STD,
    SETTLED_STD,
    TAU,
    TAU_MEDIAN,
    TAU_SPREAD,
)

#: a posterior wider than this share of the prior comes from the prior
_FROM_PRIOR = 0.7


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
    logs = [log for log in (LoggedSpeed.of(run, length_m, rudder_speed_exponent) for run in runs) if log is not None]
    if not logs:
        return _of_usual_ships(("the speed in turns is a guess: no log shows it",))
    fit = posterior_of(logs, _forms(logs))
    best = int(np.argmax(fit.probability))
    own = BY_DRIFT if fit.loss[best, BY_DRIFT] != 0.0 else BY_RATE
    unit = fit.tau[best] if own == BY_DRIFT else 1.0
    if np.sqrt(fit.covariance[best, own, own]) > _FROM_PRIOR * LOSS_STD[own] * unit:
        words = "k_vr / tau of" if own == BY_DRIFT else "k_r of"
        remark = (
            "the logs hardly show what a turn costs of her speed: the loss is that of usual ships, "
            f"{words} {LOSS_MEAN[own]:g} ± {LOSS_STD[own]:g}"
        )
        return replace(fit, remarks=(remark,))
    return fit


def _forms(logs: Sequence[LoggedSpeed]) -> list[tuple[int, ...]]:
    """Return the kinds of loss that may act together, as far as all logs have what they go by."""
    turning: list[tuple[int, ...]] = [(BY_RATE,)]
    if all(np.isfinite(log.costs[:, BY_DRIFT]).all() for log in logs):
        turning = [(BY_DRIFT,), (BY_DRIFT, BY_RATE), *turning]
    forms = [kinds for form in turning for kinds in (form, (*form, BY_RUDDER))]
    if all(np.isfinite(log.costs[:, BY_WIND]).all() for log in logs):
        forms += [(*kinds, BY_WIND) for kinds in forms]
    return forms


def _of_usual_ships(remarks: tuple[str, ...]) -> SurgeFit:
    p = np.exp(-0.5 * (np.log(TAU / TAU_MEDIAN) / TAU_SPREAD) ** 2)
    n = TAU.size
    loss, covariance = np.zeros((n, 4)), np.zeros((n, 4, 4))
    loss[:, BY_RATE], covariance[:, BY_RATE, BY_RATE] = LOSS_MEAN[BY_RATE], LOSS_STD[BY_RATE] ** 2
    return SurgeFit(TAU, p / p.sum(), loss, covariance, (1.0, SETTLED_STD), float("nan"), remarks)
