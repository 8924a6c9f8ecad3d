"""Multiple models: a bank of Kalman filters, each with its own hull, weighed by what it predicted.

The weights are the posterior probabilities of the hulls given the record (Magill 1965, IEEE Trans. Automatic Control
10). A fixed bank over six parameters is either coarse or endless: the bank here moves with its mean (Maybeck & Hentz
1987, J. Guidance 10), and its axes turn and shrink until it just holds the posterior. The filters have no disturbance
states: that is what is compared.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from benchmarks.baselines.start import named, ranked_starts
from benchmarks.baselines.step import exact_step
from kempf.pipeline.channels.series import Float
from kempf.pipeline.compiled import njit
from kempf.pipeline.estimate.classical.report import estimate_of
from kempf.pipeline.estimate.classical.resample import even, step_of
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.result import Estimate, Value
from kempf.schemas.errors import DataRejected
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec

#: three hulls along each of six axes
_DEVIATIONS = np.array(list(product((-1.0, 0.0, 1.0), repeat=6)))
#: a bank changes its size by no more than this along an axis, from one to the next
_STRETCH = (0.4, 2.0)
#: and never beyond this many of the first spacings
_WIDEST = 2.0
#: a middle that moves less than this share of the spacing, and sizes that change less, are at rest
_STILL = 0.3


def _quadratic() -> Float:
    """Return the matrix that fits 1, d_i, d_i d_j to values at the deviations, shape (28, 729)."""
    rows, columns = np.triu_indices(6)
    squares = _DEVIATIONS[:, rows] * _DEVIATIONS[:, columns]
    result: Float = np.linalg.pinv(np.column_stack([np.ones(len(_DEVIATIONS)), _DEVIATIONS, squares]))
    return result


_QUADRATIC = _quadratic()


@dataclass(frozen=True)
class MultipleModelsSettings:
    """Settings of the bank."""

    #: Common step, s; None takes the GNSS period.
    step_s: float | None = None
    #: Mariner-like ships round which the first bank is laid.
    starts: int = 3
    #: Distance of neighbouring hulls in the first bank, as a share of each parameter.
    first_spacing: float = 0.25
    #: Banks at most.
    rounds: int = 60
    #: White acceleration in the first filters, as a share of the accelerations' rms over the record; each further bank
    #: takes the likeliest of a fourth of it, itself and four times it, between ``process_low`` and 1.
    process_share: float = 0.05
    process_low: float = 1e-4


@njit(cache=True, nogil=True, error_model="numpy")
def bank_log_likelihood(hulls, process, noise, step_s, speed, rudder, measured, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of every filter of a bank.

    Parameters
    ----------
    hulls : ndarray, shape (n_model, 6)
    process : ndarray, shape (2,)
        Intensity of the white acceleration, m^2/s^3 and rad^2/s^3.
    noise : ndarray, shape (2,)
        Variances of y_v and y_r.
    speed, rudder : ndarray, shape (n,)
    measured : ndarray, shape (n, 2)
    out : ndarray, shape (n_model,)
        Filled; minus infinity for a hull that answers absurdly fast.
    """
    A, g = np.empty((2, 2)), np.empty(2)
    for m in range(hulls.shape[0]):
        v, r, total = 0.0, 0.0, 0.0
        p00, p01, p11 = 4.0, 0.0, 0.04
        for k in range(measured.shape[0]):
            if k > 0:
                V = 0.5 * (speed[k - 1] + speed[k])
                if not exact_step(hulls[m], V, step_s, rudder[k - 1], rudder[k], A, g):
                    total = -np.inf
                    break
                v, r = A[0, 0] * v + A[0, 1] * r + g[0], A[1, 0] * v + A[1, 1] * r + g[1]
                # the trapezoid of the covariance's integral: half of it enters before the step, half after
                p00 += 0.5 * step_s * process[0]
                p11 += 0.5 * step_s * process[1]
                b00, b01 = A[0, 0] * p00 + A[0, 1] * p01, A[0, 0] * p01 + A[0, 1] * p11
                b10, b11 = A[1, 0] * p00 + A[1, 1] * p01, A[1, 0] * p01 + A[1, 1] * p11
                p00 = b00 * A[0, 0] + b01 * A[0, 1] + 0.5 * step_s * process[0]
                p01 = b00 * A[1, 0] + b01 * A[1, 1]
                p11 = b10 * A[1, 0] + b11 * A[1, 1] + 0.5 * step_s * process[1]
            if not np.isnan(measured[k, 0]):
                e, S = measured[k, 0] - v, p00 + noise[0]
                total -= 0.5 * (np.log(2.0 * np.pi * S) + e * e / S)
                v, r = v + p00 * e / S, r + p01 * e / S
                p00, p01, p11 = p00 - p00 * p00 / S, p01 - p00 * p01 / S, p11 - p01 * p01 / S
            if not np.isnan(measured[k, 1]):
                e, S = measured[k, 1] - r, p11 + noise[1]
                total -= 0.5 * (np.log(2.0 * np.pi * S) + e * e / S)
                v, r = v + p01 * e / S, r + p11 * e / S
                p00, p01, p11 = p00 - p01 * p01 / S, p01 - p01 * p11 / S, p11 - p11 * p11 / S
            if not (abs(v) + abs(r) < 1e6):
                total = -np.inf
                break
        out[m] = total


