"""What a report shows, as plain content: nothing here computes, draws or reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from kempf.schemas.diagnosis_evidence import DiagnosisEvidence, ManoeuvreEvidence
from kempf.workbench.effect_row import EffectRow
from kempf.workbench.report.wording import ReportWording


@dataclass(frozen=True)
class ShownManoeuvre:
    """One manoeuvre with what its segment has."""

    #: In order of time.
    number: int
    #: Number, angles, first side and time.
    label: str
    #: File name.
    log: str
    psi0_deg: float
    #: Criteria as the segment has them.
    imo: Mapping[str, Any]
    evidence: ManoeuvreEvidence

    @property
    def short(self) -> str:
        """Its name in a table."""
        return f"Manoeuvre\u00a0{self.number}"


@dataclass(frozen=True)
class ReportContent:
    """All that a report shows of one vessel."""

    vessel: str
    #: Headline, advice, titles and captions, all of one verdict.
    wording: ReportWording
    #: The highest score first, what cannot be tested last.
    effects: tuple[EffectRow, ...]
    #: The confusion sets that the report claims, as a diagnosis stores them.
    sets: tuple[Mapping[str, Any], ...]
    #: In order of time.
    manoeuvres: tuple[ShownManoeuvre, ...]
    evidence: DiagnosisEvidence
    #: About the channels of the logs.
    warnings: tuple[str, ...]
    ship: Mapping[str, str]
    #: What and its value, in the order shown.
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
class ChartBlock:
    """A figure that can be zoomed where scripts run; elsewhere, and in print, the picture."""

    label: str
    picture: PictureBlock
    #: As `kempf.workbench.charts.frames.encoded` makes it.
    frame: bytes
    #: ``name``, ``unit``, ``words``, ``source``, ``shown``.
    channels: Sequence[Mapping[str, Any]]
    #: First and last instant, UTC in ISO 8601.
    window: tuple[str, str]
    kind: Literal["chart"] = "chart"


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


Block = PictureBlock | ChartBlock | TableBlock | HeadingBlock | TextBlock
