"""A linear system sampled at a step, its input held over it."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.channels.series import Float


def zero_order_hold(A: Float, B: Float, step_s: float) -> tuple[Float, Float]:
    """Return the matrices that carry dx/dt = A x + B u over a step through which u is held.

    Parameters
    ----------
    A : ndarray, shape (..., n, n)
    B : ndarray, shape (..., n, m)
    step_s : float
        Step, s.

    Returns
    -------
    ndarray, shape (..., n, n)
    ndarray, shape (..., n, m)
    """
    # what only reads parameters, such as the pages, needs no scipy
    from scipy.linalg import expm

    n, m = B.shape[-2:]
    block = np.zeros((*B.shape[:-2], n + m, n + m))
    block[..., :n, :n], block[..., :n, n:] = A * step_s, B * step_s
    both = expm(block)
    return both[..., :n, :n], both[..., :n, n:]
