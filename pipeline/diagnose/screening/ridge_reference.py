"""The flexible reference: how much a smooth force of everything could still explain, in runs that did not fit it.

Some seventy terms in v, r, delta, heading and speed, shrunk together, fitted to the whitened innovations of all runs
but one and tried on that one (Geisser 1975, JASA 70; ridge regression: Hoerl & Kennard 1970, Technometrics 12). It
names nothing. It says whether something that repeats itself is left, whatever its name.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.effect_responses import EffectTrial, responses
from kempf.pipeline.diagnose.screening.formula_search import Term, search
from kempf.pipeline.diagnose.screening.nuisance import Nuisance, nuisance
from kempf.pipeline.diagnose.screening.speed_noise import speed_noise
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.schemas.effect import Effect, Parameter
from kempf.schemas.model_spec import N_HULL

_BOTH = {
    "1": "V**2/L",
    "v|v|": "v*abs(v)/L",
    "r|r|": "r*abs(r)*L",
    "|v|r": "abs(v)*r",
    "v|r|": "v*abs(r)",
    "v^3": "v**3/(L*max(V,0.1))",
    "v^2 r": "v**2*r/max(V,0.1)",
    "v r^2": "v*r**2*L/max(V,0.1)",
    "r^3": "r**3*L**2/max(V,0.1)",
    "v^2": "v**2/L",
    "r^2": "r**2*L",
    "v r": "v*r",
    "delta^2": "delta**2*V**2/L",
    "delta^3": "delta**3*V**2/L",
    "delta|delta|": "delta*abs(delta)*V**2/L",
    "v delta": "v*delta*V/L",
    "r delta": "r*delta*V",
    "v^2 delta": "v**2*delta/L",
    "r^2 delta": "r**2*delta*L",
    "v delta^2": "v*delta**2*V/L",
    "sign r": "tanh(30*r*L/max(V,0.1))*V**2/L",
    "sign delta": "tanh(30*delta)*V**2/L",
    "sin K": "sin(K)*V**2/L",
    "cos K": "cos(K)*V**2/L",
    "sin 2K": "sin(2*K)*V**2/L",
    "cos 2K": "cos(2*K)*V**2/L",
    "sin 3K": "sin(3*K)*V**2/L",
    "cos 3K": "cos(3*K)*V**2/L",
    "sin 4K": "sin(4*K)*V**2/L",
    "cos 4K": "cos(4*K)*V**2/L",
    "speed v": "v*(V-V0)/L",
    "speed r": "r*(V-V0)",
    "speed delta": "delta*V*(V-V0)/L",
    "late delta": "delta*V**2/L*t/600",
}
_SIZE = 1e-2
_SHRINKAGE = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0)


def _term(target: str, name: str, text: str) -> Effect:
    scale = "*c" if target == "sway" else "*c/L"
    parameter = Parameter(name="c", unit="1", low=-1e3, high=1e3, steps=(_SIZE,), meaning="size")
    words = f"{name} in {target}"
    terms = {target: f"({text}){scale}"}
    return Effect(name=f"{target} {name}", plain=words, reference=words, parameters=(parameter,), terms=terms)


TERMS: tuple[Effect, ...] = tuple(_term(t, n, text) for t in ("sway", "yaw") for n, text in _BOTH.items())


@dataclass(frozen=True, eq=False)
class RidgeReference:
    """What the flexible reference finds beside a fitted model."""

    #: Log-likelihood that it adds in runs that did not fit it, summed over them; negative where nothing repeats.
    gain: float
    #: Shape (runs,).
    gains: Float
    #: Of those tried, the one that gains most.
    shrinkage: float
    #: The few terms that explain most of it; exploratory.
    formula: tuple[Term, ...]
    #: Shape (N, len(TERMS)). What the terms do to the whitened innovations, of unit size, without what the fitted
    #: parameters imitate.
    columns: Float
    #: The rows of each run.
    parts: tuple[slice, ...]

    def foreseen(self, signal: Float) -> float:
        """Return what the reference would gain of a signal by itself, were there no noise.

        Parameters
        ----------
        signal : ndarray, shape (N,)
            What something does to the whitened innovations, as
            `kempf.pipeline.diagnose.screening.screen.Candidate.direction`.
        """
        return float(np.sum(_gains(self.columns, signal, self.parts, self.shrinkage)))

    @property
    def repeats(self) -> bool:
        """Whether most runs gain."""
        return bool(np.mean(self.gains > 0.0) > 0.5)


def ridge_reference_of(base: PooledFit, workers: Executor) -> RidgeReference:
    """Measure what a smooth force could still explain.

    Parameters
    ----------
    base : PooledFit
        At least two runs.
    """
    columns = responses(base, [EffectTrial(effect, (_SIZE,)) for effect in TERMS], workers)
    X = np.column_stack([c if c is not None else np.zeros((2 * base.count, 1)) for c in columns])
    noise = speed_noise(base, workers)
    known = nuisance(noise.of(base).linearised, N_HULL + len(base.model.names))
    return _cross_validated(known, noise.beside(X), [line.u.size for line in base.linearised])


def _cross_validated(known: Nuisance, X: Float, sizes: list[int]) -> RidgeReference:
    clean = known.clean(X)
    norm = np.linalg.norm(clean, axis=0)
    kept = norm > 1e-6 * max(float(norm.max(initial=0.0)), 1e-300)
    unit = np.where(kept, 1.0 / np.where(kept, norm, 1.0), 0.0)
    Z = clean * unit
    ends = np.cumsum([0, *sizes])
    parts = tuple(slice(a, b) for a, b in pairwise(ends))
    tried = {shrinkage: _gains(Z, known.u, parts, shrinkage) for shrinkage in _SHRINKAGE}
    best = max(tried, key=lambda shrinkage: float(np.sum(tried[shrinkage])))
    formula = search(clean * kept, known.u, list(parts), TERMS)
    return RidgeReference(float(np.sum(tried[best])), tried[best], best, formula, Z, parts)


def _penalty(Z: Float, shrinkage: float) -> Float:
    # a column of unit norm explains u with a coefficient of the order of one where there is only noise
    penalty: Float = np.eye(Z.shape[1]) * shrinkage / 100.0
    return penalty


def _gains(Z: Float, u: Float, parts: Sequence[slice], shrinkage: float) -> Float:
    """Return the log-likelihood gained in each run by what the other runs say, shape (runs,)."""
    grams = [Z[p].T @ Z[p] for p in parts]
    moments = [Z[p].T @ u[p] for p in parts]
    whole, moment = np.sum(grams, axis=0), np.sum(moments, axis=0)
    gains = []
    for G, m in zip(grams, moments, strict=True):
        w = np.linalg.solve(whole - G + _penalty(Z, shrinkage), moment - m)
        gains.append(w @ m - 0.5 * w @ G @ w)
    return np.array(gains)
