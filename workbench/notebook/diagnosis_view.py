"""What `kempf diagnose` shows, for a notebook: verdict, sentences, ladder, effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import polars as pl

from kempf.schemas.enumeration import as_words
from kempf.workbench.notebook.frames import as_html, frame_of

if TYPE_CHECKING:
    from kempf.warehouse.tables.diagnoses import StoredDiagnosis

_RUNG = {
    **{"step": pl.Int64, "added": pl.String, "in_sample_error": pl.Float64, "held_out_error": pl.Float64},
    **{"log_likelihood": pl.Float64, "converged": pl.Boolean, "parameter_set_id": pl.String},
}
_CANDIDATE = {
    **{"effect": pl.String, "verdict": pl.String, "set_id": pl.String},
    **{"score": pl.Float64, "p_adjusted": pl.Float64, "absorption": pl.Float64, "why": pl.String},
}


def ladder_frame(rungs: Sequence[Mapping[str, Any]]) -> pl.DataFrame:
    """Return the rungs of a ladder as a frame; errors are those of free runs, as a share of the motion."""
    return frame_of(rungs, _RUNG)


@dataclass(frozen=True, eq=False)
class DiagnosisView:
    """Which physical effect a vessel's model lacks; a notebook draws it.

    Attributes
    ----------
    diagnosis : StoredDiagnosis
    """

    diagnosis: StoredDiagnosis

    @cached_property
    def document(self) -> dict[str, Any]:
        """What ``kempf diagnose --json`` prints."""
        return self.diagnosis.as_json()

    @property
    def verdict(self) -> str:
        """``adequate``, ``explained``, ``partly_explained``, ``ambiguous``, ``unexplained``, ``insufficient_data``."""
        return self.diagnosis.verdict

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects that the model lacks, of all sets; empty where none was found."""
        return self.diagnosis.effects

    @property
    def sentences(self) -> tuple[str, ...]:
        """The diagnosis in plain words."""
        return tuple(self.document["sentences"])

    @cached_property
    def ladder(self) -> pl.DataFrame:
        """One row a model, the plain one first, with the free-run errors of fitted and of held-out manoeuvres."""
        return ladder_frame(self.document["ladder"]).drop("parameter_set_id")

    @cached_property
    def candidates(self) -> pl.DataFrame:
        """One row an effect that was asked for, with its verdict and the reason in words."""
        return frame_of(self.document["candidates"], _CANDIDATE)

    def _repr_html_(self) -> str:
        title = f"{self.diagnosis.vessel}: {as_words(self.verdict)}"
        return as_html(title, self.sentences, [self.ladder, self.candidates.filter(pl.col("score").is_not_null())])
