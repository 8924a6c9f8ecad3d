"""What a report says first: the verdict in one sentence, and what to do next."""

from __future__ import annotations

from shlex import quote

from kempf.pipeline.diagnose.diagnosis import Diagnosis
from kempf.pipeline.diagnose.verdict import finding, verdict


def headline(diagnosis: Diagnosis) -> str:
    """Return the verdict in one sentence.

    Parameters
    ----------
    diagnosis : Diagnosis
    """
    what = verdict(diagnosis)
    added = _listed([step.added.title for step in diagnosis.steps[1:] if step.added is not None])
    if what == "insufficient_data":
        return "There are too few manoeuvres to tell a missing effect from chance."
    if what == "adequate":
        return "The plain model is adequate: none of the effects tried predicts manoeuvres better that were not fitted."
    if what == "explained":
        return f"The plain model lacks {added}; with it, nothing that repeats itself is left."
    if what == "ambiguous":
        return f"The plain model lacks {added}, or something that these data cannot tell from it."
    if added:
        return f"The plain model lacks {added}, and something more that none of the known effects explains."
    return "The plain model lacks something that none of the known effects explains."


def next_steps(diagnosis: Diagnosis, vessel: str) -> tuple[str, ...]:
    """Return what a person should do now, the most useful first.

    Parameters
    ----------
    diagnosis : Diagnosis
    vessel : str
    """
    what = verdict(diagnosis)
    name = quote(vessel)
    told: list[str] = []
    if what == "insufficient_data":
        told.append("Sail at least three zigzags, to both sides, at two rudder angles and on two headings.")
    for step in diagnosis.steps[1:]:
        effect, others = step.chosen_from[0][0].effect, [c.effect for c, _ in step.chosen_from[1:]]
        told.append(f"Add it to her model: kempf effects add {effect.name} --vessel {name}.")
        if others:
            names = _listed([effect.title, *(one.title for one in others)])
            told.append(f"To tell {names} apart: {_sentence(effect.separated_by)}")
    if what == "unexplained":
        told.append(
            "See where the misfit sits: the strips of innovations, the correlations and the missing force below. "
            f'Try a term of your own: kempf effects try "yaw: r*abs(r)" --vessel {name}.'
        )
    lacking: dict[str, list[str]] = {}
    for candidate in diagnosis.steps[0].screened:
        if candidate.missing and finding(diagnosis, candidate).verdict == "not_testable":
            lacking.setdefault(_listed([c.replace("_", " ") for c in candidate.missing]), []).append(
                candidate.effect.title
            )
    told += [f"Log {channel}: without it {_listed(names)} cannot be tested." for channel, names in lacking.items()]
    if not diagnosis.held:
        told.append("Sail one manoeuvre more: three are needed to hold one out and judge the prediction by it.")
    if not told:
        told.append("Use the model as it is; report its intervals with it.")
    return tuple(told)


def _sentence(text: str) -> str:
    return text if text.endswith(".") else f"{text}."


def _listed(names: list[str]) -> str:
    if not names:
        return ""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
