"""The confirmation: a candidate refitted with everything else, and what that is worth in runs that did not fit it."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.forward_selection import added
from kempf.pipeline.diagnose.screening.screen import Candidate
from kempf.pipeline.diagnose.screening.unsure_instants import WithInstants, with_instants, within_rows
from kempf.pipeline.estimate import sensitivity
from kempf.pipeline.estimate.iteration import SILENT, Listener
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.pipeline.estimate.record.grid_run import GridRun
from kempf.pipeline.estimate.sensitivity import Point
from kempf.pipeline.predict.free_run import predictive
from kempf.schemas.effect import Effect
from kempf.schemas.model_spec import N_HULL

#: what a candidate must save in the Bayesian information criterion (Kass & Raftery 1995, JASA 90: strong evidence)
BIC_SAVING = 6.0
#: ship lengths by which an instrument can stand away from its place in the profile: from midships to an end, and some
ABOARD = 0.6


@dataclass(frozen=True, eq=False)
class Unseen:
    """How well a model predicts runs that its parameters did not see."""

    #: Shape (runs,). Log-likelihood of each fitted run under what the others say, to first order.
    folds: Float
    #: Shape (held,). Log-likelihood of the held-out runs.
    held: Float


def unseen(fit: PooledFit, held: Sequence[GridRun], workers: Executor) -> Unseen:
    """Return the log-likelihoods of runs that the parameters did not see.

    Parameters
    ----------
    held : sequence of GridRun
        Held out.
    """
    return Unseen(_left_out(fit, workers), np.array(list(workers.map(lambda run: predictive(fit, run), held))))


@dataclass(frozen=True, eq=False)
class Confirmation:
    """A model with one effect more, refitted."""

    fit: PooledFit
    #: Twice the log-likelihood gained.
    likelihood_ratio: float
    #: Negative where the effect is worth its parameters.
    bic_change: float
    #: Shape (runs,). Log-likelihood gained in each fitted run by parameters that did not see it, to first order; of a
    #: single run, which nothing else says anything of, 0.
    fold_gains: Float
    #: Shape (held,). The same in the held-out runs.
    held_out_gains: Float
    #: Whether a parameter of the effect ended at a bound, or an instrument would stand off the ship.
    at_bound: bool
    #: Whether the refit left nothing of the effect: each of its parameters ended at a lower bound of 0.
    absent: bool
    #: Of ``fit``.
    unseen: Unseen
    #: ``fit`` as it is stated.
    stated: WithInstants
    #: Whether it may be in the instants of the log alone, in rows that repeat values or behind coarse stamps.
    within_rows: bool = False
    #: Whether the refit was given up, for it could not come near what another one reached; its gains are then those of
    #: ``before``: none.
    outdone: bool = False

    @property
    def holds(self) -> bool:
        """Whether it stands every test: information criterion, most folds, held-out runs, a plausible value."""
        return self.fits and self.predicts

    @property
    def fits(self) -> bool:
        """Whether it is worth its parameters, with a plausible value, in the runs that it was fitted to."""
        return bool(
            self.bic_change < -BIC_SAVING
            and not (self.at_bound or self.absent or self.outdone or self.within_rows)
            and np.isfinite(self.fit.log_likelihood)
        )

    @property
    def predicts(self) -> bool:
        """Whether it gains in most runs that it was not fitted to, and in all of them together."""
        gains = self._gains()
        return bool(2 * np.sum(gains > 0.0) > gains.size and np.sum(gains) > 0.0)

    @property
    def gained_in(self) -> tuple[int, int]:
        """In how many runs that it was not fitted to it gains, and of how many."""
        gains = self._gains()
        return int(np.sum(gains > 0.0)), gains.size

    @property
    def gains_left_out(self) -> Float:
        """``fold_gains`` of runs that others say something of: empty where there is one alone."""
        return self.fold_gains if self.fold_gains.size > 1 else self.fold_gains[:0]

    def _gains(self) -> Float:
        result: Float = np.concatenate([self.gains_left_out, self.held_out_gains])
        return result


def unpredicted(confirmation: Confirmation) -> str:
    """Say in how few manoeuvres an effect gains that it was not fitted to."""
    better, every = confirmation.gained_in
    if not every:
        return "one manoeuvre alone does not confirm it"
    if 2 * better > every:
        worse = every - better
        return f"of {every} manoeuvres that it was not fitted to it predicts {better} better and {worse} worse by more"
    return f"it predicts only {better} of {every} manoeuvres better that it was not fitted to"


def confirm(
    base: PooledFit,
    before: Unseen,
    candidate: Candidate,
    held: Sequence[GridRun],
    workers: Executor,
    most_bic: float = np.inf,
    listener: Listener = SILENT,
    *,
    race: bool = True,
) -> Confirmation:
    """Refit a model with one effect more.

    Parameters
    ----------
    before : Unseen
        Of ``base``, the same for all its candidates.
    candidate : Candidate
        Of the screen beside ``base``.
    held : sequence of GridRun
        Held out.
    most_bic : float, optional
        The change of the information criterion without which it is of no use: another one did better.
    listener : Listener, optional
        Notified of every iteration.
    race : bool, optional
        See `kempf.pipeline.diagnose.screening.forward_selection.added`.
    """
    price = price_of(candidate.effect, base)
    wanted = base.log_likelihood + 0.5 * (price - most_bic)
    fit = added(base, candidate, workers, wanted, listener, race=race)
    ratio = 2.0 * (fit.log_likelihood - base.log_likelihood)
    last = slice(base.values.size, None)
    lowest, highest = (ended[last] for ended in fit.model.at_bounds(fit.values))
    nothing = lowest & (fit.model.low[last] == 0.0)
    outdone = not fit.converged and fit.log_likelihood < wanted
    after = before if outdone else unseen(fit, held, workers)
    usable = not outdone and bool(np.isfinite(fit.log_likelihood))
    stated = with_instants(fit, workers) if usable else WithInstants(fit, np.zeros_like(fit.covariance))
    return Confirmation(
        fit=fit,
        likelihood_ratio=ratio,
        bic_change=price - ratio,
        fold_gains=after.folds - before.folds,
        held_out_gains=after.held - before.held,
        at_bound=bool(np.any((lowest & ~nothing) | highest)) or _overboard(fit, candidate.effect),
        # what the refit gained is then a better hull's: it found another maximum
        absent=bool(np.all(nothing)),
        unseen=after,
        stated=stated,
        within_rows=within_rows(fit, candidate.effect, stated),
        outdone=outdone,
    )


def price_of(effect: Effect, fit: PooledFit) -> float:
    """Return what the information criterion asks for the parameters of an effect, in units of twice the likelihood."""
    return len(effect.parameters) * float(np.log(fit.count))


def _overboard(fit: PooledFit, effect: Effect) -> bool:
    """Return whether an instrument would stand off the ship: as far away no place in a profile is wrong."""
    sizes = zip(effect.parameters, fit.values[-len(effect.parameters) :], strict=True)
    most = ABOARD * fit.runs[0].run.ship.length_m
    return effect.group == "sensor" and any(p.unit == "m" and abs(size) > most for p, size in sizes)


def _left_out(fit: PooledFit, workers: Executor) -> Float:
    """Log-likelihood of each run under what the other runs say of the shared parameters, one step from the fit."""
    if len(fit.linearised) < 2:
        return np.zeros(len(fit.linearised))
    if not (np.isfinite(fit.log_likelihood) and all(line.index for line in fit.linearised)):
        # of a model that runs away there is nothing to step from
        return np.full(len(fit.linearised), -np.inf)
    shared = N_HULL + len(fit.model.names)
    informations, scores = [], []
    for line in fit.linearised:
        common = line.J[:, [k for k, i in enumerate(line.index) if i < shared]]
        own = line.J[:, [k for k, i in enumerate(line.index) if i >= shared]]
        q, _ = np.linalg.qr(own)
        common = common - q @ (q.T @ common)
        informations.append(common.T @ common)
        scores.append(common.T @ line.u)
    whole = np.sum(informations, axis=0)

    def log_likelihood_of(number: int) -> float:
        rest = whole - informations[number]
        scale = np.sqrt(np.maximum(np.diag(rest), 1e-300))
        step = np.linalg.lstsq(rest / np.outer(scale, scale), scores[number] / scale, rcond=1e-8)[0] / scale
        moved = np.concatenate([fit.hull, fit.values]) - step
        values = np.clip(moved[N_HULL:], fit.model.low, fit.model.high)
        point = Point(moved[:N_HULL], values, fit.levels[number])
        return sensitivity.passed(fit.runs[number], point).log_likelihood

    return np.array(list(workers.map(log_likelihood_of, range(len(fit.runs)))))
