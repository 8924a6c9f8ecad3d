"""Formula search over the missing force, exploratory: the few smooth terms that together explain most of what is left.

Terms are taken one at a time, the one that gains most in runs that did not fit it, all coefficients refitted each time
(orthogonal matching pursuit: Pati, Rezaiifar & Krishnaprasad 1993, 27th Asilomar Conference). It proposes what to try
next; it confirms nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.schemas.effect import Effect

#: terms of a formula at most, and the log-likelihood that one more must gain in runs that did not fit it
_MOST, _EARNED = 3, 8.0


@dataclass(frozen=True)
class Term:
    """One term of a proposed formula."""

    #: target, expression: As `kempf effects try` takes them; the expression holds its coefficient.
    target: str
    expression: str
    #: Log-likelihood that the formula gains with it, in runs that did not fit it, over the formula without it.
    gain: float


def search(clean: Float, u: Float, parts: Sequence[slice], terms: Sequence[Effect]) -> tuple[Term, ...]:
    """Propose a formula for what is left.

    Parameters
    ----------
    clean : ndarray, shape (N, c)
        Columns of the terms without what the fitted parameters imitate.
    u : ndarray, shape (N,)
        Whitened innovations.
    parts : sequence of slice
        Rows of each run.
    terms : sequence of Effect
        One a column, with one parameter each.

    Returns
    -------
    tuple of Term
        In the order in which they were taken; empty where nothing repeats itself.
    """
    grams = np.array([clean[p].T @ clean[p] for p in parts])
    moments = np.array([clean[p].T @ u[p] for p in parts])
    usable = np.flatnonzero(np.einsum("rii->i", grams) > 0.0)
    chosen: list[int] = []
    gains: list[float] = []
    best = 0.0
    while len(chosen) < _MOST:
        tried = {int(k): _left_out(grams, moments, [*chosen, int(k)]) for k in usable if k not in chosen}
        if not tried:
            break
        k = max(tried, key=lambda index: (tried[index], -index))
        if tried[k] - best < _EARNED:
            break
        gains.append(tried[k] - best)
        chosen.append(k)
        best = tried[k]
    if not chosen:
        return ()
    size = _solved(np.sum(grams, axis=0), np.sum(moments, axis=0), chosen)
    formula = []
    for k, value, gain in zip(chosen, size, gains, strict=True):
        ((target, text),) = terms[k].terms.items()
        name = terms[k].parameters[0].name
        formula.append(Term(target, text.replace(f"*{name}", f"*{value:.4g}"), gain))
    return tuple(formula)


def _left_out(grams: Float, moments: Float, chosen: list[int]) -> float:
    """Log-likelihood that coefficients of all runs but one gain in that one, summed over the runs."""
    whole, moment, total = np.sum(grams, axis=0), np.sum(moments, axis=0), 0.0
    for G, m in zip(grams, moments, strict=True):
        w = _solved(whole - G, moment - m, chosen)
        total += float(w @ m[chosen] - 0.5 * w @ G[np.ix_(chosen, chosen)] @ w)
    return total


def _solved(G: Float, m: Float, chosen: list[int]) -> Float:
    block = G[np.ix_(chosen, chosen)]
    scale = np.sqrt(np.maximum(np.diag(block), 1e-300))
    solution: Float = np.linalg.lstsq(block / np.outer(scale, scale), m[chosen] / scale, rcond=1e-8)[0] / scale
    return solution
