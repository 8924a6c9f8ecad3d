"""The lateral model of the ship, eq. (16), and its discrete form, eq. (17), convertible both ways."""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.zero_order_hold import zero_order_hold


@dataclass(frozen=True)
class Hull:
    """The six parameters of eq. (16)."""

    #: a11, a12, a21, a22: Hull damping: 1/m, dimensionless, 1/m^2, 1/m.
    a11: float
    a12: float
    a21: float
    a22: float
    #: b1, b2: Rudder effectiveness: 1/m, 1/m^2; positive rudder turns to starboard, so normally b1 < 0 < b2.
    b1: float
    b2: float

    def array(self) -> Float:
        """Return the parameters in the order of the fields, shape (6,)."""
        return np.array(astuple(self), dtype=np.float64)

    def continuous(self, speed_m_s: float) -> tuple[Float, Float]:
        """Return A, shape (2, 2), and B, shape (2, 1), of d[v, r]/dt = A [v, r] + B delta at a speed."""
        V = speed_m_s
        A = V * np.array([[self.a11, self.a12], [self.a21, self.a22]])
        B = V**2 * np.array([[self.b1], [self.b2]])
        return A, B


#: Mariner class at her design speed, nondimensional, from the linear derivatives of Chislett & Strom-Tejsen (1965):
#: the shape of a plausible ship, scaled by length for a start. Multiply a11, a22, b1 by 1/L and a21, b2 by 1/L^2.
MARINER_NONDIMENSIONAL = Hull(a11=-0.75, a12=-0.32, a21=-3.2, a22=-2.0, b1=-0.18, b2=1.67)


def mariner_like(length_m: float) -> Hull:
    """Return the Mariner's nondimensional parameters scaled to a length.

    Examples
    --------
    >>> mariner_like(100.0).b2
    0.000167
    """
    m, L = MARINER_NONDIMENSIONAL, length_m
    return Hull(m.a11 / L, m.a12, m.a21 / L**2, m.a22 / L, m.b1 / L, m.b2 / L**2)


def discrete_from_continuous(hull: Hull, speed_m_s: float, step_s: float) -> tuple[Float, Float]:
    """Return the matrices of eq. (17) for a rudder held over the step.

    Parameters
    ----------
    speed_m_s : float
        Speed through the water, held over the step, m/s.
    step_s : float
        Step, s.

    Returns
    -------
    A : ndarray, shape (2, 2)
    B : ndarray, shape (2, 1)
    """
    return zero_order_hold(*hull.continuous(speed_m_s), step_s)


def continuous_from_discrete(A: Float, B: Float, speed_m_s: float, step_s: float) -> Hull | None:
    """Return the parameters of eq. (16) that give these matrices of eq. (17), or None.

    Parameters
    ----------
    A : ndarray, shape (2, 2)
    B : ndarray, shape (2, 1)

    Returns
    -------
    Hull or None
        None where A has no real logarithm (an eigenvalue that is zero or on the negative real axis) or the matrices
        are not finite: no continuous ship samples to them.

    Examples
    --------
    >>> hull = mariner_like(150.0)
    >>> A, B = discrete_from_continuous(hull, 9.0, 1.0)
    >>> back = continuous_from_discrete(A, B, 9.0, 1.0)
    >>> bool(np.allclose(back.array(), hull.array(), rtol=1e-9))
    True
    """
    if not (np.all(np.isfinite(A)) and np.all(np.isfinite(B))):
        return None
    # A = m I + N with N N = d I, so that its logarithm is a multiple of I and one of N.
    m = 0.5 * (A[0, 0] + A[1, 1])
    N = A - m * np.eye(2)
    d = -float(np.linalg.det(N))
    determinant = m * m - d
    s = np.sqrt(abs(d))
    if determinant <= 0.0 or (d >= 0.0 and m <= s):
        return None
    angle = np.arctanh(s / m) if d > 0.0 else np.arctan2(s, m)
    factor = angle / s if s > 1e-8 * abs(m) else 1.0 / m
    generator = 0.5 * np.log(determinant) * np.eye(2) + factor * N
    # B = integral of e^{A_c t} over the step times B_c: the same integral, undone
    integral = zero_order_hold(generator, np.eye(2), 1.0)[1]
    if not np.all(np.isfinite(generator)) or np.linalg.cond(integral) > 1e12:
        return None
    inputs = np.linalg.solve(integral, B) / step_s
    generator = generator / step_s
    V = speed_m_s
    (a11, a12), (a21, a22) = generator / V
    b1, b2 = inputs[:, 0] / V**2
    return Hull(float(a11), float(a12), float(a21), float(a22), float(b1), float(b2))
