"""What a person should read first of a diagnosis, in words that a naval architect can act on."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.diagnose.steps.immaterial import LEAST_PART, LEAST_SHIFT, weighed
from kempf.pipeline.diagnose.steps.ladder_step import Step
from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis
from kempf.pipeline.diagnose.verdicts.effect_finding import changes, imitates
from kempf.pipeline.diagnose.verdicts.remainder import reference_gains
from kempf.pipeline.diagnose.verdicts.remaining_misfit import said as remaining_said
from kempf.pipeline.diagnose.verdicts.sizes import sized_by_refit, stated
from kempf.pipeline.diagnose.verdicts.verdict import share_explained, share_of_given, too_few, verdict
from kempf.pipeline.predict.free_run import FreeRun
from kempf.pipeline.predict.median_error import LEFT_THE_COURSE, median_error
from kempf.pipeline.shooting.ahead import Ahead
from kempf.schemas.enumeration import at_the_beginning, counted, listed

#: share of the misfit below which nothing of it is explained
_LEAST_SHARE = 0.005
#: so many free runs that leave the course are named
_NAMED = 3
#: of what is left where nothing is seen in it
_REST = "; neither a known effect nor a smooth force of unknown origin improves on the rest"
#: said where instants of measurement were found
_LAID_OUT = (
    "The logs do not show when an instrument measured, only within which row or second: here the manoeuvres are laid "
    "out at the instants that fit the model best, so that errors are smaller than those of her stored parameter sets, "
    "which take the middle."
)
#: said of the free runs of such a ship
_UNSTABLE = (
    " With these parameters she does not keep a straight course by herself, so that the free run of any model leaves "
    "hers: what counts is the error one leg ahead."
)


def sentences(diagnosis: Diagnosis) -> list[str]:
    """Return what a person should read first, a sentence each."""
    return [*_findings(diagnosis), *((_LAID_OUT,) if diagnosis.found else ())]


def _findings(diagnosis: Diagnosis) -> list[str]:
    lines = _given(diagnosis)
    outcome = verdict(diagnosis)
    for step in diagnosis.steps[1:]:
        (candidate, _), *others = step.chosen_from
        line = f"{candidate.effect.plain.rstrip('.')}: {stated(diagnosis, step, candidate.effect)}"
        if others:
            line += f"; the same data would fit {listed([c.effect.title for c, _ in others])}"
            line += f". What distinguishes them: {candidate.effect.separated_by}"
        lines.append(line.rstrip(".") + ".")
    lines += _moving_the_hull(diagnosis)
    lines += _together(diagnosis)
    if len(diagnosis.steps) > 1:
        lines += _ahead(diagnosis)
        lines.append(_fall(diagnosis.steps[0], diagnosis.steps[-1]))
    lines += _unresolved(diagnosis)
    if outcome == "insufficient_data":
        return [*lines, *_too_few(diagnosis)]
    for step in diagnosis.imitating:
        (candidate, best), *_ = step.chosen_from
        size = sized_by_refit(candidate.effect, best)
        lines.append(f"{at_the_beginning(size)}: {imitates(diagnosis)}.")
    for immaterial in diagnosis.immaterial:
        (candidate, best), *_ = immaterial.chosen_from
        lines.append(f"Certain but immaterial: {sized_by_refit(candidate.effect, best)}; {changes(immaterial)}.")
    if outcome == "adequate":
        lines.append("No effect of the catalogue improves the prediction of manoeuvres that were not fitted.")
    if diagnosis.something_left and diagnosis.after is not None and diagnosis.unresolved is None:
        if outcome == "partly_explained" or reference_gains(diagnosis.before, diagnosis.after):
            lines.append(
                "None of the known effects explains what remains: a smooth force of unknown origin still gains "
                f"{diagnosis.after.gain:.0f} of log-likelihood in manoeuvres that it was not fitted to."
            )
        else:
            lines.append(
                f"None of the known effects explains the misfit: {len(diagnosis.steps) - 1} of them were needed, and "
                "the first explains too little to be the cause."
            )
        if diagnosis.after.formula:
            terms = "; ".join(f"{term.target}: {term.expression}" for term in diagnosis.after.formula)
            lines.append(f"Exploratory, not a finding; a formula to try: {terms}.")
    if len(diagnosis.steps) == 1:
        lines += _left(diagnosis)
        lines += _disagreement(diagnosis.steps[0].ahead, "")
    return lines


def _too_few(diagnosis: Diagnosis) -> list[str]:
    if not too_few(diagnosis):
        return []
    few = (
        "One manoeuvre alone cannot distinguish an effect from chance"
        if diagnosis.before is None
        else "Two manoeuvres are too few to choose an effect by its predictions"
    )
    return [f"{few}: sail at least three zigzags, to both sides, at two rudder angles, on two headings."]


def _unresolved(diagnosis: Diagnosis) -> list[str]:
    """Say that readings are too far apart for such a ship."""
    found = diagnosis.unresolved
    if found is None:
        return []
    what = "What she lacks" if len(diagnosis.steps) == 1 else "What else she lacks"
    return [
        f"{what} cannot be tested with these data: {found.says}. What she does between two readings is not recorded, "
        f"and a misfit that this leaves is no sign of missing physics. {found.needed}"
    ]


def _given(diagnosis: Diagnosis) -> list[str]:
    """Say what the effects bring that the model has already."""
    share = share_of_given(diagnosis)
    if share is None:
        return []
    plain, now = diagnosis.given[0].ahead, diagnosis.steps[0].ahead
    assert plain is not None
    assert now is not None
    titles = [effect.title for effect in now.model.effects]
    if share <= 0.0:
        return [
            f"Already in the model: {listed(titles)}. Of the plain model's misfit one leg ahead, in manoeuvres left "
            "out, nothing is explained by that. What follows is about the whole of it."
        ]
    return [
        f"Already in the model: {listed(titles)}. Of the plain model's misfit (mean square) one leg ahead, in "
        f"manoeuvres left out, {'this explains' if len(titles) == 1 else 'these explain'} {100.0 * share:.0f} %; the "
        f"error goes from {np.mean(plain.percent(plain.left_out)):.1f} to "
        f"{np.mean(now.percent(now.left_out)):.1f} % of the motion. What follows is about the rest."
    ]


def _moving_the_hull(diagnosis: Diagnosis) -> list[str]:
    """Say of effects that hardly change a prediction why they matter all the same."""
    lines = []
    for before, step in pairwise(diagnosis.steps):
        if step.added is None or step.stability is not None:
            continue
        weight = weighed(before.ahead, step.ahead, before.fit, step.fit)
        if weight.fall <= LEAST_PART and weight.shift > LEAST_SHIFT:
            lines.append(
                f"{at_the_beginning(step.added.title)} hardly changes a prediction one leg ahead "
                f"({-100.0 * weight.fall:+.1f} % of the misfit), but without it a parameter of the hull is off by "
                f"{100.0 * weight.shift:.0f} %."
            )
    return lines


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
        f"{at_the_beginning(phrase)} belong together: each of them alone makes no prediction clearly better. "
        "They were chosen by manoeuvres left out, and the held-out ones, which had no part in the choice, confirm them."
        for phrase in words
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
    lines = [
        f"One leg ahead ({last.horizon_s:.3g} s) the error, of the motion, goes {listed(falls)}; left out, it goes "
        f"from {before[best]:.1f} to {after[best]:.1f} % in the manoeuvre that gains most, from {before[worst]:.1f} to "
        f"{after[worst]:.1f} % in the one that {'gains least' if after[worst] <= before[worst] else 'loses most'}."
    ]
    share = share_explained(diagnosis)
    if share is not None:
        doubtful = last.disagrees is not None or diagnosis.unresolved is not None
        seen = diagnosis.something_left or diagnosis.immaterial or diagnosis.suspected
        rest = "" if seen or doubtful else _REST
        explained = f"{100.0 * share:.0f} %" if share >= _LEAST_SHARE else "nothing"
        lines.append(
            f"Of the misfit (mean square) one leg ahead, in manoeuvres left out, {explained} is explained{rest}."
        )
    lines += _left(diagnosis)
    return lines if diagnosis.unresolved is not None else lines + _disagreement(last, "still ")


def _disagreement(model: Ahead | None, still: str) -> list[str]:
    """Say by how much legs are predicted better by the parameters fitted to them than by the likelihood's."""
    if model is None or model.disagrees is None:
        return []
    return [
        f"Fits one step and one leg ahead {still}disagree: with parameters fitted to legs the misfit is "
        f"{100.0 * model.disagrees.falls_by:.0f} % smaller, so that something is {still}lacking; predictions of "
        "manoeuvres take those."
    ]


