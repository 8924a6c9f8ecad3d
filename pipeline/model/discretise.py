"""One exact step of the chain (v, r, psi, F, M) of eq. (16), with its derivatives, compiled.

M is a Gauss-Markov yaw acceleration beside l F, for ships on which more than the wind acts; it may be absent. For a
speed held over the step and a rudder that moves linearly, the matrix exponential, the input and the process noise come
from one Taylor series, summed to the last bit of a double on steps short enough for it. The derivatives with respect
to a11, a12, a21, a22 run along in the innermost axis, where the processor takes several at once.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.compiled import STEP, njit
from kempf.pipeline.model.chain import N_CHAIN, PSI, F, M, R, V

_N_A = 4  # a11, a12, a21, a22
_ORDER = 16  # Taylor terms: 0.5^17 / 17! is below the last bit of a double
_SETTLED = 1e-16
#: the derivatives' sums end sooner: a score right to nine digits finds the same maximum
_SETTLED_DERIVATIVES = 1e-10
#: the rule that integrates the process noise over a step, exact for polynomials of degree 7: nodes and weights on
#: (0, 1), and the nodes' powers
_N_NODES = 4
_NODES = 0.5 * (np.polynomial.legendre.leggauss(_N_NODES)[0] + 1.0)
_WEIGHTS = 0.5 * np.polynomial.legendre.leggauss(_N_NODES)[1]
_POWERS = _NODES ** np.arange(_ORDER + 1)[:, None]
#: largest |A| h of one step
LONGEST = 0.5


@njit(**STEP)
def _moved(k):  # type: ignore[no-untyped-def]
    """Return the k-th of the states that move others: v, r, F, M; the heading moves none."""
    return k if k < PSI else k + 1


@njit(**STEP)
def rates(theta, speed, arm, mu_F, mu_M, A, b):  # type: ignore[no-untyped-def]
    """Fill A, shape (2, 2), and b, shape (2,), at a speed; return the size of the chain's matrix in 1/s."""
    A[0, 0], A[0, 1], A[1, 0], A[1, 1] = theta[0] * speed, theta[1] * speed, theta[2] * speed, theta[3] * speed
    b[0], b[1] = theta[4] * speed * speed, theta[5] * speed * speed
    # a balanced norm: the off-diagonal entries count by their product, which no choice of units changes
    return abs(A[0, 0]) + abs(A[1, 1]) + np.sqrt(abs(A[0, 1] * A[1, 0])) + max(mu_F, mu_M)


