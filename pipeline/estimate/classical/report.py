"""What a rival found, in the form that every estimator returns."""

from __future__ import annotations

from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.classical.resample import step_of
from kempf.pipeline.estimate.plausibility import plausibility_warnings
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.result import Estimate, Value, discrete_values, hull_values
from kempf.schemas.model_spec import ModelSpec

NO_UNCERTAINTY = np.full((6, 6), np.nan)


def estimate_of(
    name: str,
    record: Record,
    hull: Float | None,
    covariance: Float,
    *,
    converged: bool,
    reason: str,
    report: dict[str, Any],
    spec: ModelSpec,
    iterations: tuple[dict[str, Any], ...] = (),
    noise: tuple[Value, ...] = (),
    fit: dict[str, Any] | None = None,
    warnings: tuple[str, ...] = (),
    blind_to: str = "wind and current",
) -> Estimate:
    """Return the estimate, with what every rival has to say.

    Parameters
    ----------
    record : Record
        At equal steps.
    hull : ndarray, shape (6,), or None
        None where the method ended at no ship.
    covariance : ndarray, shape (6, 6)
        NaN where the method has none.
    report : dict
        The method's own.
    spec : ModelSpec
        What was asked for; disturbances in it are left out, and a warning says so.
    blind_to : str
        What the method leaves out, in words.
    """
    values = np.full(6, np.nan) if hull is None else hull
    whole = bool(np.all(np.isfinite(values)))
    step, speed = step_of(record), record.mean_speed_m_s
    caveats = [*record.warnings]
    if disturbed(spec):
        caveats.append(f"{name} does not model {blind_to}; they bias the parameters")
    if not converged:
        caveats.append(f"not converged: {reason}")
    caveats += warnings
    if whole:
        caveats += plausibility_warnings(values, np.sqrt(np.diag(covariance)), fit or {})
    discrete = discrete_values(values, covariance, speed, step) if whole else ()
    return Estimate(
        estimator=name,
        parameters=hull_values(values, covariance),
        discrete=discrete,
        covariance=covariance,
        noise=noise,
        converged=converged and whole,
        report={
            "converged": converged and whole,
            "reason": reason,
            "iterations": max(0, len(iterations) - 1),
            "speed_m_s": speed,
            "step_s": step,
            **report,
        },
        iterations=iterations,
        fit=fit or {},
        warnings=tuple(caveats),
    )


def disturbed(spec: ModelSpec) -> bool:
    """Whether a model was asked for in which something acts besides the ship; a moment left open counts for none."""
    return spec.wind != "none" or spec.moment == "gauss-markov" or spec.current != "none"