def _fall(first: Step, last: Step) -> str:
    a, b = first.held_out_error, last.held_out_error
    force = last.intensities[0] / first.intensities[0]
    share = f"{100 * force:.0f}"
    disturbance = "the intensity of the lateral disturbance " + (
        "staying as it was." if share == "100" else f"to {share} % of what it was."
    )
    if last.predicts_by_legs:
        return _fall_by_legs(first, last, disturbance)
    fitted = f"from {_share(first.in_sample_error)} to {_share(last.in_sample_error)} %"
    if a is None or b is None:
        alone = f"The free-run error of fitted manoeuvres (none is held out) goes {fitted} of the motion, {disturbance}"
        return alone + _fitted_to_legs(first)
    held = counted(len(last.held), "held-out manoeuvre")
    sentence = (
        f"The free-run error of {held} goes from {_share(a)} to {_share(b)} % of the motion, of the fitted ones "
        f"{fitted}, {disturbance}"
    )
    if not _keeps_course(last.fit.hull):
        sentence += _UNSTABLE
    elif b > a:
        sentence += (
            " The held-out error is no smaller: what speaks for the effects is the likelihood of held-out measurements "
            "and the disturbance."
        )
    return sentence + _fitted_to_legs(first)


def _fitted_to_legs(first: Step) -> str:
    """Say what the free runs of the first model are with the parameters that its predictions take.

    Those of the likelihood, which carry the fault of that model, are not what the last one has to be better than.
    """
    if not first.predicts_by_legs or not first.by_legs:
        return ""
    fitted, held = first.free_runs(by_legs=True)
    errors = [
        f"{_share(float(np.mean([run.relative_error for run in runs])))} % in {name} manoeuvres"
        for name, runs in (("held-out", held), ("fitted", fitted))
        if runs
    ]
    return (
        f" Predictions with the first model take parameters fitted to legs: with these its free-run error is "
        f"{listed(errors)}."
    )


