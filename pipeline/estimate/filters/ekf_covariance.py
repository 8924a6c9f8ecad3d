"""Covariance of the extended filter: from one instant to the next, and what a measurement takes off it; compiled.

Only the live states are touched: most models have no moment, no bias, no states of effects. The exponential is that of
half a step by its series to the fourth order, squared; the integral of the noise goes by Simpson's rule over the whole
step, whose three nodes are then known (Van Loan 1978, IEEE Trans. Automatic Control 23, for the integral). Most of what
couples two states is nothing, and passed over. Every number stands in lanes (see `kempf.pipeline.model.batch`).
"""

from __future__ import annotations

from kempf.pipeline.compiled import FILLING, STEP, njit
from kempf.pipeline.model.batch import each


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
def _add_product(out, i, j, A, k, m, B, p, q, lanes):  # type: ignore[no-untyped-def]
    """Add A[k, m] B[p, q] to out[i, j] in every lane."""
    for b in range(each(lanes)):
        out[i, j, b] += A[k, m, b] * B[p, q, b]


@njit(**FILLING)
def _multiply(A, of_A, B, of_B, live, out, lanes):  # type: ignore[no-untyped-def]
    """Fill ``out`` with A B over the live states, both being nothing outside their patterns."""
    for i in live:
        for j in live:
            for b in range(each(lanes)):
                out[i, j, b] = 0.0
        for m in live:
            if of_A[i, m]:
                for j in live:
                    if of_B[m, j]:
                        _add_product(out, i, j, A, i, m, B, m, j, lanes)


@njit(**FILLING)
def exponential(A, h, live, direct, reached, Half, Phi, term, work, lanes):  # type: ignore[no-untyped-def]
    """Fill Half with exp(A h / 2) and Phi with exp(A h), over the live states; the others stay what they are.

    ``direct`` and ``reached`` are those of `couplings`.
    """
    for i in live:
        for j in live:
            one = 1.0 if i == j else 0.0
            for b in range(each(lanes)):
                term[i, j, b] = 0.5 * h * A[i, j, b]
            for b in range(each(lanes)):
                Half[i, j, b] = one + term[i, j, b]
    for order in range(2, 5):
        s = 0.5 * h / order
        _multiply(A, direct, term, reached, live, work, lanes)
        for i in live:
            for j in live:
                if reached[i, j]:
                    for b in range(each(lanes)):
                        term[i, j, b] = s * work[i, j, b]
                    for b in range(each(lanes)):
                        Half[i, j, b] += term[i, j, b]
    _multiply(Half, reached, Half, reached, live, Phi, lanes)


@njit(**FILLING)
def carry_covariance(P, Phi, decay, live, after, W, coupled, lanes):  # type: ignore[no-untyped-def]  # noqa: PLR0912 - loops over lanes
    """Let P <- F P F' where F is Phi on the live states and ``decay`` on those after them.

    Of the live states only the lower triangle is filled; see `mirror`.
    """
    for i in live:
        for j in live:
            for b in range(each(lanes)):
                W[i, j, b] = 0.0
        for j in after:
            for b in range(each(lanes)):
                W[i, j, b] = 0.0
        for m in live:
            if coupled[i, m]:
                for j in live:
                    _add_product(W, i, j, Phi, i, m, P, m, j, lanes)
                for j in after:
                    _add_product(W, i, j, Phi, i, m, P, m, j, lanes)
    for i in live:
        for j in live:
            if j > i:
                break
            for b in range(each(lanes)):
                P[i, j, b] = 0.0
            for m in live:
                if coupled[j, m]:
                    _add_product(P, i, j, W, i, m, Phi, j, m, lanes)
        for j in after:
            for b in range(each(lanes)):
                P[i, j, b] = W[i, j, b] * decay[j]
                P[j, i, b] = P[i, j, b]
    for i in after:
        for j in after:
            for b in range(each(lanes)):
                P[i, j, b] *= decay[i] * decay[j]


@njit(**FILLING)
def add_at_once(P, i, j, q, h, w, lanes):  # type: ignore[no-untyped-def]
    """Add to P[i, j] what white noise of intensity q along w[0] brings in h seconds, as if at this instant."""
    for b in range(each(lanes)):
        P[i, j, b] += h * q[b] * w[0, i, b] * w[0, j, b]


@njit(**FILLING)
def add_from_middle(P, Half, reached, q, h, w, sources, live, along, work, lanes):  # type: ignore[no-untyped-def]
    """Add to the lower triangle of P what white noise along w[0] brings in h seconds, as if half a step ago.

    Parameters
    ----------
    w, along : ndarray, shape (1, n, lanes)
        w is anything for ``sources`` alone; the other is room.
    work : ndarray, shape (n, n, lanes)
        Room; its first column is used.
    """
    for i in live:
        for b in range(each(lanes)):
            along[0, i, b] = 0.0
        for m in sources:
            if reached[i, m]:
                _add_product(along, 0, i, Half, i, m, w, 0, m, lanes)
        for b in range(each(lanes)):
            work[i, 0, b] = h * q[b] * along[0, i, b]
    for i in live:
        for j in live:
            if j > i:
                break
            _add_product(P, i, j, work, i, 0, along, 0, j, lanes)


@njit(**FILLING)
def mirror(P, live, lanes):  # type: ignore[no-untyped-def]
    """Fill the upper triangle of the live states' covariance from the lower one."""
    for i in live:
        for j in live:
            if j >= i:
                break
            for b in range(each(lanes)):
                P[j, i, b] = P[i, j, b]


@njit(**FILLING)
def take_in(x, P, e, precision, gain, weight, states, lanes):  # type: ignore[no-untyped-def]
    """Take in one scalar measurement of innovations e and variances 1 / ``precision``; ``gain`` holds P h.

    ``states`` are those that there are; ``weight``, shape (1, n, lanes), is room to work in.
    """
    for i in states:
        for b in range(each(lanes)):
            weight[0, i, b] = -gain[0, i, b] * precision[b]
        for b in range(each(lanes)):
            x[i, b] -= weight[0, i, b] * e[b]
        for j in states:
            if j > i:
                break
            _add_product(P, i, j, weight, 0, i, gain, 0, j, lanes)
            for b in range(each(lanes)):
                P[j, i, b] = P[i, j, b]
