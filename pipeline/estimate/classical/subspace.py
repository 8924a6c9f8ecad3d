"""Subspace identification (N4SID) of two states without disturbances.

Past inputs and outputs against future ones: the oblique projection of the future outputs on the past along the future
inputs has the extended observability matrix for its column space (Van Overschee & De Moor 1996, Subspace Identification
for Linear Systems, ch. 4, algorithm 3 with its weights). Every state being measured, the realisation is then
turned so that C = E: its states are v and r themselves. Rudder column and initial state follow by least squares on the
simulated output (Ljung 1999, System Identification, sec. 10.6). Why no library: docs/decisions/0013-subspace.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.classical.report import NO_UNCERTAINTY, estimate_of
from kempf.pipeline.estimate.classical.resample import even, step_of, without_means
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.result import Estimate
from kempf.pipeline.model.ship import continuous_from_discrete
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import ModelSpec

_ORDER = 2


@dataclass(frozen=True)
class SubspaceSettings:
    """Settings of the method."""

    #: Common step, s; None takes the GNSS period.
    step_s: float | None = None
    #: Block rows of past and of future.
    horizon: int = 10
    #: Take the means off measurements and rudder first, the usual remedy against what is constant.
    remove_means: bool = False


@dataclass(frozen=True, eq=False)
class Realisation:
    """x+ = A x + B u, y = x + noise, found from data."""

    #: Shape (2, 2).
    A: Float
    #: Shape (2, n_input).
    B: Float
    #: Shape (n_singular,). Singular values of the weighted projection; two stand out where two states explain the data.
    singular: Float
    #: Empty, or why A and B are of no use.
    reason: str = ""


def identify(record: Record, spec: ModelSpec, arm_per_m: float, settings: SubspaceSettings) -> Estimate:
    """Estimate eq. (17) by N4SID on the longest stretch without a gap.

    Parameters
    ----------
    spec : ModelSpec
        Its wind and current are left out.
    arm_per_m : float
        Without meaning here.

    Returns
    -------
    Estimate
        Without standard errors: the method gives none.

    Raises
    ------
    DataRejected
        No stretch without a gap is long enough for the horizon.
    """
    uniform = _longest_whole(even(record, settings.step_s))
    used = without_means(uniform) if settings.remove_means else uniform
    outputs = used.measured[:, :2]
    # the held value that does what the interpolated rudder does, to second order; u acts from the next instant on
    held = np.append(0.5 * (used.rudder_rad[1:] + used.rudder_rad[:-1]), used.rudder_rad[-1])
    columns = outputs.shape[0] - 2 * settings.horizon + 1
    if columns < 2 * settings.horizon * 3:
        raise DataRejected(
            "segment_too_short",
            f"The longest stretch without a gap holds {outputs.shape[0]} instants, a horizon of {settings.horizon} "
            f"needs {8 * settings.horizon}.",
            "Choose a smaller horizon or step, or let the zigzag run for more legs.",
            {"instants": int(outputs.shape[0]), "needed": 8 * settings.horizon},
        )
    spread = np.std(outputs, axis=0)
    realisation = realise(outputs / spread, held[:, None], settings.horizon)
    A, B = realisation.A * np.outer(spread, 1.0 / spread), realisation.B * spread[:, None]
    hull, reason = None, realisation.reason
    if not reason:
        ship = continuous_from_discrete(A, B, used.mean_speed_m_s, step_of(used))
        hull = None if ship is None else ship.array()
        if hull is None:
            reason = "the realisation belongs to no continuous ship: an eigenvalue is not positive"
    return estimate_of(
        "subspace",
        used,
        hull,
        NO_UNCERTAINTY,
        converged=hull is not None,
        reason=reason or "a projection has a closed form",
        report=_report(realisation, A, B, settings, outputs.shape[0]),
        spec=spec,
        warnings=("no standard errors: the subspace method gives none",),
    )


def _report(realisation: Realisation, A: Float, B: Float, settings: SubspaceSettings, instants: int) -> dict[str, Any]:
    return {
        "horizon": settings.horizon,
        "instants": instants,
        "singular_values": [float(s) for s in realisation.singular[:6]],
        "A": [[float(a) for a in row] for row in A] if np.all(np.isfinite(A)) else None,
        "B": [float(b) for b in B[:, 0]] if np.all(np.isfinite(B)) else None,
    }


def _longest_whole(record: Record) -> Record:
    whole = np.all(np.isfinite(record.measured[:, :2]), axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], whole.astype(np.int8), [0]])))
    starts, ends = edges[::2], edges[1::2]
    longest = int(np.argmax(ends - starts))
    cut = slice(int(starts[longest]), int(ends[longest]))
    return replace(
        record,
        time_s=record.time_s[cut],
        speed_m_s=record.speed_m_s[cut],
        rudder_rad=record.rudder_rad[cut],
        measured=record.measured[cut],
        heading_rad=record.heading_rad[cut],
    )


def _hankel(signal: Float, rows: int) -> Float:
    """Stack a signal, shape (n, m), into block rows one step apart, shape (rows m, n - rows + 1)."""
    columns = signal.shape[0] - rows + 1
    return np.vstack([signal[i : i + columns].T for i in range(rows)])


def realise(outputs: Float, inputs: Float, horizon: int) -> Realisation:
    """Find A and B of x+ = A x + B u, y = x + noise, by N4SID.

    Parameters
    ----------
    outputs : ndarray, shape (n, 2)
        Of like size, since a projection is not indifferent to units.
    inputs : ndarray, shape (n, n_input)
    horizon : int
        Block rows i of past and of future.
    """
    i, m, p = horizon, inputs.shape[1], outputs.shape[1]
    U, Y = _hankel(inputs, 2 * i), _hankel(outputs, 2 * i)
    Uf, Wp, Yf = U[m * i :], np.vstack([U[: m * i], Y[: p * i]]), Y[p * i :]
    # Rows in the order Uf, Wp, Yf: the triangular factor then holds every projection.
    stacked = np.vstack([Uf, Wp, Yf]) / np.sqrt(U.shape[1])
    L = np.linalg.qr(stacked.T)[1].T
    past = slice(m * i, m * i + (m + p) * i)
    future = slice((2 * m + p) * i, None)
    # L32 L22^+ Wp is the oblique projection; times the part of Wp that Uf does not explain, its weighted form
    weighted = L[future, past]
    left, singular, _ = np.linalg.svd(weighted, full_matrices=False)
    empty = np.full((_ORDER, _ORDER), np.nan), np.full((_ORDER, m), np.nan)
    if not singular[_ORDER - 1] > 1e-12 * singular[0]:
        return Realisation(*empty, singular, "the data show fewer than two states")
    observability = left[:, :_ORDER] * np.sqrt(singular[:_ORDER])
    C = observability[:p]
    if np.linalg.cond(C) > 1e8:
        return Realisation(*empty, singular, "the realisation cannot be turned to lateral speed and yaw rate")
    shifted = np.linalg.lstsq(observability[:-p], observability[p:], rcond=None)[0]
    A = C @ shifted @ np.linalg.inv(C)
    B = _input_matrix(A, outputs, inputs)
    if B is None:
        return Realisation(A, empty[1], singular, "the realisation is unstable: it leaves all bounds when simulated")
    return Realisation(A, B, singular)


def _input_matrix(A: Float, outputs: Float, inputs: Float) -> Float | None:
    """Return B by least squares on the simulated output, the initial state beside it; None where A is unstable."""
    n, m = inputs.shape
    if np.max(np.abs(np.linalg.eigvals(A))) ** n > 1e6:
        return None
    # responses of both states to each input alone through each entry of B, and to each initial state
    count = _ORDER * m + _ORDER
    response = np.zeros((n, _ORDER, count))
    response[0, :, _ORDER * m :] = np.eye(_ORDER)
    for k in range(n - 1):
        response[k + 1] = A @ response[k]
        for row in range(_ORDER):
            response[k + 1, row, row * m : (row + 1) * m] += inputs[k]
    # asarray: the stubs of lstsq give away that the elements are doubles
    solution = np.linalg.lstsq(response.reshape(n * _ORDER, count), outputs.ravel(), rcond=None)[0]
    return np.asarray(solution, dtype=np.float64)[: _ORDER * m].reshape(_ORDER, m)