@njit(**STEP)
def discretise(  # type: ignore[no-untyped-def]
    A,
    b,
    arm,
    mu_F,
    mu_M,
    h,
    u0,
    u1,
    speed,
    q_F,
    q_M,
    derivatives,
    Phi,
    g,
    held,
    Q,
    dPhi,
    dg,
    dheld,
    dQ,
    T,
    dT,
    answer,
    danswer,
):
    """One exact step of h seconds, the rudder moving from u0 to u1.

    Fills Phi, shape (5, 5), the input g, shape (5,), what a unit of rudder held over the step does instead,
    shape (5,), and the process noise Q, shape (5, 5, 2), by the intensities q_F,
    m^2/s^5, and q_M, 1/s^5; ``dPhi``, shape (5, 5, 4), ``dg`` and ``dheld``, shape (5, 6), and ``dQ``, shape (5, 5, 4),
    their derivatives with respect to the hull parameters. Of Q and dQ only the lower triangles are filled.

    The answers to a unit of F and of M are summed at the nodes of a Gauss-Legendre rule by the way, because Q is the
    integral of their squares.
    """
    columns = 4 if q_M > 0.0 else 3
    for i in range(N_CHAIN):
        for c in range(N_CHAIN):
            T[i, c] = 1.0 if i == c else 0.0
            Phi[i, c] = T[i, c]
    for m in range(columns - 2):
        for i in range(N_CHAIN):
            for node in range(_N_NODES):
                answer[m, i, node] = 1.0 if i == F + m else 0.0
    slope = u1 - u0
    w = h * (u0 + 0.5 * slope)
    g[V], g[R], g[F], g[M], g[PSI] = w * b[0], w * b[1], 0.0, 0.0, 0.0
    held[V], held[R], held[F], held[M], held[PSI] = h * b[0], h * b[1], 0.0, 0.0, 0.0
    square, largest = speed * speed, 1.0
    a00, a01, a10, a11 = A[0, 0], A[0, 1], A[1, 0], A[1, 1]
    if derivatives:
        dT[:, :] = 0.0
        dPhi[:, :, :] = 0.0
        dg[:, :] = 0.0
        danswer[:, :, :, :] = 0.0
        dheld[:, :] = 0.0
        dg[V, 4], dg[R, 5] = w * square, w * square
        dheld[V, 4], dheld[R, 5] = h * square, h * square
    for k in range(1, _ORDER + 1):
        s = h / k
        w, one_held = h * (u0 / (k + 1) + slope / ((k + 1) * (k + 2))), h / (k + 1)
        force, moment = T[F, F], T[M, M]
        derived = derivatives and largest > _SETTLED_DERIVATIVES
        if derived:
            for q in range(4 * _N_A):
                dv, dr = dT[0, q], dT[1, q]
                dT[0, q], dT[1, q], dT[2, q] = s * (a00 * dv + a01 * dr), s * (a10 * dv + a11 * dr), s * dr
            for k_moved in range(columns):
                c = _moved(k_moved)
                q, sv, sr = k_moved * _N_A, s * speed * T[V, c], s * speed * T[R, c]
                dT[0, q] += sv
                dT[0, q + 1] += sr
                dT[1, q + 2] += sv
                dT[1, q + 3] += sr
            for k_moved in range(columns):
                c = _moved(k_moved)
                for j in range(_N_A):
                    dPhi[V, c, j] += dT[0, k_moved * _N_A + j]
                    dPhi[R, c, j] += dT[1, k_moved * _N_A + j]
                    dPhi[PSI, c, j] += dT[2, k_moved * _N_A + j]
            for row in range(3):
                for j in range(_N_A):
                    pushed = dT[row, j] * b[0] + dT[row, _N_A + j] * b[1]
                    dg[row, j] += w * pushed
                    dheld[row, j] += one_held * pushed
                for m in range(columns - 2):
                    for j in range(_N_A):
                        t = dT[row, (2 + m) * _N_A + j]
                        for node in range(_N_NODES):
                            danswer[m, row, j, node] += t * _POWERS[k, node]
        for k_moved in range(columns):
            c = _moved(k_moved)
            v, r = T[V, c], T[R, c]
            nv, nr = a00 * v + a01 * r, a10 * v + a11 * r
            if c == F:
                nv += force
                nr += arm * force
            elif c == M:
                nr += moment
            T[V, c], T[R, c], T[PSI, c] = s * nv, s * nr, s * r
            Phi[V, c] += T[V, c]
            Phi[R, c] += T[R, c]
            Phi[PSI, c] += T[PSI, c]
        T[F, F], T[M, M] = -mu_F * s * force, -mu_M * s * moment
        Phi[F, F] += T[F, F]
        Phi[M, M] += T[M, M]
        for m in range(columns - 2):
            for i in range(N_CHAIN):
                t = T[i, F + m]
                for node in range(_N_NODES):
                    answer[m, i, node] += t * _POWERS[k, node]
        for i in (V, R, PSI):
            moved = T[i, 0] * b[0] + T[i, 1] * b[1]
            g[i] += w * moved
            held[i] += one_held * moved
            if derived:
                for j in range(2):
                    dg[i, 4 + j] += w * square * T[i, j]
                    dheld[i, 4 + j] += one_held * square * T[i, j]
        # a balanced measure of the terms left out, which no choice of units changes
        largest = max(abs(T[V, V]), abs(T[R, R]), np.sqrt(abs(T[V, R] * T[R, V])), abs(T[F, F]), abs(T[M, M]))
        if largest < _SETTLED:
            break
    for m in range(columns - 2):
        q = h * (q_F if m == 0 else q_M)
        for i in range(N_CHAIN):
            for c in range(i + 1):
                total = 0.0
                for node in range(_N_NODES):
                    total += _WEIGHTS[node] * answer[m, i, node] * answer[m, c, node]
                Q[i, c, m] = total * q
                if derivatives:
                    for j in range(_N_A):
                        total = 0.0
                        for node in range(_N_NODES):
                            one = danswer[m, i, j, node] * answer[m, c, node]
                            total += _WEIGHTS[node] * (one + answer[m, i, node] * danswer[m, c, j, node])
                        dQ[i, c, j] = total * q + (dQ[i, c, j] if m > 0 else 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def room_for_a_step():  # type: ignore[no-untyped-def]
    """Return the arrays that `discretise` works in."""
    return (
        np.zeros((N_CHAIN, N_CHAIN)),
        np.zeros((3, 4 * _N_A)),
        np.zeros((2, N_CHAIN, _N_NODES)),
        np.zeros((2, N_CHAIN, _N_A, _N_NODES)),
    )
