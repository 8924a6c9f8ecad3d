"""Covariance of the extended filter: over a substep, by white noise, and what a measurement takes off it; compiled.

Only the live states are touched: most models have no moment, no bias, no states of effects. Series and rule to the
fourth order, as in `pipeline.estimate.filters.ekf` (Van Loan 1978, IEEE Trans. Automatic Control 23, for the integral).
Most of what couples two states is nothing, and passed over. Every number stands in lanes (see
`kempf.pipeline.model.batch`).
"""

from __future__ import annotations

from kempf.pipeline.compiled import FILLING, STEP, njit
from kempf.pipeline.model.batch import each


@njit(**FILLING)
def _couplings(A, live, found, lanes):  # type: ignore[no-untyped-def]
    """Fill ``found`` with which elements of a matrix are anything in any lane."""
    for i in live:
        for j in live:
            found[i, j] = False
            for b in range(each(lanes)):
                if A[i, j, b] != 0.0:
                    found[i, j] = True
                    break


@njit(**STEP)
def _add_product(out, i, j, A, k, m, B, p, q, lanes):  # type: ignore[no-untyped-def]
    """Add A[k, m] B[p, q] to out[i, j] in every lane."""
    for b in range(each(lanes)):
        out[i, j, b] += A[k, m, b] * B[p, q, b]


@njit(**FILLING)
def exponential(A, h, live, Phi, term, work, coupled, lanes):  # type: ignore[no-untyped-def]  # noqa: PLR0912 - loops over lanes
    """Fill Phi with exp(A h) to the fourth order, over the live states; the others stay what they are.

    ``coupled`` becomes which elements of Phi there are.
    """
    _couplings(A, live, coupled, lanes)
    for i in live:
        for j in live:
            one = 1.0 if i == j else 0.0
            for b in range(each(lanes)):
                term[i, j, b] = h * A[i, j, b]
                Phi[i, j, b] = one + term[i, j, b]
    for order in range(2, 5):
        s = h / order
        for i in live:
            for j in live:
                for b in range(each(lanes)):
                    work[i, j, b] = 0.0
            for m in live:
                if coupled[i, m]:
                    for j in live:
                        _add_product(work, i, j, A, i, m, term, m, j, lanes)
        for i in live:
            for j in live:
                for b in range(each(lanes)):
                    term[i, j, b] = s * work[i, j, b]
                    Phi[i, j, b] += term[i, j, b]
    _couplings(Phi, live, coupled, lanes)


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
def add_noise(P, A, w, q, h, live, coupled, term, work, node, lanes):  # type: ignore[no-untyped-def]  # noqa: PLR0912 - loops over lanes
    """Add to P what white noise of intensity q along w does over h seconds: Simpson's rule on exp(A s) w.

    Of P only the lower triangle is filled; see `mirror`. ``coupled`` tells which elements of exp(A h) there are, and so
    of A at least.
    """
    for i in live:
        for b in range(each(lanes)):
            term[i, 0, b] = w[i, b]
            node[0, i, b] = w[i, b]
        for b in range(each(lanes)):
            node[1, i, b] = w[i, b]
        for b in range(each(lanes)):
            node[2, i, b] = w[i, b]
    half = 1.0
    for order in range(1, 5):
        half *= 0.5
        s = h / order
        for i in live:
            for b in range(each(lanes)):
                work[i, 0, b] = 0.0
            for j in live:
                if coupled[i, j]:
                    _add_product(work, i, 0, A, i, j, term, j, 0, lanes)
        for i in live:
            for b in range(each(lanes)):
                term[i, 0, b] = s * work[i, 0, b]
            for b in range(each(lanes)):
                node[1, i, b] += half * term[i, 0, b]
            for b in range(each(lanes)):
                node[2, i, b] += term[i, 0, b]
    for k in range(3):
        weight = h / 6.0 * (4.0 if k == 1 else 1.0)
        for i in live:
            for b in range(each(lanes)):
                term[i, 0, b] = weight * q[b] * node[k, i, b]
            for j in live:
                if j > i:
                    break
                _add_product(P, i, j, term, i, 0, node, k, j, lanes)


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
