"""What a diagnosis comes to, in words that a naval architect can act on and in the keys that people script against."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.confirm import Confirmation
from kempf.pipeline.diagnose.diagnosis import Diagnosis
from kempf.pipeline.diagnose.immaterial import Immaterial
from kempf.pipeline.diagnose.ladder_step import Step, rung
from kempf.pipeline.diagnose.remainder import reference_gains
from kempf.pipeline.diagnose.remaining_misfit import as_json as remaining_json
from kempf.pipeline.diagnose.remaining_misfit import said as remaining_said
from kempf.pipeline.diagnose.screen import Candidate
from kempf.pipeline.predict.free_run import FreeRun
from kempf.schemas.effect import Effect
from kempf.schemas.enumeration import listed

Verdict = Literal["adequate", "explained", "ambiguous", "partly_explained", "unexplained", "insufficient_data"]
#: said of an effect that improves the prediction while something that repeats itself is left
NOT_EXPLAINED = "improves the fit, but does not explain the misfit (see what remains)"
#: an effect whose possible size is smaller than this many standard errors cannot be seen
POWER = 3.0
#: log-likelihood that an effect must gain in a manoeuvre to be seen in it
SEEN_IN_RUN = 2.0
#: said of the free runs of such a ship
_UNSTABLE = (
    " She does not keep a straight course by herself, so that the free run of any model leaves hers: what counts is "
    "the error one leg ahead."
)
#: a share of the whitened variance below which a significant effect is too small to matter
NEGLIGIBLE = 5e-4


@dataclass(frozen=True)
class EffectFinding:
    """One effect's verdict, and why."""

    #: ``present`` is what matters; ``immaterial`` is certain and changes nothing that a user predicts.
    verdict: Literal["present", "immaterial", "suspected", "negligible", "not_testable", "absent"]
    why: str


def verdict(diagnosis: Diagnosis) -> Verdict:
    """Return what the diagnosis comes to."""
    if diagnosis.before is None:
        return "insufficient_data"
    if diagnosis.something_left:
        return "partly_explained" if len(diagnosis.steps) > 1 else "unexplained"
    sizes = [len(step.chosen_from) for step in diagnosis.steps[1:]]
    if not sizes:
        return "adequate"
    return "explained" if max(sizes) == 1 else "ambiguous"


def _climbed(diagnosis: Diagnosis) -> tuple[Step, ...]:
    """Return every step that was taken, also those whose effects only imitate what is left."""
    return (*diagnosis.steps, *diagnosis.imitating)


def share_explained(diagnosis: Diagnosis) -> float | None:
    """Return the part of the misfit one leg ahead, in manoeuvres left out, that the last model explains."""
    first, last = diagnosis.steps[0].ahead, diagnosis.steps[-1].ahead
    if first is None or last is None or last is first:
        return None
    return 1.0 - last.left_out.mean / first.left_out.mean


