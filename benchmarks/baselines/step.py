"""The exact step of the two states of eq. (16) without disturbances, compiled: speed held, rudder moving linearly.

Its own small copy of what the likelihood's kernel does for more states: the rivals get the same care in time, and no
part in the kernel's changes.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.compiled import njit

_ORDER = 14
_LONGEST = 0.5
#: no vessel answers her rudder faster than this, 1/s
FASTEST_PER_S = 10.0


@njit(cache=True, nogil=True, error_model="numpy")
def exact_step(hull, V, span, u0, u1, A, g):  # type: ignore[no-untyped-def]
    """Fill A, shape (2, 2), and g, shape (2,), of x+ = A x + g; False for a hull that answers absurdly fast.

    Parameters
    ----------
    hull : ndarray, shape (6,)
        a11, a12, a21, a22, b1, b2.
    V, span : float
        Speed held over the step, m/s, and its length, s.
    u0, u1 : float
        Rudder at its beginning and end, rad.
    """
    a, b = V * hull[0], V * hull[1]
    c, d = V * hull[2], V * hull[3]
    p, q = V * V * hull[4], V * V * hull[5]
    # a balanced norm: the off-diagonal entries count by their product, which no choice of units changes
    size = abs(a) + abs(d) + np.sqrt(abs(b * c))
    if not (size <= FASTEST_PER_S):
        return False
    n = max(1, int(np.ceil(size * span / _LONGEST)))
    h, slope = span / n, (u1 - u0) / n
    A[0, 0], A[0, 1], A[1, 0], A[1, 1] = 1.0, 0.0, 0.0, 1.0
    g[0], g[1] = 0.0, 0.0
    for sub in range(n):
        u = u0 + slope * sub
        t00, t01, t10, t11 = 1.0, 0.0, 0.0, 1.0
        e00, e01, e10, e11 = 1.0, 0.0, 0.0, 1.0
        w = h * (u + 0.5 * slope)
        f0, f1 = w * p, w * q
        for k in range(1, _ORDER + 1):
            s = h / k
            t00, t01, t10, t11 = (
                s * (a * t00 + b * t10),
                s * (a * t01 + b * t11),
                s * (c * t00 + d * t10),
                s * (c * t01 + d * t11),
            )
            e00 += t00
            e01 += t01
            e10 += t10
            e11 += t11
            w = h * (u / (k + 1) + slope / ((k + 1) * (k + 2)))
            f0 += w * (t00 * p + t01 * q)
            f1 += w * (t10 * p + t11 * q)
            if max(abs(t00), abs(t11), np.sqrt(abs(t01 * t10))) < 1e-18:
                break
        x00, x01, x10, x11 = A[0, 0], A[0, 1], A[1, 0], A[1, 1]
        A[0, 0], A[0, 1] = e00 * x00 + e01 * x10, e00 * x01 + e01 * x11
        A[1, 0], A[1, 1] = e10 * x00 + e11 * x10, e10 * x01 + e11 * x11
        g[0], g[1] = e00 * g[0] + e01 * g[1] + f0, e10 * g[0] + e11 * g[1] + f1
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def innovations(hull, K, x0, step_s, speed, rudder, measured, out):  # type: ignore[no-untyped-def]
    """Run x+ = A x + g + K e over an even record and keep e = y - x; K = 0 simulates.

    Parameters
    ----------
    hull : ndarray, shape (6,)
    K : ndarray, shape (2, 2)
    x0 : ndarray, shape (2,)
        v, m/s, and r, rad/s, at the first instant.
    speed, rudder : ndarray, shape (n,)
    measured : ndarray, shape (n, 2)
        y_v and y_r; NaN where not measured, and no correction there.
    out : ndarray, shape (n, 2)
        Filled with e; 0 where not measured.

    Returns
    -------
    bool
        False where the run left all bounds; ``out`` is then of no use.
    """
    A, g, x, e = np.empty((2, 2)), np.empty(2), x0.copy(), np.zeros(2)
    n = measured.shape[0]
    for k in range(n):
        for i in range(2):
            e[i] = measured[k, i] - x[i]
            if np.isnan(measured[k, i]):
                e[i] = 0.0
            out[k, i] = e[i]
        if not (abs(x[0]) + abs(x[1]) < 1e6):
            return False
        if k + 1 < n:
            V = 0.5 * (speed[k] + speed[k + 1])
            if not exact_step(hull, V, step_s, rudder[k], rudder[k + 1], A, g):
                return False
            v = A[0, 0] * x[0] + A[0, 1] * x[1] + g[0] + K[0, 0] * e[0] + K[0, 1] * e[1]
            r = A[1, 0] * x[0] + A[1, 1] * x[1] + g[1] + K[1, 0] * e[0] + K[1, 1] * e[1]
            x[0], x[1] = v, r
    return True
