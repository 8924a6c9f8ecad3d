"""The words of a report, all of one verdict: headline, advice, names of the models, titles and leads of the sections.

Nothing else in the report says what the model lacks: only ``explained``, ``ambiguous`` and ``partly_explained`` claim
an effect.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from shlex import quote
from typing import Any

from kempf.schemas.diagnosis_evidence import DiagnosisEvidence
from kempf.schemas.enumeration import as_words, counted, listed

#: the verdicts that claim an effect
CLAIMING = ("explained", "ambiguous", "partly_explained")
_EFFECT_VERDICTS = {
    "present": "present",
    "immaterial": "certain but immaterial",
    "suspected": "suspected",
    "negligible": "too small to matter",
    "not_testable": "cannot be tested",
    "absent": "not confirmed",
}


@dataclass(frozen=True)
class SectionWords:
    """Title and lead of a section."""

    title: str
    lead: str


@dataclass(frozen=True)
class ReportWording:
    """What a report says, from its verdict."""

    verdict: str
    title: str
    headline: str
    #: findings, next_steps: Next steps with the most useful first.
    findings: tuple[str, ...]
    next_steps: tuple[str, ...]
    #: What the model is called that the diagnosis began from.
    diagnosed_model: str
    #: first_model, last_model: What the first and the last model of the ladder are called; the first is the plain one.
    first_model: str
    last_model: str
    #: By the anchor of the section, in order.
    sections: Mapping[str, SectionWords]

    @property
    def claims(self) -> bool:
        """Whether an effect is claimed."""
        return self.verdict in CLAIMING

    def effect_verdict(self, verdict: str) -> str:
        """Return what the report calls the verdict on one effect.

        Parameters
        ----------
        verdict : str
            As the diagnosis stores it.
        """
        if verdict == "present" and not self.claims:
            return "not decided"
        return _EFFECT_VERDICTS.get(verdict, verdict)


def wording_of(
    vessel: str, content: Mapping[str, Any], evidence: DiagnosisEvidence, included: Collection[str] = ()
) -> ReportWording:
    """Return the words of a report.

    Parameters
    ----------
    content : mapping
        The diagnosis under the command line's keys.
    included : collection of str
        Names of the effects that the vessel's current model has already.
    """
    verdict = str(content["verdict"])
    first, has = "plain model", evidence.diagnosed.effects
    diagnosed = f"model with {listed(has)}" if has else first
    last = ("model with effects" if verdict in CLAIMING else "model with effects tried") if evidence.improved else first
    if has and evidence.diagnosed is evidence.models[-1]:
        last = "model with effects" if len(has) > 1 else diagnosed
    return ReportWording(
        verdict=verdict,
        title=f"{vessel}: diagnosis of the manoeuvring model",
        headline=_headline(verdict, content, diagnosed, has),
        findings=tuple(content["sentences"]),
        next_steps=tuple(_next_steps(vessel, verdict, content, evidence, included)),
        diagnosed_model=diagnosed,
        first_model=first,
        last_model=last,
        sections=_sections(verdict, evidence, diagnosed, first),
    )


def _headline(verdict: str, content: Mapping[str, Any], first: str, has: Sequence[str]) -> str:
    """Return the verdict in a sentence; ``first`` is what the diagnosed model is called, ``has`` its effects."""
    titles = _titles(content)
    effects = " and ".join(" or ".join(titles[name] for name in group["effects"]) for group in content["sets"])
    return {
        "insufficient_data": f"Not decided: {_undecided(content)}.",
        "adequate": f"The {first} is adequate: no effect that was tried predicts unfitted manoeuvres better.",
        "explained": f"The {first} lacks {effects}{_share(content)}; beside it nothing stands out from noise.",
        "ambiguous": f"The {first} lacks {effects}; these data cannot distinguish between them.",
        "partly_explained": f"The {first} lacks {effects}{_share(content)}; {_beside(content)}.",
        "unexplained": f"{_share_before(content, has)} a systematic misfit remains that no known effect accounts for."
        if has
        else f"Not explained: a systematic misfit of the {first} remains that no known effect accounts for.",
    }[verdict]


def _undecided(content: Mapping[str, Any]) -> str:
    """Return why nothing is decided, a phrase."""
    few = ["too few manoeuvres to distinguish an effect from chance"] if _too_few(content) else []
    apart = content.get("unresolved")
    return " and ".join([*few, *([f"the {apart['channel']} is read too seldom for so quick a ship"] if apart else [])])


def _too_few(content: Mapping[str, Any]) -> bool:
    """Return whether manoeuvres are too few; a diagnosis of earlier code says so by its verdict alone."""
    return bool(content.get("too_few_manoeuvres", content["verdict"] == "insufficient_data"))


def _beside(content: Mapping[str, Any]) -> str:
    """Return what is beside the effects that explain a part."""
    apart = content.get("unresolved")
    if apart:
        return f"what else is missing cannot be tested, as the {apart['channel']} is read too seldom"
    return "something else remains beside it"


def _share_before(content: Mapping[str, Any], has: Sequence[str]) -> str:
    """Return what the effects bring that the model has already, the beginning of a sentence."""
    share = content.get("share_explained_before")
    if share is None or share <= 0.0:
        return f"Even with {listed(has)} in the model"
    explained = f"{100.0 * share:.0f} % of the plain model's misfit one leg ahead"
    return f"With {listed(has)} the model explains {explained}; beside it"


def _share(content: Mapping[str, Any]) -> str:
    percent = round(100.0 * (content.get("share_explained") or 0.0))
    return f", which explains {percent} % of the misfit one leg ahead" if percent > 0 else ""


def _next_steps(
    vessel: str, verdict: str, content: Mapping[str, Any], evidence: DiagnosisEvidence, included: Collection[str]
) -> list[str]:
    name, titles, steps = quote(vessel), _titles(content), []
    apart = content.get("unresolved")
    if apart:
        steps.append(apart["needed"])
    if verdict == "insufficient_data" and _too_few(content):
        steps.append("Sail at least three zigzags, to both sides, at two rudder angles and on two headings.")
    if verdict in ("unexplained", "partly_explained") and not apart:
        steps.append(
            "See where the misfit remains: one-step errors, correlations and unmodelled acceleration below. Then try a "
            f'term of your own: kempf effects try "yaw: r*abs(r)" --vessel {name}.'
        )
    for group in content["sets"] if verdict in CLAIMING else ():
        there = [effect for effect in group["effects"] if effect in included]
        if there:
            steps.append(f"Nothing to include: the current model has {titles[there[0]]} already.")
        else:
            steps.append(f"Include it in the model: kempf effects add {group['effects'][0]} --vessel {name}.")
        if len(group["effects"]) > 1:
            alike = listed([titles[effect] for effect in group["effects"]])
            steps.append(f"To distinguish {alike}: {_sentence(group['separated_by'])}")
    if verdict == "adequate":
        steps.append("Use the model as it is, with the standard errors of its parameters.")
    untested: dict[str, list[str]] = {}
    for candidate in content["candidates"]:
        missing = evidence.candidates[candidate["effect"]].missing_channels
        if missing and candidate["verdict"] == "not_testable":
            channels = listed([as_words(channel) for channel in missing])
            untested.setdefault(channels, []).append(candidate["title"])
    steps += [f"Log {channels}: without it {listed(names)} cannot be tested." for channels, names in untested.items()]
    if verdict != "insufficient_data" and not evidence.models[0].held_out_errors.size:
        steps.append("Sail one manoeuvre more: three are needed to hold one out and judge the prediction by it.")
    return steps


def _sections(verdict: str, evidence: DiagnosisEvidence, diagnosed: str, first: str) -> dict[str, SectionWords]:
    claims, improved, found = verdict in CLAIMING, evidence.improved, evidence.found
    fitted = sum(not manoeuvre.held_out for manoeuvre in evidence.manoeuvres)
    by_legs = ", with the parameters fitted to legs" if evidence.by_legs else ""
    coloured = (
        "Coloured: effects that the refit confirmed; those of one colour and one set cannot be distinguished."
        if claims
        else "No effect is claimed, so none is coloured."
    )
    return {
        "effects": SectionWords(
            "Effects that are missing" if claims else "Effects that were tried",
            f"Every effect of the catalogue was tried beside the {diagnosed} without refitting it. The score is the "
            "evidence for an effect; the expected size, ± 1 s.e., is what it would be if it were included; the "
            f"absorption is the share of it that the {diagnosed} imitates already: near 100 % it cannot be tested. "
            f"{coloured}",
        ),
        "parameters": SectionWords(
            "Parameters",
            "Hull derivatives of eq. (16), divided by powers of the speed, and the parameters of the effects: "
            "value ± 1 s.e. (one standard error, with the noise levels unknown)."
            + (
                " Parameters fitted to legs predict them better than the likelihood's: predictions of manoeuvres take "
                "them, and so do the free runs of this report."
                if evidence.by_legs
                else ""
            ),
        ),
        "ladder": SectionWords(
            ("What including them brings" if claims else "Errors with the effects tried")
            if found
            else "What the effects of the model bring"
            if improved
            else f"Errors of the {first}",
            f"Left: error of a free run, which takes no measurement in, in percent of the motion{by_legs}. "
            "Held-out manoeuvres "
            "were set aside before the first fit. Right: how strong the disturbances must be for the model to hold; "
            "they fall where an effect accounts for what they had to explain before.",
        ),
        "prediction": SectionWords(
            "Measured over predicted",
            "Fit is 100 (1 - |y - ŷ| / |y - mean y|) in percent, 100 being perfect. Horizons: one step takes every "
            f"measurement in; 10 s and 60 s ahead go without for so long; the free run takes none in{by_legs}. "
            "The initial state and a constant wind force and current of each free run are fitted to that manoeuvre, as "
            "few for every model; at the other horizons the filter estimates them on the way, which is why 60 s ahead "
            "may do worse than a free run.",
        ),
        "innovations": SectionWords(
            "One-step errors in time",
            "Each measurement less its prediction one step ahead, in standard deviations of that prediction: 95 of 100 "
            "belong between the dashed lines, without a pattern. Points beyond 5 are drawn at the edge.",
        ),
        "where": SectionWords(
            "One-step errors by phase, side and manoeuvre",
            "Root mean square of the whitened innovations of fitted manoeuvres: 1 when a model is right. The band is "
            "where it lies then with probability 99 %.",
        ),
        "correlations": SectionWords(
            "Correlations of the one-step errors",
            f"Over the {counted(fitted, 'fitted manoeuvre')}. If a model is right, its innovations are "
            "uncorrelated with their past and with rudder, heading, speed and wind: 99 of 100 values lie in the grey "
            "band, 2.58 / √N.",
        ),
        "added": SectionWords(
            "The evidence, point by point",
            f"For {'each effect that was added' if found else 'the strongest candidate, which was not added'}: what "
            "is left of the innovations against what the effect would explain of them, without what the fitted "
            "parameters can imitate. Points along the line are evidence; a cloud about the level is none.",
        ),
        "confusion": SectionWords(
            "Effects that look alike",
            "How much of what one effect would explain another would explain alike, for the highest scores beside the "
            f"{diagnosed}. Pairs near 100 % cannot be distinguished by these manoeuvres.",
        ),
        "force": SectionWords(
            "Unmodelled sway and yaw acceleration",
            "What must act on the ship beside the model at every instant, given all measurements, less the mean of "
            "each manoeuvre: dots, with medians and quartiles over bins. A slope or a bend is the shape of a force "
            "that is not in the model; a level cloud is disturbance alone.",
        ),
        "coverage": SectionWords("What the manoeuvres cover", "Beyond it, the model extrapolates."),
        "zigzags": SectionWords(
            "Manoeuvres and the IMO criteria",
            "Heading as measured and as the free run predicts it on the logged rudder. Overshoots are those measured.",
        ),
        "provenance": SectionWords("Inputs, versions and settings", "What this report was made from."),
    }


def _titles(content: Mapping[str, Any]) -> dict[str, str]:
    return {candidate["effect"]: candidate["title"] for candidate in content["candidates"]}


def _sentence(text: str) -> str:
    return text if text.endswith(".") else f"{text}."