def _fall_by_legs(first: Step, last: Step, disturbance: str) -> str:
    """Say how the free runs change with the parameters that predictions take; medians, as some may run away."""
    before, after = first.free_runs(by_legs=True), last.free_runs(by_legs=True)
    falls = [
        f"from {_median(a)} to {_median(b)} % of the motion in {name} manoeuvres"
        for name, a, b in zip(("fitted", "held-out"), before, after, strict=True)
        if b
    ]
    off = [run.name for run in last.by_legs if not run.relative_error < LEFT_THE_COURSE]
    sentence = f"With parameters fitted to legs the median free-run error goes {listed(falls)}, {disturbance}"
    assert last.ahead is not None
    if not _keeps_course(last.ahead.fit.hull):
        sentence += _UNSTABLE
    if not off:
        return sentence
    which = f" ({listed(off)})" if len(off) <= _NAMED else ""
    return f"{sentence} {len(off)} of {len(last.by_legs)} free runs leave the measured course altogether{which}."


def _median(runs: Sequence[FreeRun]) -> str:
    return _share(median_error(run.relative_error for run in runs))


def _keeps_course(hull: Float) -> bool:
    """Return whether a hull goes straight ahead with the rudder amidships: both roots of eq. (16) are damped."""
    a11, a12, a21, a22 = hull[:4]
    return bool(a11 + a22 < 0.0 and a11 * a22 - a12 * a21 > 0.0)


def _share(error: float) -> str:
    return "divergence" if np.isnan(error) else f"{100 * error:.1f}"
