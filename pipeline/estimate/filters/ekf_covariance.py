"""Covariance of the extended filter: from one instant to the next, and what a measurement takes off it; compiled.

Only the live states are touched: most models have no moment, no bias, no states of effects. The exponential is that of
half a step by its series to the fourth order, squared; the integral of the noise goes by Simpson's rule over the whole
step, whose three nodes are then known (Van Loan 1978, IEEE Trans. Automatic Control 23, for the integral). Most of what
couples two states is nothing, and passed over. Every number stands in lanes (see `kempf.pipeline.model.batch`).
"""

from __future__ import annotations

from kempf.pipeline.compiled import FILLING, STEP, njit
from kempf.pipeline.model.batch import each
from kempf.pipeline.model.lanes import at, everywhere, put


@njit(**FILLING)
def couplings(A, live, direct, reached, lanes):  # type: ignore[no-untyped-def]
    """Fill which elements of A are anything in any lane, and which elements of its exponential may be."""
    for i in live:
        for j in live:
            made = 0
            for b in range(each(lanes)):
                made += A[i, j, b] != 0.0
            direct[i, j] = made > 0
            reached[i, j] = made > 0 or i == j
    for m in live:
        for i in live:
            if reached[i, m]:
                for j in live:
                    reached[i, j] = reached[i, j] or reached[m, j]


@njit(**STEP)
def _add_product(out, i, j, a, B, p, q, lanes):  # type: ignore[no-untyped-def]
    """Add a B[p, q] to out[i, j] in every lane."""
    put(out, (i, j), at(out, (i, j), lanes) + a * at(B, (p, q), lanes), lanes)


@njit(**FILLING)
def _multiply(A, of_A, B, of_B, live, out, lanes):  # type: ignore[no-untyped-def]
    """Fill ``out`` with A B over the live states, both being nothing outside their patterns."""
    for i in live:
        for j in live:
            put(out, (i, j), 0.0, lanes)
        for m in live:
            if of_A[i, m]:
                a = at(A, (i, m), lanes)
                for j in live:
                    if of_B[m, j]:
                        _add_product(out, i, j, a, B, m, j, lanes)


@njit(**FILLING)
def exponential(A, h, live, direct, reached, Half, Phi, term, work, lanes):  # type: ignore[no-untyped-def]
    """Fill Half with exp(A h / 2) and Phi with exp(A h), over the live states; the others stay what they are.

    ``direct`` and ``reached`` are those of `couplings`.
    """
    for i in live:
        for j in live:
            first = 0.5 * h * at(A, (i, j), lanes)
            put(term, (i, j), first, lanes)
            put(Half, (i, j), (1.0 if i == j else 0.0) + first, lanes)
    for order in range(2, 5):
        s = 0.5 * h / order
        _multiply(A, direct, term, reached, live, work, lanes)
        for i in live:
            for j in live:
                if reached[i, j]:
                    further = s * at(work, (i, j), lanes)
                    put(term, (i, j), further, lanes)
                    put(Half, (i, j), at(Half, (i, j), lanes) + further, lanes)
    _multiply(Half, reached, Half, reached, live, Phi, lanes)


@njit(**FILLING)
def carry_covariance(P, Phi, decay, live, after, W, coupled, lanes):  # type: ignore[no-untyped-def]  # noqa: PLR0912 - loops over states
    """Let P <- F P F' where F is Phi on the live states and ``decay`` on those after them.

    Of the live states only the lower triangle is filled; see `mirror`.
    """
    for i in live:
        for j in live:
            put(W, (i, j), 0.0, lanes)
        for j in after:
            put(W, (i, j), 0.0, lanes)
        for m in live:
            if coupled[i, m]:
                a = at(Phi, (i, m), lanes)
                for j in live:
                    _add_product(W, i, j, a, P, m, j, lanes)
                for j in after:
                    _add_product(W, i, j, a, P, m, j, lanes)
    for i in live:
        for j in live:
            if j > i:
                break
            total = everywhere(0.0, lanes)
            for m in live:
                if coupled[j, m]:
                    total += at(W, (i, m), lanes) * at(Phi, (j, m), lanes)
            put(P, (i, j), total, lanes)
        for j in after:
            carried = at(W, (i, j), lanes) * decay[j]
            put(P, (i, j), carried, lanes)
            put(P, (j, i), carried, lanes)
    for i in after:
        for j in after:
            put(P, (i, j), at(P, (i, j), lanes) * (decay[i] * decay[j]), lanes)


@njit(**FILLING)
def add_at_once(P, i, j, q, h, w, lanes):  # type: ignore[no-untyped-def]
    """Add to P[i, j] what white noise of intensity q along w brings in h seconds, as if at this instant."""
    brought = h * at(q, (), lanes) * at(w, i, lanes) * at(w, j, lanes)
    put(P, (i, j), at(P, (i, j), lanes) + brought, lanes)


@njit(**FILLING)
def add_from_middle(P, Half, reached, q, h, w, sources, live, along, lanes):  # type: ignore[no-untyped-def]
    """Add to the lower triangle of P what white noise along w brings in h seconds, as if half a step ago.

    Parameters
    ----------
    w, along : ndarray, shape (n, lanes)
        w is anything for ``sources`` alone; the other is room.
    """
    for i in live:
        total = everywhere(0.0, lanes)
        for m in sources:
            if reached[i, m]:
                total += at(Half, (i, m), lanes) * at(w, m, lanes)
        put(along, i, total, lanes)
    for i in live:
        brought = h * at(q, (), lanes) * at(along, i, lanes)
        for j in live:
            if j > i:
                break
            put(P, (i, j), at(P, (i, j), lanes) + brought * at(along, j, lanes), lanes)


@njit(**FILLING)
def mirror(P, live, lanes):  # type: ignore[no-untyped-def]
    """Fill the upper triangle of the live states' covariance from the lower one."""
    for i in live:
        for j in live:
            if j >= i:
                break
            put(P, (j, i), at(P, (i, j), lanes), lanes)


@njit(**FILLING)
def take_in(x, P, e, precision, gain, states, lanes):  # type: ignore[no-untyped-def]
    """Take in one scalar measurement of innovations e and variances 1 / ``precision``; ``gain`` holds P h.

    ``states`` are those that there are.
    """
    for i in states:
        weight = -at(gain, i, lanes) * at(precision, (), lanes)
        put(x, i, at(x, i, lanes) - weight * at(e, (), lanes), lanes)
        for j in states:
            if j > i:
                break
            left = at(P, (i, j), lanes) + weight * at(gain, j, lanes)
            put(P, (i, j), left, lanes)
            put(P, (j, i), left, lanes)
