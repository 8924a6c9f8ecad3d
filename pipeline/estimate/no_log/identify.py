"""Identification without a log: the speed from the longitudinal equation, and what that costs the parameters.

A fit that takes a speed V^ for V has the parameters a V / V^ and b V^2 / V^2^, whatever V is: the lateral model cannot
tell. So it is fitted with the speed at hand, its current and the GNSS along the bow give a better one, and so on until
the speed stays. The uncertainty of the speed then joins the covariance: with delta the error of the mean speed,

    a = a' (1 - delta / V),  b = b' (1 - 2 delta / V)

delta depends on the lateral parameters too, and on what is not known of them; that is carried along (Hamilton (1986),
"A standard error for the estimated state vector of a state-space model", J. Econometrics 33).

If eq. (16) were all of the ship, one zigzag would give the current along the course to a few cm/s: it makes y_v swing
with the heading, a quarter period behind the drift. Real hulls have parts in their drift that do the same. So this part
of y_v is given away but for ``hull_misfit``, one unknown a run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate import maximum_likelihood
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings
from kempf.pipeline.estimate.no_log.joint_motion import LateralFit, Priors, coarsened, run_of
from kempf.pipeline.estimate.no_log.lateral_steps import SlowForces
from kempf.pipeline.estimate.no_log.speed import Motion, Speed, speed_without_log
from kempf.pipeline.estimate.plausibility import plausibility_warnings
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.record.rudder_inflow import with_rudder_inflow
from kempf.pipeline.estimate.result import Estimate, hull_values
from kempf.pipeline.model.ship import Hull
from kempf.schemas.errors import KempfError, UsageError
from kempf.schemas.model_spec import ModelSpec

#: powers of V by which the parameters are multiplied in eq. (16)
SPEED_POWER = np.array([1.0, 1.0, 1.0, 1.0, 2.0, 2.0])
#: how well a trial speed is known, relative, where nobody says so; how far from it a run may be for it to count then
_TRIAL_SPEED_STD, _SAME_ENGINE = 0.1, 0.25
#: share of the speed above which its standard error is named as the trouble
_POORLY_KNOWN = 0.05
#: standard errors beyond which the two halves of the model contradict each other
_MISFIT_SEEN = 3.0


@dataclass(frozen=True)
class NoLogSettings:
    """What is known of the speed and the current beforehand, and when the iteration ends."""

    #: trial_speed_m_s, trial_speed_std_m_s: Speed through the water on a straight course at the shaft speed of the run,
    #: and how well it is known, m/s; None where it is not. The rudder's own drag is not separated from it: leave room
    #: for that. A speed without a standard deviation is taken to be known to 10 %, and counts only for a run within 25
    #: % of it over ground: at another engine setting it says nothing.
    trial_speed_m_s: float | None = None
    trial_speed_std_m_s: float | None = None
    #: Of each component of the current.
    current_std_m_s: float = 2.0
    #: Standard deviation, over the speed, of the current along the course that a real hull shows in her lateral motion
    #: where there is none, because eq. (16) is not all of her. It limits what one zigzag can tell of the speed.
    hull_misfit: float = 0.1
    #: How far the current wanders between two runs.
    current_drift_m_s_per_root_hour: float = 0.2
    #: Fits at most.
    max_rounds: int = 8
    #: The speed stays when it moves by less than this share of its mean, root mean square over the run; what is left of
    #: the mean is scaled away to first order.
    tolerance: float = 1e-3


def identify_without_log(
    record: Record,
    spec: ModelSpec,
    arm_per_m: float,
    settings: MaximumLikelihoodSettings,
    no_log: NoLogSettings | None = None,
    companions: tuple[Record, ...] = (),
) -> Estimate:
    """Estimate hull parameters of a run for which there is no speed through the water.

    Parameters
    ----------
    record : Record
        Its ``speed_m_s`` is the GNSS speed along the bow, to start from; its rudder as it was read, see
        `kempf.pipeline.estimate.record.rudder_inflow`.
    spec : ModelSpec
        Disturbance model. Only the ``earth`` current separates a current along the course from the speed.
    arm_per_m : float
        l of eq. (16), 1/m.
    settings : MaximumLikelihoodSettings
        Of the lateral fits.
    companions : tuple of Record
        Other runs of the ship, not long before or after, with the same engine setting, best on other headings: they
        share V_0 and k, and the current but for its drift. Their parameters are not returned. One that cannot be
        fitted is left out, and a warning says so.

    Returns
    -------
    Estimate
        ``estimator`` is ``ml-no-log``; ``report["speed"]`` has the speed, its standard error and the current. The
        discrete parameters do not depend on the speed and keep their standard errors.

    Raises
    ------
    UsageError
        ``trial_speed``: it or its standard deviation is not positive, or the latter stands alone.
    """
    known, notes = _known(no_log or NoLogSettings(), record)

    def fit(run: Record) -> Estimate:
        return maximum_likelihood.identify(run, spec, arm_per_m, settings)

    order, estimates, left_out = _first_fits(record, companions, spec, fit)
    own = next(i for i, r in enumerate(order) if r is record)
    records = [with_rudder_inflow(r, spec) for r in order]
    parameters: Float | None = None
    rounds: list[dict[str, Any]] = []
    converged = False
    for number in range(known.max_rounds):
        if number:
            estimates = tuple(fit(r) for r in records)
        fits = tuple(_lateral_fit(e, spec, arm_per_m) for e in estimates)
        moving = tuple(run_of(coarsened(r)) for r in records)
        solution = speed_without_log(Motion(moving, fits, _priors(order, spec, known), spec.current), parameters)
        speed, motion, parameters = solution
        mean, std = motion.mean_speed(parameters, own)
        change = [v - run.record.speed_m_s for v, run in zip(speed.speed_m_s, moving, strict=True)]
        # the mean may stay while the shape changes: a current across the course makes the GNSS speed swing
        far = max(float(np.sqrt(np.mean(c**2))) for c in change)
        moved = {"moved_m_s": float(np.mean(change[own])), "moved_rms_m_s": far}
        rounds.append({"mean_speed_m_s": mean, "std_given_the_hull_m_s": std, **moved})
        if far < known.tolerance * mean:
            converged = True
            break
        records = [
            with_rudder_inflow(replace(r, speed_m_s=np.interp(r.time_s, run.record.time_s, v)), spec)
            for r, run, v in zip(order, moving, speed.speed_m_s, strict=True)
        ]
    result = _combined(estimates, solution, own, rounds, converged=converged, no_log=known)
    # in still water the speed over ground along the bow is the speed, whatever the trial speed
    current_notes = () if spec.current == "none" else notes
    return replace(result, warnings=(*result.warnings, *current_notes, *left_out))


def _first_fits(
    record: Record, companions: tuple[Record, ...], spec: ModelSpec, fit: Callable[[Record], Estimate]
) -> tuple[list[Record], tuple[Estimate, ...], tuple[str, ...]]:
    """Fit every run with its GNSS speed; a companion that has no hull to give is left out, and is no reason to stop.

    Returns
    -------
    list of Record
        The runs that stay, in the order of time.
    tuple of Estimate
    tuple of str
        What became of the others.
    """
    kept = [(record, fit(with_rudder_inflow(record, spec)))]
    reasons = []
    for companion in companions:
        try:
            estimate = fit(with_rudder_inflow(companion, spec))
        except KempfError as error:
            reasons.append(error.code)
            continue
        if estimate.converged and np.all(np.isfinite(estimate.covariance)):
            kept.append((companion, estimate))
        else:
            reasons.append("not_converged")
    kept.sort(key=lambda pair: pair[0].start_utc_ns)
    note = (f"{len(reasons)} of {len(companions)} other manoeuvres left out: {', '.join(reasons)}",) if reasons else ()
    return [r for r, _ in kept], tuple(e for _, e in kept), note


def _known(no_log: NoLogSettings, record: Record) -> tuple[NoLogSettings, tuple[str, ...]]:
    """Return the settings with the trial speed as it counts for this run, and what is to be said of it."""
    speed, std = no_log.trial_speed_m_s, no_log.trial_speed_std_m_s
    if speed is None and std is None:
        return no_log, ()
    if speed is None or speed <= 0.0 or (std is not None and std <= 0.0):
        raise UsageError(
            "trial_speed",
            f"The trial speed is {speed} m/s with a standard deviation of {std} m/s; expected positive numbers, and no "
            "standard deviation without a speed.",
            "Give the speed on a straight course at this shaft speed, and its standard deviation.",
        )
    if std is not None:
        return no_log, ()
    over_ground = record.mean_speed_m_s
    if abs(over_ground / speed - 1.0) > _SAME_ENGINE:
        note = (
            f"the trial speed of {speed:.2f} m/s is not used: she made {over_ground:.2f} m/s over ground, perhaps at "
            "another engine setting; state its standard deviation if it holds for this run"
        )
        return replace(no_log, trial_speed_m_s=None), (note,)
    note = f"the trial speed of {speed:.2f} m/s is taken to be known to {100 * _TRIAL_SPEED_STD:.0f} %"
    return replace(no_log, trial_speed_std_m_s=_TRIAL_SPEED_STD * speed), (note,)


def _lateral_fit(estimate: Estimate, spec: ModelSpec, arm_per_m: float) -> LateralFit:
    level = {value.name: value.value for value in estimate.noise}
    forces = SlowForces(
        arm_per_m,
        level.get("sigma_F", 0.0),
        spec.wind_correlation_rate_per_s,
        level.get("sigma_M", 0.0),
        spec.moment_correlation_rate_per_s,
    )
    # a measurement that the run does not have needs no noise level
    noise = (level.get("sigma_v", 1.0), level.get("sigma_r", 1.0), level.get("sigma_psi", 1.0))
    return LateralFit(estimate.hull, forces, level.get("sigma_V", 0.0), spec.current_correlation_rate_per_s, noise)


def _priors(records: list[Record], spec: ModelSpec, no_log: NoLogSettings) -> Priors:
    mean = float(np.mean([r.mean_speed_m_s for r in records]))
    both = all(r.used[1] and r.used[2] for r in records)
    known, unknown = (
        (no_log.trial_speed_m_s, no_log.trial_speed_std_m_s),
        float(np.hypot(0.3 * mean, no_log.current_std_m_s)),
    )
    return Priors(
        sway_m_s=2.0,
        yaw_rad_s=0.2,
        force_m_s2=0.1 * (spec.wind != "none"),
        moment_rad_s2=0.01 * (spec.moment != "none"),
        heading_rad=0.2,
        bias_rad_s=0.02 * (spec.rate_bias and both),
        current_m_s=no_log.current_std_m_s,
        speed_m_s=max(mean, 2.0),
        # in a zigzag a ship loses up to a third of her settled speed; the stream comes on top
        settled_m_s=(known[0], known[1]) if known[0] is not None and known[1] is not None else (mean, unknown),
        loss_m=1e3,
        misfit_m_s=no_log.hull_misfit * mean,
        drift_m_s_per_root_s=no_log.current_drift_m_s_per_root_hour / 60.0,
    )


def _hull_gradient(motion: Motion, parameters: Float, own: int, number: int, std: Float) -> Float:
    """Return d (mean speed of the run ``own``) / d (hull parameters of the run ``number``), shape (6,)."""
    gradient = np.empty(6)
    if not np.all(np.isfinite(std)):
        # a hull without standard errors leaves the speed without one
        return np.full(6, np.nan)
    fit = motion.fits[number]
    for i in range(6):
        step = 0.1 * std[i]
        ends = []
        for sign in (1.0, -1.0):
            hull = fit.hull.array()
            hull[i] += sign * step
            fits = list(motion.fits)
            fits[number] = replace(fit, hull=Hull(*hull))
            moved = Motion(motion.runs, tuple(fits), motion.priors, motion.current)
            ends.append(moved.mean_speed(parameters, own)[0])
        gradient[i] = (ends[0] - ends[1]) / (2.0 * step)
    return gradient


def _combined(
    estimates: tuple[Estimate, ...],
    solution: tuple[Speed, Motion, Float],
    own: int,
    rounds: list[dict[str, Any]],
    *,
    converged: bool,
    no_log: NoLogSettings,
) -> Estimate:
    """Scale the last fit to the last speed and let the uncertainty of the speed join its covariance."""
    speed, motion, parameters = solution
    fit = estimates[own]
    mean, given_std = motion.mean_speed(parameters, own)
    variance = given_std**2 + motion.surge_variance(parameters, own)
    if _contradicts(speed, own):
        # the truth may lie with either half of the model: half their difference, as a standard deviation
        variance += (0.5 * speed.misfit_m_s[own][0]) ** 2
    gradient = np.zeros(6)
    for number, estimate in enumerate(estimates):
        slope = _hull_gradient(motion, parameters, own, number, np.sqrt(np.diag(estimate.covariance)))
        variance += float(slope @ estimate.covariance @ slope)
        gradient = slope if number == own else gradient
    used = mean - rounds[-1]["moved_m_s"]
    factor = (used / mean) ** SPEED_POWER
    hull, C = fit.hull.array() * factor, fit.covariance * np.outer(factor, factor)
    J = SPEED_POWER * hull / mean
    cross = np.outer(J, gradient @ (fit.covariance * factor))
    covariance = C - cross - cross.T + variance * np.outer(J, J)
    std = float(np.sqrt(variance))
    report = {**fit.report, "speed_m_s": mean, "speed": _speed_report(speed, own, mean, std, rounds, no_log)}
    report["speed"]["converged"] = converged
    report["converged"] = bool(fit.converged and converged)
    kept = [w for w in fit.warnings if not w.startswith(("no water log", "not determined"))]
    own_warnings = [
        d for d in plausibility_warnings(hull, np.sqrt(np.diag(covariance)), {}) if d.startswith("not determined")
    ]
    return replace(
        fit,
        estimator="ml-no-log",
        parameters=hull_values(hull, covariance),
        covariance=covariance,
        converged=bool(fit.converged and converged),
        report=report,
        warnings=(*kept, *own_warnings, *_warnings(speed, own, mean, std, motion.current, converged=converged)),
    )


def _contradicts(speed: Speed, own: int) -> bool:
    misfit, std = speed.misfit_m_s[own]
    return abs(misfit) > _MISFIT_SEEN * std


def _speed_report(
    speed: Speed, own: int, mean: float, std: float, rounds: list[dict[str, Any]], no_log: NoLogSettings
) -> dict[str, Any]:
    return {
        "mean_m_s": mean,
        "std_m_s": std,
        "current_along_m_s": float(np.mean(speed.current_along_m_s[own])),
        "current_along_std_m_s": float(np.mean(speed.current_along_std_m_s[own])),
        "correlation_with_current_along": float(np.mean(speed.correlation[own])),
        "settled_speed_m_s": list(speed.settled_m_s),
        "time_constant_s": speed.surge.time_constant_s,
        "turning_loss_m": list(speed.loss_m),
        "wander_m_s_per_root_s": speed.surge.wander_m_s_per_root_s,
        "along_noise_m_s": speed.along_noise_m_s,
        "at_bound": list(speed.at_bound),
        "hull_misfit_m_s": list(speed.misfit_m_s[own]),
        "runs": len(speed.runs),
        "rounds": rounds,
        "settings": asdict(no_log),
    }


def _warnings(speed: Speed, own: int, mean: float, std: float, current: str, *, converged: bool) -> list[str]:
    warnings = [f"no water log: speed {mean:.2f} m/s, standard error {std:.2g} m/s, estimated from GNSS and the turns"]
    if current == "none":
        warnings.append("the model has no current: the GNSS speed along the bow is the speed through the water")
    if std > _POORLY_KNOWN * mean:
        warnings.append(
            f"the speed through the water is known to {100 * std / mean:.0f} % only, and every parameter with it: "
            "sail a manoeuvre on the opposite heading, or state the trial speed and how well it is known"
        )
    if _contradicts(speed, own):
        warnings.append(
            f"the lateral motion implies {speed.misfit_m_s[own][0]:.2f} m/s more current along the course than the "
            "GNSS speed along the bow: unmodelled hull force; the speed is less certain"
        )
    if not converged:
        warnings.append("not converged: the speed through the water still moved when the rounds allowed ran out")
    return warnings
