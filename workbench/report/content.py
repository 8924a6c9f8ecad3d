"""What a report shows, as plain content: nothing here computes, draws or reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, Literal

from kempf.schemas.diagnosis_evidence import DiagnosisEvidence, FittedParameter, ManoeuvreEvidence
from kempf.workbench.report.wording import ReportWording


@dataclass(frozen=True)
class EffectRow:
    """One effect of the catalogue beside the first model.

    Attributes
    ----------
    title, verdict, why : str
        The verdict in the report's words.
    set_id : str
        Of the confusion set that the report claims it in; empty where it claims none.
    score, p_adjusted, absorption : float
        NaN where it cannot be tested.
    changes : tuple of FittedParameter
        Expected size of each of its parameters.
    """

    title: str
    verdict: str
    why: str
    set_id: str
    score: float
    p_adjusted: float
    absorption: float
    changes: tuple[FittedParameter, ...]

    @property
    def tested(self) -> bool:
        """Whether it has a score."""
        return isfinite(self.score)


@dataclass(frozen=True)
class ShownManoeuvre:
    """One manoeuvre with what its segment has.

    Attributes
    ----------
    number : int
        In order of time.
    label : str
        Number, angles, first side and time.
    log : str
        File name.
    psi0_deg : float
    imo : mapping
        Criteria as the segment has them.
    evidence : ManoeuvreEvidence
    """

    number: int
    label: str
    log: str
    psi0_deg: float
    imo: Mapping[str, Any]
    evidence: ManoeuvreEvidence

    @property
    def short(self) -> str:
        """Its name in a table."""
        return f"Manoeuvre\u00a0{self.number}"


@dataclass(frozen=True)
class ReportContent:
    """All that a report shows of one vessel.

    Attributes
    ----------
    vessel : str
    wording : ReportWording
        Headline, advice, titles and captions, all of one verdict.
    effects : tuple of EffectRow
        The highest score first, what cannot be tested last.
    sets : tuple of mapping
        The confusion sets that the report claims, as a diagnosis stores them.
    manoeuvres : tuple of ShownManoeuvre
        In order of time.
    evidence : DiagnosisEvidence
    warnings : tuple of str
        About the channels of the logs.
    ship : mapping of str to str
    provenance : tuple of (str, str)
        What and its value, in the order shown.
    """

    vessel: str
    wording: ReportWording
    effects: tuple[EffectRow, ...]
    sets: tuple[Mapping[str, Any], ...]
    manoeuvres: tuple[ShownManoeuvre, ...]
    evidence: DiagnosisEvidence
    warnings: tuple[str, ...]
    ship: Mapping[str, str]
    provenance: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class SampleBadge:
    """Whether a manoeuvre was fitted or held out."""

    held_out: bool

    @property
    def text(self) -> str:
        """As it is shown."""
        return "held out" if self.held_out else "fitted"


Cell = str | SampleBadge


@dataclass(frozen=True)
class PictureBlock:
    """A figure: its SVG, its text for those who do not see it, its caption."""

    svg: bytes
    alt: str
    caption: str
    kind: Literal["picture"] = "picture"


@dataclass(frozen=True)
class TableBlock:
    """A table; the columns ``numeric`` are set to the right."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    numeric: Sequence[int] = ()
    kind: Literal["table"] = "table"


@dataclass(frozen=True)
class HeadingBlock:
    """A heading over one manoeuvre."""

    text: str
    badge: SampleBadge
    kind: Literal["heading"] = "heading"


@dataclass(frozen=True)
class TextBlock:
    """A paragraph."""

    text: str
    kind: Literal["text"] = "text"


Block = PictureBlock | TableBlock | HeadingBlock | TextBlock
