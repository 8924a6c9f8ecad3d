"""What a diagnosis says of each effect of the catalogue, and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from kempf.pipeline.diagnose.screening.resolution import MAY_IMITATE
from kempf.pipeline.diagnose.screening.screen import Candidate
from kempf.pipeline.diagnose.steps.confirm import BIC_SAVING, Confirmation, unpredicted
from kempf.pipeline.diagnose.steps.immaterial import Immaterial
from kempf.pipeline.diagnose.steps.ladder_step import Step
from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis
from kempf.pipeline.diagnose.verdicts.sizes import sized_by_refit, stated
from kempf.schemas.effect import Effect
from kempf.schemas.enumeration import listed
from kempf.schemas.units import as_read

#: said of an effect that improves the prediction while something that repeats itself is left
NOT_EXPLAINED = "improves the fit, but does not explain the misfit (see what remains)"
#: an effect whose possible size is smaller than this many standard errors cannot be seen
POWER = 3.0
#: a share of the whitened variance below which a significant effect is too small to matter
NEGLIGIBLE = 5e-4


@dataclass(frozen=True)
class EffectFinding:
    """One effect's verdict, and why."""

    #: ``present`` is what matters; ``immaterial`` is certain and changes nothing that a user predicts.
    verdict: Literal["present", "immaterial", "suspected", "negligible", "not_testable", "absent"]
    why: str


def finding(diagnosis: Diagnosis, candidate: Candidate) -> EffectFinding:
    """Return the verdict on one candidate of the first screen.

    Parameters
    ----------
    candidate : Candidate
        Of the plain model's screen.
    """
    effect = candidate.effect
    verdict = _refitted(diagnosis, candidate.effect)
    if verdict is not None:
        return verdict
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
        if effect.name in {c.effect.name for c, _ in step.chosen_from}:
            others = [c.effect.title for c, _ in step.chosen_from if c.effect.name != effect.name]
            alike = f"; these data would fit {listed(others)} as well" if others else ""
            size = stated(diagnosis, step, effect)
            return EffectFinding("present", f"step {number}: {size}{alike}")
    imitating = improves_the_fit(diagnosis).get(effect.name)
    if imitating is not None:
        return EffectFinding("suspected", imitating)
    for immaterial in diagnosis.immaterial:
        for member, confirmation in immaterial.chosen_from:
            if member.effect.name == effect.name:
                return EffectFinding("immaterial", f"{sized_by_refit(effect, confirmation)}; {changes(immaterial)}")
    return None


def improves_the_fit(diagnosis: Diagnosis) -> dict[str, str]:
    """Return why effects that improve the fit alone are suspected, by name.

    An effect in two such steps has the size of the first.
    """
    why: dict[str, str] = {}
    for step in diagnosis.imitating:
        for member, confirmation in step.chosen_from:
            why.setdefault(member.effect.name, f"{imitates(diagnosis)}: {sized_by_refit(member.effect, confirmation)}")
    return why


def imitates(diagnosis: Diagnosis) -> str:
    """Say why effects that improve the fit alone are not claimed."""
    return NOT_EXPLAINED if diagnosis.unresolved is None else MAY_IMITATE


def changes(immaterial: Immaterial) -> str:
    """Say how little an effect changes."""
    moved = 100.0 * immaterial.weight.shift
    by = f"by more than {moved:.1f} % beyond its error" if moved >= 0.05 else "beyond its error"
    return (
        f"with it the misfit one leg ahead changes by {-100.0 * immaterial.weight.fall:+.1f} %, and no parameter of "
        f"the hull moves {by}"
    )


def channels_say(missing: Sequence[str], measured_by: Sequence[str]) -> str:
    """Say which channels leave an effect out of question; empty where none do.

    Parameters
    ----------
    missing, measured_by : sequence of str
        Channels that it needs and the logs lack, and those that show it already.
    """
    if missing:
        return f"not in the logs: {listed(list(missing))}"
    return f"the logs have {listed(list(measured_by))}, which measures it already" if measured_by else ""


def _untestable(candidate: Candidate) -> str:
    """Say why these data do not determine an effect; empty where they do."""
    by_channels = channels_say(candidate.missing, candidate.measured_by)
    if by_channels:
        return by_channels
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
    refits = [k for step in climbed(diagnosis) for c, k in step.refused if c.effect.name == name]
    if added and (last is None or np.isnan(last.score) or last.p_adjusted >= diagnosis.settings.level):
        return EffectFinding("absent", f"no longer significant once {listed(added)} is included")
    if refits:
        return EffectFinding("absent", f"significant by itself; refused after the refit: {refusal(refits[-1])}")
    if diagnosis.before is None:
        return EffectFinding("absent", "significant by itself; one manoeuvre alone does not confirm it")
    return EffectFinding("absent", "significant by itself; not refitted, as others promised more")


def climbed(diagnosis: Diagnosis) -> tuple[Step, ...]:
    """Return every step that was taken, also those whose effects only imitate what is left."""
    return (*diagnosis.steps, *diagnosis.imitating)


def refusal(confirmation: Confirmation) -> str:
    """Say which test a refitted effect did not stand."""
    if not np.isfinite(confirmation.fit.log_likelihood):
        return "the refitted model diverges"
    if confirmation.outdone:
        return "another effect is so much better that its fit was not finished"
    size = _unusable_size(confirmation)
    if size:
        return size
    if confirmation.bic_change >= -BIC_SAVING:
        return f"the improvement does not justify its parameters (BIC {confirmation.bic_change:+.1f})"
    if not confirmation.predicts:
        return unpredicted(confirmation)
    return "another effect is clearly better"


def _unusable_size(confirmation: Confirmation) -> str:
    """Say what is wrong with the size of an effect; empty where nothing is."""
    if confirmation.within_rows:
        return "it may be in the log alone: within a row, or behind a coarse stamp, nobody knows when it was measured"
    if confirmation.at_bound:
        return "its size is at the limit of what is physical"
    return "the refit leaves nothing of it" if confirmation.absent else ""


def _too_weak(candidate: Candidate) -> str:
    """Say that even the largest physical size would not be seen; empty where it would."""
    known = np.isfinite(candidate.std)
    parameters = [p for p, m in zip(candidate.effect.parameters, known, strict=True) if m]
    reach = np.array([max(abs(p.low), abs(p.high)) for p in parameters])
    if np.all(reach < POWER * candidate.std[known]):
        factor, unit = as_read(parameters[0].unit)
        error = f"{factor * candidate.std[known][0]:.2g} {unit}".rstrip()
        return f"its standard error, {error}, is as large as any size that is physical."
    return ""


def _absent(candidate: Candidate) -> str:
    p, known = candidate.effect.parameters[0], np.isfinite(candidate.std)
    if not known[0]:
        return "not seen"
    limit = abs(candidate.change[0]) + 2.0 * candidate.std[0]
    factor, unit = as_read(p.unit)
    return f"not seen; upper limit (95 %): |{p.name}| < {factor * limit:.2g} {unit}".rstrip()


def _percent(share: float) -> str:
    text = f"{100 * share:.2f}" if share < 0.9995 else f"{100 * share:.4f}"
    return f"{text} %"
