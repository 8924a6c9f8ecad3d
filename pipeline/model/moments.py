"""Covariance of the extended filter: over a substep, by white noise, and what a measurement takes off it; compiled.

Only the live states are touched: most models have no moment, no bias, no states of effects. Series and rule to the
fourth order, as in `pipeline.model.extended` (Van Loan 1978, IEEE Trans. Automatic Control 23, for the integral).
"""

from __future__ import annotations

from pipeline.compiled import njit


@njit(cache=True, nogil=True, error_model="numpy")
def exponential(A, h, live, Phi, term, work):  # type: ignore[no-untyped-def]
    """Fill Phi with exp(A h) to the fourth order, over the live states; the others stay what they are."""
    for i in live:
        for j in live:
            term[i, j] = 1.0 if i == j else 0.0
            Phi[i, j] = term[i, j]
    for order in range(1, 5):
        s = h / order
        for i in live:
            for j in live:
                value = 0.0
                for m in live:
                    value += A[i, m] * term[m, j]
                work[i, j] = s * value
        for i in live:
            for j in live:
                term[i, j] = work[i, j]
                Phi[i, j] += term[i, j]


@njit(cache=True, nogil=True, error_model="numpy")
def carry_covariance(P, Phi, decay, live, after, W):  # type: ignore[no-untyped-def]
    """Let P <- F P F' where F is Phi on the live states and ``decay`` on those after them."""
    for i in live:
        for j in live:
            value = 0.0
            for m in live:
                value += Phi[i, m] * P[m, j]
            W[i, j] = value
        for j in after:
            value = 0.0
            for m in live:
                value += Phi[i, m] * P[m, j]
            W[i, j] = value * decay[j]
    for i in live:
        for j in live:
            if j > i:
                break
            value = 0.0
            for m in live:
                value += W[i, m] * Phi[j, m]
            P[i, j] = value
            P[j, i] = value
        for j in after:
            P[i, j] = W[i, j]
            P[j, i] = W[i, j]
    for i in after:
        for j in after:
            P[i, j] *= decay[i] * decay[j]


@njit(cache=True, nogil=True, error_model="numpy")
def add_noise(P, A, w, q, h, live, nodes, a, b):  # type: ignore[no-untyped-def]
    """Add to P what white noise of intensity q along w does over h seconds: Simpson's rule on exp(A s) w."""
    for i in live:
        a[i] = w[i]
        for node in range(3):
            nodes[node, i] = w[i]
    half, whole = 1.0, 1.0
    for order in range(1, 5):
        half *= 0.5 * h / order
        whole *= h / order
        for i in live:
            total = 0.0
            for j in live:
                total += A[i, j] * a[j]
            b[i] = total
        for i in live:
            a[i] = b[i]
            nodes[1, i] += half * a[i]
            nodes[2, i] += whole * a[i]
    for i in live:
        for j in live:
            P[i, j] += (
                q * h / 6.0 * (nodes[0, i] * nodes[0, j] + 4.0 * nodes[1, i] * nodes[1, j] + nodes[2, i] * nodes[2, j])
            )


@njit(cache=True, nogil=True, error_model="numpy")
def take_in(x, P, h, e, S, gain):  # type: ignore[no-untyped-def]
    """Take in one scalar measurement of innovation e and variance S; ``gain`` holds P h."""
    n = x.size
    for i in range(n):
        g = gain[i] / S
        if g != 0.0:
            x[i] += g * e
            for j in range(i + 1):
                value = P[i, j] - g * gain[j]
                P[i, j] = value
                P[j, i] = value