def identify(record: Record, spec: ModelSpec, arm_per_m: float, settings: MultipleModelsSettings) -> Estimate:
    """Estimate the hull as the mean of a bank under its posterior weights.

    Parameters
    ----------
    spec : ModelSpec
        Its wind and current are left out.
    arm_per_m : float
        Without meaning here.

    Returns
    -------
    Estimate
        Standard errors are the weighted spread of the last bank and, in squares, its resolution, spacing / sqrt(12).
        Signs stay those of the Mariner: the bank scales her.

    Raises
    ------
    DataRejected
        No plausible ship stays bounded over the record.
    """
    used = even(record, settings.step_s)
    starts = ranked_starts(used)[: settings.starts]
    if not starts:
        raise DataRejected(
            "no_ship_explains_it",
            "No Mariner-like ship of any length stays bounded when she is simulated over this record.",
            "Look at the speed and the rudder over the segment.",
        )
    bank = _Bank(used, settings)
    hulls = np.vstack([hull * np.exp(settings.first_spacing * _DEVIATIONS) for _, hull in starts])
    last = _settle(bank, np.sign(starts[0][1]), np.log(np.abs(hulls[bank.weigh(hulls)[2]])), settings)
    off, relative = last.hulls - last.mean, last.mean[:, None] * last.axes
    covariance = (last.weight[:, None] * off).T @ off + relative @ relative.T / 12.0
    reason = "the bank still moved when the rounds ran out"
    warnings = ["not every direction is determined: the bank was not let grow on"] if last.held else []
    return estimate_of(
        "multiple-models",
        used,
        last.mean,
        covariance,
        converged=last.still,
        reason="neither the bank's middle nor its size moves any more" if last.still else reason,
        report={
            "models": int(_DEVIATIONS.shape[0]),
            "first_models": int(_DEVIATIONS.shape[0] * len(starts)),
            "process_share": bank.share,
            "resolution": {n: float(step) for n, step in zip(HULL_PARAMETERS, _resolution(last.axes), strict=True)},
            "largest_weight": float(np.max(last.weight)),
            "active_bounds": ["size of the bank"] if last.held else [],
            "start": [f"Mariner scaled to {length:g} m" for length, _ in starts],
        },
        spec=spec,
        iterations=last.iterations,
        noise=(
            Value("sigma_v", float(np.sqrt(bank.noise[0])), float("nan"), "m/s"),
            Value("sigma_r", float(np.sqrt(bank.noise[1])), float("nan"), "rad/s"),
        ),
        warnings=tuple(warnings),
    )


@dataclass(frozen=True, eq=False)
class _Last:
    """The last bank: its hulls, their weights, the axes it lies along; whether it rests, whether it was held small."""

    hulls: Float
    weight: Float
    mean: Float
    axes: Float
    still: bool
    held: bool
    iterations: tuple[dict[str, Any], ...]


def _settle(bank: _Bank, signs: Float, centre: Float, settings: MultipleModelsSettings) -> _Last:
    """Move, turn and stretch the bank until it rests; centre and axes are logarithms of the parameters' sizes."""
    axes, still, held = settings.first_spacing * np.eye(6), False, False
    iterations: list[dict[str, Any]] = []
    for count in range(settings.rounds):
        settled = bank.choose_process(signs * np.exp(centre))
        hulls = signs * np.exp(centre + _DEVIATIONS @ axes.T)
        weight, values, _ = bank.weigh(hulls)
        moved, mean = weight @ _DEVIATIONS, weight @ hulls
        iterations.append(
            {"iteration": count, "process_share": bank.share, "moved": float(np.max(np.abs(moved))), **named(mean)}
        )
        stretch, directions = _principal(values)
        turned = axes @ directions
        length = np.sqrt(np.sum(turned**2, axis=0))
        # along axes of which the data tell nothing the bank stays one of ships
        limit = _WIDEST * settings.first_spacing
        held = bool(np.any(length * stretch > limit))
        stretch = np.minimum(stretch, limit / length)
        still = bool(settled and np.max(np.abs(moved)) < _STILL and np.all(np.abs(np.log(stretch)) < _STILL))
        if still or count + 1 == settings.rounds:
            break
        centre, axes = centre + axes @ moved, turned * stretch
    return _Last(hulls, weight, mean, axes, still, held, tuple(iterations))