def finding(diagnosis: Diagnosis, candidate: Candidate) -> EffectFinding:
    """Return the verdict on one candidate of the first screen.

    Parameters
    ----------
    candidate : Candidate
        Of the plain model's screen.
    """
    effect = candidate.effect
    found = _refitted(diagnosis, candidate.effect)
    if found is not None:
        return found
    untestable = _untestable(candidate)
    if untestable:
        return EffectFinding("not_testable", untestable)
    if candidate.p_adjusted >= diagnosis.settings.level:
        return EffectFinding("absent", _absent(candidate))
    if effect.name in diagnosis.suspected:
        return EffectFinding("suspected", diagnosis.suspected[effect.name])
    measured = sum(line.u.size // 2 for line in diagnosis.steps[0].fit.linearised)
    if candidate.score / measured < NEGLIGIBLE:
        return EffectFinding(
            "negligible", f"it explains {_percent(candidate.score / measured)} of the innovations' variance"
        )
    return _explained_away(diagnosis, candidate)


def _refitted(diagnosis: Diagnosis, effect: Effect) -> EffectFinding | None:
    """Return the verdict on an effect that a step was made of, or that is immaterial; None on any other."""
    for number, step in enumerate(diagnosis.steps[1:], start=1):
        members = {c.effect.name: k for c, k in step.chosen_from}
        if effect.name in members:
            others = [c.effect.title for c, _ in step.chosen_from if c.effect.name != effect.name]
            alike = f"; these data would fit {listed(others)} as well" if others else ""
            size = _stated(diagnosis, step, effect, members[effect.name])
            return EffectFinding("present", f"step {number}: {size}{alike}")
    for step in diagnosis.imitating:
        for member, confirmation in step.chosen_from:
            if member.effect.name == effect.name:
                return EffectFinding("absent", f"{NOT_EXPLAINED}: {_sized(effect, confirmation)}")
    for one in diagnosis.immaterial:
        for member, confirmation in one.chosen_from:
            if member.effect.name == effect.name:
                return EffectFinding("immaterial", f"{_sized(effect, confirmation)}; {_changes(one)}")
    return None


def _changes(one: Immaterial) -> str:
    """Say how little an effect changes."""
    return (
        f"with it the misfit one leg ahead changes by {-100.0 * one.weight.fall:+.1f} %, and no parameter of the hull "
        f"moves by more than {100.0 * one.weight.shift:.1f} % beyond its error"
    )


def _untestable(candidate: Candidate) -> str:
    """Say why these data do not determine an effect; empty where they do."""
    if candidate.missing:
        return f"not in the logs: {listed(list(candidate.missing))}"
    if candidate.measured_by:
        return f"the logs have {listed(list(candidate.measured_by))}, which measures it already"
    if np.isnan(candidate.score):
        share = _percent(candidate.absorption)
        return f"the model as it is absorbs {share} of it. {candidate.effect.separated_by}"
    weak = _too_weak(candidate)
    return f"{weak} {candidate.effect.separated_by}" if weak else ""


def _explained_away(diagnosis: Diagnosis, candidate: Candidate) -> EffectFinding:
    """Say why an effect that looked present by itself is not claimed."""
    name = candidate.effect.name
    added = [step.added.title for step in diagnosis.steps[1:] if step.added is not None]
    last = {c.effect.name: c for c in diagnosis.steps[-1].screened}.get(name)
    refits = [k for step in _climbed(diagnosis) for c, k in step.refused if c.effect.name == name]
    if added and (last is None or np.isnan(last.score) or last.p_adjusted >= diagnosis.settings.level):
        return EffectFinding("absent", f"no longer significant once {listed(added)} is included")
    if refits:
        return EffectFinding("absent", f"significant by itself; refused after the refit: {_refusal(refits[-1])}")
    return EffectFinding("absent", "significant by itself; not refitted, as others explain more")


def _refusal(confirmation: Confirmation) -> str:
    """Say which test a refitted effect did not stand."""
    gains = np.concatenate([confirmation.fold_gains, confirmation.held_out_gains])
    if not np.isfinite(confirmation.fit.log_likelihood):
        return "the refitted model diverges"
    if confirmation.outdone:
        return "another effect is so much better that its fit was not finished"
    if confirmation.at_bound or confirmation.absent:
        limit = "its size is at the limit of what is physical"
        return limit if confirmation.at_bound else "the refit leaves nothing of it"
    if confirmation.bic_change > -6.0:
        return f"the improvement does not justify its parameters (BIC {confirmation.bic_change:+.1f})"
    if np.mean(gains > 0.0) <= 0.5 or np.sum(gains) <= 0.0:
        return (
            f"it predicts only {int(np.sum(gains > 0.0))} of {gains.size} manoeuvres better that it was not fitted to"
        )
    return "another effect is clearly better"


def _stated(diagnosis: Diagnosis, step: Step, effect: Effect, confirmation: Confirmation) -> str:
    """Return the size of an effect that is claimed, from that fit which predicts better.

    Where parameters fitted to legs predict better than the likelihood's, so do the sizes of effects; those of what
    could be in the place of an effect are then not given.
    """
    ahead = diagnosis.steps[-1].ahead
    if ahead is None or ahead.disagrees is None:
        return _sized(effect, confirmation)
    if step.added is None or effect.name != step.added.name:
        return effect.title
    own = [i for i, (of, _) in enumerate(ahead.model.parameters) if of.name == effect.name]
    std = np.sqrt(np.maximum(np.diag(ahead.fit.covariance), 0.0))[-ahead.fit.values.size :]
    return f"{_with_size(effect, ahead.fit.values[own], std[own])}, fitted to legs"


def _sized(effect: Effect, confirmation: Confirmation) -> str:
    """Return an effect's size with its standard errors, in the units people use."""
    size = len(effect.parameters)
    return _with_size(effect, confirmation.fit.values[-size:], confirmation.fit.std[-size:])


def _with_size(effect: Effect, values: Float, std: Float) -> str:
    within = [v % (2.0 * np.pi) if p.is_direction else v for p, v in zip(effect.parameters, values, strict=True)]
    shown = [_shown(p.name, v, s, p.unit) for p, v, s in zip(effect.parameters, within, std, strict=True)]
    return f"{effect.title}, {', '.join(shown)}"


def _shown(name: str, value: float, std: float, unit: str) -> str:
    factor, shown = (180.0 / np.pi, unit.replace("rad", "deg")) if unit in ("rad", "rad/s") else (1.0, unit)
    digits = max(0, 1 - int(np.floor(np.log10(abs(std * factor))))) if np.isfinite(std) and std > 0.0 else 4
    digits = min(digits, 8)
    error = f" ± {std * factor:.{digits}f}" if np.isfinite(std) else ""
    what = " (1 s.e.)" if error else ""
    return f"{name} = {value * factor:.{digits}f}{error}{f' {shown}' if shown not in ('', '1') else ''}{what}"


def _too_weak(candidate: Candidate) -> str:
    """Say that even the largest physical size would not be seen; empty where it would."""
    made = np.isfinite(candidate.std)
    parameters = [p for p, m in zip(candidate.effect.parameters, made, strict=True) if m]
    reach = np.array([max(abs(p.low), abs(p.high)) for p in parameters])
    if np.all(reach < POWER * candidate.std[made]):
        error = f"{candidate.std[made][0]:.2g} {parameters[0].unit}".rstrip()
        return f"its standard error, {error}, is as large as any size that is physical."
    return ""


def _absent(candidate: Candidate) -> str:
    p, made = candidate.effect.parameters[0], np.isfinite(candidate.std)
    if not made[0]:
        return "not seen"
    limit = abs(candidate.change[0]) + 2.0 * candidate.std[0]
    return f"not seen; upper limit (95 %): |{p.name}| < {limit:.2g} {p.unit if p.unit != '1' else ''}".rstrip()


def sentences(diagnosis: Diagnosis) -> list[str]:
    """Return what a person should read first, a sentence each."""
    said = []
    what = verdict(diagnosis)
    for step in diagnosis.steps[1:]:
        (candidate, best), *others = step.chosen_from
        line = f"{candidate.effect.plain.rstrip('.')}: {_stated(diagnosis, step, candidate.effect, best)}"
        if others:
            line += f"; the same data would fit {listed([c.effect.title for c, _ in others])}"
            line += f". What distinguishes them: {candidate.effect.separated_by}"
        said.append(line.rstrip(".") + ".")
    said += _together(diagnosis)
    if len(diagnosis.steps) > 1:
        said += _ahead(diagnosis)
        said.append(_fall(diagnosis.steps[0], diagnosis.steps[-1]))
    for step in diagnosis.imitating:
        (candidate, best), *_ = step.chosen_from
        size = _sized(candidate.effect, best)
        said.append(f"{size[:1].upper()}{size[1:]}: {NOT_EXPLAINED}.")
    for one in diagnosis.immaterial:
        (candidate, best), *_ = one.chosen_from
        said.append(f"Certain but immaterial: {_sized(candidate.effect, best)}; {_changes(one)}.")
    if what == "insufficient_data":
        said.append(
            "One manoeuvre alone cannot distinguish an effect from chance: sail at least three zigzags, to both sides, "
            "at two rudder angles, on two headings."
        )
    if what == "adequate":
        said.append("No effect of the catalogue improves the prediction of manoeuvres that were not fitted.")
    if what in ("unexplained", "partly_explained") and diagnosis.after is not None:
        if what == "partly_explained" or reference_gains(diagnosis.before, diagnosis.after):
            said.append(
                "None of the known effects explains what remains: a smooth force of unknown origin still gains "
                f"{diagnosis.after.gain:.0f} of log-likelihood in manoeuvres that it was not fitted to."
            )
        else:
            said.append(
                f"None of the known effects explains the misfit: {len(diagnosis.steps) - 1} of them were needed, and "
                "the first explains too little to be the cause."
            )
        if diagnosis.after.formula:
            terms = "; ".join(f"{term.target}: {term.expression}" for term in diagnosis.after.formula)
            said.append(f"Exploratory, not a finding; a formula to try: {terms}.")
    if len(diagnosis.steps) == 1 and what != "insufficient_data":
        said += _left(diagnosis)
    return said


def _left(diagnosis: Diagnosis) -> list[str]:
    """Say how much of what the last model leaves is noise, and where it sits."""
    if diagnosis.remaining is None:
        return []
    return remaining_said(
        diagnosis.remaining, "what is left" if len(diagnosis.steps) > 1 else "the misfit one leg ahead"
    )


def _together(diagnosis: Diagnosis) -> list[str]:
    """Say which effects were chosen together, once for every set of them."""
    titles = {step.added.name: step.added.title for step in diagnosis.steps[1:] if step.added is not None}
    sets = dict.fromkeys(step.together for step in diagnosis.steps if step.together)
    words = [listed([titles[name] for name in names]) for names in sets]
    return [
        f"{said[:1].upper()}{said[1:]} belong together: each of them alone makes no prediction clearly better. They "
        "were chosen by manoeuvres left out, and the held-out ones, which had no part in the choice, confirm them."
        for said in words
    ]


def _ahead(diagnosis: Diagnosis) -> list[str]:
    """Say how the prediction one leg ahead changes: fitted, left out and held out, best and worst manoeuvre."""
    first, last = diagnosis.steps[0].ahead, diagnosis.steps[-1].ahead
    if first is None or last is None:
        return []
    parts = [("the fitted manoeuvres", first.own, last.own), ("the same left out", first.left_out, last.left_out)]
    if first.held.errors:
        parts.append(("those held out", first.held, last.held))
    falls = [
        f"from {np.mean(first.percent(a)):.1f} to {np.mean(last.percent(b)):.1f} % in {name}" for name, a, b in parts
    ]
    before, after = first.percent(first.left_out), last.percent(last.left_out)
    best, worst = int(np.argmin(after - before)), int(np.argmax(after - before))
    said = [
        f"One leg ahead ({last.horizon_s:.3g} s) the error, of the motion, goes {listed(falls)}; left out, it goes "
        f"from {before[best]:.1f} to {after[best]:.1f} % in the manoeuvre that gains most, from {before[worst]:.1f} to "
        f"{after[worst]:.1f} % in the one that gains least."
    ]
    share = share_explained(diagnosis)
    if share is not None:
        said.append(
            f"Of the misfit (mean square) one leg ahead, in manoeuvres left out, {100.0 * share:.0f} % is explained."
        )
    said += _left(diagnosis)
    if last.disagrees is not None:
        said.append(
            f"Fits one step and one leg ahead still disagree: with parameters fitted to legs the misfit is "
            f"{100.0 * last.disagrees.falls_by:.0f} % smaller, so that something is still lacking; predictions of "
            "manoeuvres take those."
        )
    return said


def _fall(first: Step, last: Step) -> str:
    a, b = first.held_out_error, last.held_out_error
    force = last.intensities[0] / first.intensities[0]
    disturbance = f"the intensity of the lateral disturbance to {100 * force:.0f} % of what it was."
    if last.ahead is not None and last.ahead.disagrees is not None:
        return _fall_by_legs(first, last, disturbance)
    fitted = f"from {_share(first.in_sample_error)} to {_share(last.in_sample_error)} %"
    if a is None or b is None:
        return f"The free-run error of fitted manoeuvres (none is held out) goes {fitted} of the motion, {disturbance}"
    held = f"{len(last.held)} held-out manoeuvre{'s' * (len(last.held) > 1)}"
    said = (
        f"The free-run error of {held} goes from {_share(a)} to {_share(b)} % of the motion, of the fitted ones "
        f"{fitted}, {disturbance}"
    )
    if not _keeps_course(last.fit.hull):
        said += _UNSTABLE
    elif b > a:
        said += (
            " The held-out error is no smaller: what speaks for the effects is the likelihood of held-out measurements "
            "and the disturbance."
        )
    return said


def _fall_by_legs(first: Step, last: Step, disturbance: str) -> str:
    """Say how the free runs change with the parameters that predictions take; medians, as some may run away."""
    many = len(last.fitted)
    samples = [("fitted", slice(None, many)), ("held-out", slice(many, None))]
    falls = [
        f"from {_median(first.by_legs[part])} to {_median(last.by_legs[part])} % of the motion in {name} manoeuvres"
        for name, part in samples
        if last.by_legs[part]
    ]
    off = sum(not run.relative_error < 1.0 for run in last.by_legs)
    said = f"With parameters fitted to legs the median free-run error goes {listed(falls)}, {disturbance}"
    assert last.ahead is not None
    if not _keeps_course(last.ahead.fit.hull):
        said += _UNSTABLE
    return f"{said} {off} of {len(last.by_legs)} free runs leave the measured course altogether." if off else said


def _median(runs: Sequence[FreeRun]) -> str:
    middle = float(np.median(np.nan_to_num([run.relative_error for run in runs], nan=np.inf)))
    return _share(middle if np.isfinite(middle) else np.nan)


def _keeps_course(hull: Float) -> bool:
    """Return whether a hull goes straight ahead with the rudder amidships: both roots of eq. (16) are damped."""
    a11, a12, a21, a22 = hull[:4]
    return bool(a11 + a22 < 0.0 and a11 * a22 - a12 * a21 > 0.0)


def _share(error: float) -> str:
    return "divergence" if np.isnan(error) else f"{100 * error:.1f}"


def _percent(share: float) -> str:
    text = f"{100 * share:.2f}" if share < 0.9995 else f"{100 * share:.4f}"
    return f"{text} %"


def as_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the diagnosis under the command line's keys, JSON content; what is not finite is None."""
    sets = [_set(diagnosis, f"S{number}", step) for number, step in enumerate(diagnosis.steps[1:], start=1)]
    first = len(diagnosis.steps)
    imitating = [_set(diagnosis, f"S{number}", step) for number, step in enumerate(diagnosis.imitating, start=first)]
    member = {name: one["set_id"] for one in sets for name in one["effects"]}
    return {
        "verdict": verdict(diagnosis),
        "sentences": sentences(diagnosis),
        "candidates": [_candidate(diagnosis, c, member) for c in diagnosis.steps[0].screened],
        "sets": sets,
        "stand_ins": imitating,
        "immaterial": [
            {
                "effects": [c.effect.name for c, _ in one.chosen_from],
                "error_ahead_falls_by": one.weight.fall,
                "in_std": one.weight.t,
                "hull_changes_by": one.weight.shift,
                "hull_changes_by_std": one.weight.shift_in_std,
                "refits": [_refit(c, k) for c, k in one.chosen_from],
            }
            for one in diagnosis.immaterial
        ],
        "suspected": [{"effect": name, "why": why} for name, why in diagnosis.suspected.items()],
        "share_explained": share_explained(diagnosis),
        "remaining_misfit": None if diagnosis.remaining is None else remaining_json(diagnosis.remaining),
        "refused": [
            _refit(c, k) | {"why": diagnosis.suspected.get(c.effect.name) or _refusal(k)}
            for step in _climbed(diagnosis)
            for c, k in step.refused
        ],
        "ladder": [
            rung(number, step, diagnosis.steps[number - 1].ahead if number else None)
            for number, step in enumerate(diagnosis.steps)
        ],
        "left_over": None
        if diagnosis.after is None or diagnosis.before is None
        else {
            "gain_before": diagnosis.before.gain,
            "gain_after": diagnosis.after.gain,
            "runs": diagnosis.after.gains,
            "formula": {
                "exploratory": True,
                "terms": [
                    {"target": term.target, "expression": term.expression, "gain_left_out": term.gain}
                    for term in diagnosis.after.formula
                ],
            },
        },
        "fitted": [run.name for run in diagnosis.fitted],
        "held_out": [run.name for run in diagnosis.held],
        "gross_errors": diagnosis.plain.gross_errors,
    }


def _set(diagnosis: Diagnosis, name: str, step: Step) -> dict[str, Any]:
    """Return one confusion set as JSON content."""
    effects = [c.effect.name for c, _ in step.chosen_from]
    return {
        "set_id": name,
        "effects": effects,
        "separated_by": step.chosen_from[0][0].effect.separated_by if len(effects) > 1 else "",
        "since_utc_ns": _since(diagnosis, step.chosen_from[0][1]),
        "stability": step.stability,
        "refits": [_refit(c, k) for c, k in step.chosen_from],
    }


def _candidate(diagnosis: Diagnosis, candidate: Candidate, member: dict[str, str]) -> dict[str, Any]:
    result = finding(diagnosis, candidate)
    return {
        "effect": candidate.effect.name,
        "title": candidate.effect.title,
        "set_id": member.get(candidate.effect.name),
        "score": candidate.score,
        "p_adjusted": candidate.p_adjusted,
        "expected_change": _values(candidate.effect, candidate.change, candidate.std),
        "absorption": candidate.absorption,
        "verdict": result.verdict,
        "why": result.why,
    }


def _since(diagnosis: Diagnosis, confirmation: Confirmation) -> int | None:
    """Return when the effect is seen first, UTC ns; None where no manoeuvre shows it by itself.

    Seen in a manoeuvre is what predicts it better with parameters that it had no say in.
    """
    runs = (*diagnosis.fitted, *diagnosis.held)
    gains = (*confirmation.fold_gains, *confirmation.held_out_gains)
    starts = [run.start_utc_ns for run, gain in zip(runs, gains, strict=True) if gain > SEEN_IN_RUN]
    return min(starts, default=None)


def _values(effect: Effect, values: Float, std: Float) -> dict[str, Any]:
    return {
        p.name: {"value": float(v), "std": float(s), "unit": p.unit}
        for p, v, s in zip(effect.parameters, values, std, strict=True)
    }


def _refit(candidate: Candidate, confirmation: Confirmation) -> dict[str, Any]:
    size = len(candidate.effect.parameters)
    return {
        "effect": candidate.effect.name,
        "parameters": _values(candidate.effect, confirmation.fit.values[-size:], confirmation.fit.std[-size:]),
        "likelihood_ratio": confirmation.likelihood_ratio,
        "bic_change": confirmation.bic_change,
        "gains_left_out": confirmation.fold_gains,
        "gains_held_out": confirmation.held_out_gains,
        "at_bound": confirmation.at_bound,
        "converged": confirmation.fit.converged,
    }
