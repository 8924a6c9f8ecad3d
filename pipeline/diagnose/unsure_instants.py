"""A fit whose instruments measured at instants that are not quite known: what it would be with them free.

The lateness that is taken from a velocity (`kempf.pipeline.channels.punctual`) is known to some hundredths of a second,
and so are the instants of values that a log repeats (`kempf.pipeline.channels.holds`). A fit believes them, and its
hull is off by what they are off, in every manoeuvre of the log to one side. Here they are parameters of each log, with
what is known of them as a normal distribution, and are found together with hull and effects by one step of Gauss and
Newton: hundredths of a second move a hull so little that it is linear in them.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.effect_responses import EffectTrial, responses
from kempf.pipeline.diagnose.nuisance import columns_of, orthonormal
from kempf.pipeline.estimate.agreement import agreement_of
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.search.block_arrow import inverse
from kempf.schemas.effect import Effect
from kempf.schemas.effects import get
from kempf.schemas.model_spec import HULL_PARAMETERS

#: the effect by which the instants of an instrument are late, by field of `InstantErrors`
_LATE: Mapping[str, str] = MappingProxyType(
    {
        "velocity_s": "gnss_latency",
        "heading_s": "heading_latency",
        "yaw_rate_s": "gyro_latency",
        "rudder_s": "dead_time",
    }
)
#: by how much they are tried, s
_STEP_S = 0.05
#: standard deviations of an instant that lies anywhere in a row: to the row's end, which is the most that it is moved,
#: and over the whole row, by which two instruments may be apart
_MOST, _APART = 3.0**0.5, 12.0**0.5


@dataclass(frozen=True, eq=False)
class WithInstants:
    """What unsure instants do to a fit."""

    #: With hull and effects as they are beside instants that are free; the very same where all are known.
    fit: PooledFit
    #: Shape (6 + p, 6 + p). What is not known of the instants adds to the covariance of the fit.
    covariance: Float

    def std(self, size: int) -> Float:
        """Return the standard errors of the last parameters, wider by what the runs disagree about, shape (size,)."""
        own = agreement_of(self.fit).widened ** 2 * np.diag(self.fit.covariance) + np.diag(self.covariance)
        with np.errstate(invalid="ignore"):
            std: Float = np.sqrt(own)[-size:]
        return std


def with_instants(fit: PooledFit, workers: Executor) -> WithInstants:
    """Return a fit with the instants of its instruments free, as far as they are not known.

    Parameters
    ----------
    fit : PooledFit
        At its maximum.
    workers : Executor
        Share the passes; nothing depends on it.
    """
    known = np.nan_to_num(fit.covariance)
    columns, std_s, foreign = _columns(fit, workers)
    if not std_s.size:
        return WithInstants(fit, np.zeros_like(known))
    shared = known.shape[0]
    across, own, score = np.zeros((shared, std_s.size)), np.diag(std_s**-2.0), np.zeros(std_s.size)
    first = 0
    for line in fit.linearised:
        late = columns[first : first + line.u.size]
        first += line.u.size
        common, levels = columns_of(line, shared)
        basis = orthonormal(levels)
        late = late - basis @ (basis.T @ late)
        across[[i for i in line.index if i < shared]] += common.T @ late
        own += late.T @ late
        score += foreign * (late.T @ line.u)
    late_covariance = inverse(own - across.T @ known @ across)
    late_s = np.clip(late_covariance @ score, -_MOST * std_s, _MOST * std_s)
    # at the maximum the scores of what is shared are zero
    moved = np.concatenate([fit.hull, fit.values]) - known @ across @ late_s
    hull, values = np.split(moved, [len(HULL_PARAMETERS)])
    added: Float = known @ across @ late_covariance @ across.T @ known
    return WithInstants(replace(fit, hull=hull, values=np.clip(values, fit.model.low, fit.model.high)), added)


def within_rows(fit: PooledFit, effect: Effect) -> bool:
    """Return whether the last effect of a fit is a latency no larger than what is not known of the instants."""
    of = next((field for field, name in _LATE.items() if name == effect.name), None)
    if of is None:
        return False
    std_s = max(getattr(one.run.instant_errors, of) for one in fit.runs)
    return bool(abs(fit.values[-1]) < _APART * std_s)


def _columns(fit: PooledFit, workers: Executor) -> tuple[Float, Float, Float]:
    """Return what a second of lateness does to the innovations, shape (N, m), and what it is off by, s, shape (m,).

    There is one for every instrument and log whose instants are not known. The last of shape (m,) is 0 where the model
    has the latency itself, which imitates it in full: at the maximum nothing is left of it to be found.
    """
    errors = {effect: [getattr(one.run.instant_errors, of) for one in fit.runs] for of, effect in _LATE.items()}
    unsure = {effect: std for effect, std in errors.items() if any(std)}
    has = [effect.name for effect in fit.model.effects]
    tried = [effect for effect in unsure if effect not in has]
    found = dict(zip(tried, responses(fit, [EffectTrial(get(one), (_STEP_S,)) for one in tried], workers), strict=True))
    day = np.repeat([one.run.day for one in fit.runs], [line.u.size for line in fit.linearised])
    columns, std_s, foreign = [], [], []
    for effect, std in unsure.items():
        column = _own(fit, has.index(effect)) if effect in has else found[effect]
        if column is None:
            continue
        of_day = {one.run.day: s for one, s in zip(fit.runs, std, strict=True)}
        for number in sorted(number for number, s in of_day.items() if s > 0.0):
            columns.append(np.where(day == number, column.ravel(), 0.0))
            std_s.append(of_day[number])
            foreign.append(float(effect not in has))
    return np.column_stack(columns) if columns else np.zeros((day.size, 0)), np.array(std_s), np.array(foreign)


def _own(fit: PooledFit, number: int) -> Float | None:
    """Return the column of the only parameter of one of the model's effects; None where it stands at a bound."""
    at = len(HULL_PARAMETERS) + sum(len(effect.parameters) for effect in fit.model.effects[:number])
    if any(at not in line.index for line in fit.linearised):
        return None
    return np.concatenate([line.J[:, line.index.index(at)] for line in fit.linearised])
