"""A diagnosis under the keys of ``--json`` that people script against."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.screening.screen import Candidate
from kempf.pipeline.diagnose.steps.confirm import Confirmation
from kempf.pipeline.diagnose.steps.final_sizes import Size, refitted_size
from kempf.pipeline.diagnose.steps.ladder_step import Step, rung
from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis
from kempf.pipeline.diagnose.verdicts.effect_finding import climbed, finding, improves_the_fit, refusal
from kempf.pipeline.diagnose.verdicts.remaining_misfit import as_json as remaining_json
from kempf.pipeline.diagnose.verdicts.sentences import sentences
from kempf.pipeline.diagnose.verdicts.sizes import row_around_size
from kempf.pipeline.diagnose.verdicts.verdict import share_explained, share_of_given, too_few, verdict
from kempf.schemas.effect import Effect

#: log-likelihood that an effect must gain in a manoeuvre to be seen in it
SEEN_IN_RUN = 2.0


def as_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return the diagnosis under the command line's keys, JSON content; what is not finite is None."""
    sets = [_set(diagnosis, f"S{number}", step) for number, step in enumerate(diagnosis.steps[1:], start=1)]
    first = len(diagnosis.steps)
    imitating = [_set(diagnosis, f"S{number}", step) for number, step in enumerate(diagnosis.imitating, start=first)]
    member = {name: confusion_set["set_id"] for confusion_set in sets for name in confusion_set["effects"]}
    return {
        "verdict": verdict(diagnosis),
        "sentences": sentences(diagnosis),
        "candidates": [_candidate(diagnosis, c, member) for c in diagnosis.steps[0].screened],
        "sets": sets,
        "stand_ins": imitating,
        "immaterial": [
            {
                "effects": [c.effect.name for c, _ in immaterial.chosen_from],
                "error_ahead_falls_by": immaterial.weight.fall,
                "in_std": immaterial.weight.t,
                "hull_changes_by": immaterial.weight.shift,
                "hull_changes_by_std": immaterial.weight.shift_in_std,
                "refits": [_refit(c, k) for c, k in immaterial.chosen_from],
            }
            for immaterial in diagnosis.immaterial
        ],
        "suspected": _suspected(diagnosis),
        "share_explained": share_explained(diagnosis),
        "share_explained_before": share_of_given(diagnosis),
        "remaining_misfit": None if diagnosis.remaining is None else remaining_json(diagnosis.remaining),
        "refused": [
            _refit(c, k) | {"why": diagnosis.suspected.get(c.effect.name) or refusal(k)}
            for step in climbed(diagnosis)
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
        "too_few_manoeuvres": too_few(diagnosis),
        "unresolved": None
        if diagnosis.unresolved is None
        else {**asdict(diagnosis.unresolved), "needed": diagnosis.unresolved.needed},
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
        "within_rows_of_s": row_around_size(diagnosis, step, step.chosen_from[0][0].effect),
        "refits": [_refit(c, k, diagnosis.sizes.get(c.effect.name)) for c, k in step.chosen_from],
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


def _suspected(diagnosis: Diagnosis) -> list[dict[str, str]]:
    every = {**diagnosis.suspected, **improves_the_fit(diagnosis)}
    return [{"effect": name, "why": words} for name, words in sorted(every.items())]


def _refit(candidate: Candidate, confirmation: Confirmation, size: Size | None = None) -> dict[str, Any]:
    size = size or refitted_size(candidate.effect, confirmation)
    return {
        "effect": candidate.effect.name,
        "parameters": _values(candidate.effect, size.values, size.std),
        "widened": size.widened,
        "likelihood_ratio": confirmation.likelihood_ratio,
        "bic_change": confirmation.bic_change,
        "gains_left_out": confirmation.gains_left_out,
        "gains_held_out": confirmation.held_out_gains,
        "at_bound": confirmation.at_bound,
        "converged": confirmation.fit.converged,
    }