def _resolution(axes: Float) -> Float:
    """Return the distance of neighbouring hulls along each parameter, as a share of it, shape (6,)."""
    result: Float = np.sqrt(np.sum(axes**2, axis=1))
    return result


def _principal(values: Float) -> tuple[Float, Float]:
    """Return by how much to stretch the bank, shape (6,), along which directions, columns of shape (6, 6).

    A quadratic through the log-likelihoods of the bank; stretched, its neighbours lie sqrt(3) posterior standard
    deviations apart.
    """
    finite = np.where(np.isfinite(values), values, np.min(values[np.isfinite(values)]))
    coefficients = _QUADRATIC @ finite
    curvature = np.zeros((6, 6))
    rows, columns = np.triu_indices(6)
    curvature[rows, columns] = coefficients[7:]
    curvature = curvature + curvature.T  # the diagonal holds half the second derivative
    eigenvalues, directions = np.linalg.eigh(curvature)
    wanted = np.sqrt(3.0 / np.maximum(-eigenvalues, 1e-12))
    return np.clip(wanted, *_STRETCH), directions


class _Bank:
    """The filters' common part: record, noise, process noise."""

    def __init__(self, record: Record, settings: MultipleModelsSettings) -> None:
        self.record, self.step_s = record, step_of(record)
        self.measured = np.ascontiguousarray(record.measured[:, :2])
        spread = np.nanstd(self.measured, axis=0)
        stated = np.nan_to_num(record.noise_start[:2], nan=0.0)
        # the slope of a heading, where there is no yaw rate, is as noisy as its differences
        if stated[1] == 0.0:
            stated[1] = record.noise_start[2] / (np.sqrt(2.0) * self.step_s)
        self.noise: Float = np.maximum(stated, 1e-3 * spread) ** 2
        self.acceleration = accelerations(self.measured, self.step_s)
        self.share, self.lowest = settings.process_share, settings.process_low

    def choose_process(self, hull: Float) -> bool:
        """Take the likeliest of three levels of process noise for this hull; return whether it is the one before."""
        shares = [float(np.clip(self.share * factor, self.lowest, 1.0)) for factor in (1.0, 0.25, 4.0)]
        values = [float(self._log_likelihoods(hull[None, :], share)[0]) for share in shares]
        before, self.share = self.share, shares[int(np.argmax(values))]
        return self.share == before

    def _log_likelihoods(self, hulls: Float, share: float) -> Float:
        value = np.empty(hulls.shape[0])
        bank_log_likelihood(
            np.ascontiguousarray(hulls),
            (share * self.acceleration) ** 2 * self.step_s,
            self.noise,
            self.step_s,
            self.record.speed_m_s,
            self.record.rudder_rad,
            self.measured,
            value,
        )
        return value

    def weigh(self, hulls: Float) -> tuple[Float, Float, int]:
        """Return posterior weights and log-likelihoods, each shape (n_model,), and the index of the likeliest hull."""
        value = self._log_likelihoods(hulls, self.share)
        best = int(np.argmax(value))
        if not np.isfinite(value[best]):
            raise DataRejected(
                "no_ship_explains_it",
                "Every filter of the bank left all bounds over this record.",
                "Look at the channels over the segment (heading, yaw rate, speed, rudder).",
            )
        weight = np.exp(value - value[best])
        return weight / np.sum(weight), value, best


def accelerations(measured: Float, step_s: float) -> Float:
    """Return the rms of dv/dt and dr/dt, shape (2,), from differences over a stretch long enough to outweigh noise.

    Parameters
    ----------
    measured : ndarray, shape (n, 2)
    """
    reach = max(1, measured.shape[0] // 100)
    slope = (measured[reach:] - measured[:-reach]) / (reach * step_s)
    result: Float = np.sqrt(np.nanmean(slope**2, axis=0))
    return result
