"""What `kempf compare` shows, for a notebook: fit, series and figure."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import polars as pl

from kempf.workbench.notebook.frames import as_html, with_instants

if TYPE_CHECKING:
    from kempf.flows.jobs.compare.compare_vessel import Comparison


@dataclass(frozen=True, eq=False)
class ComparisonView:
    """A vessel's runs beside what a parameter set predicts of them; a notebook draws it.

    Attributes
    ----------
    comparison : Comparison
    """

    comparison: Comparison

    @cached_property
    def document(self) -> dict[str, Any]:
        """What ``kempf compare --json`` prints."""
        return self.comparison.as_json()

    @cached_property
    def table(self) -> pl.DataFrame:
        """One row a run and channel, with ``sample``, ``fit_percent``, ``rms`` in ``unit`` and ``n``."""
        rows = [
            {
                "segment_id": run["segment_id"],
                "sample": run["sample"],
                "channel": channel,
                "fit_percent": fit,
                "rms": run["rms_display"][channel]["value"],
                "unit": run["rms_display"][channel]["unit"],
                "n": run["n"][channel],
            }
            for run in self.document["runs"]
            for channel, fit in run["fit_percent"].items()
        ]
        return pl.DataFrame(rows)

    @cached_property
    def series(self) -> pl.DataFrame:
        """Measured and predicted series of every run, one row an instant; columns of `pipeline.compare.run_series`.

        Before them ``segment_id`` and ``sample`` (fitted or held_out); null where nothing was measured or predicted.
        """
        from kempf.pipeline.compare.run_series import run_series

        frames = [
            with_instants(pl.DataFrame(run_series(run)))
            .fill_nan(None)
            .select(pl.lit(run.name).alias("segment_id"), pl.lit(run.sample).alias("sample"), pl.all())
            for run in self.comparison.runs
        ]
        return pl.concat(frames, how="diagonal")

    @property
    def figure(self) -> Any:
        """Measured over predicted, a new matplotlib figure."""
        from kempf.workbench.figures.measured_over_predicted import measured_over_predicted

        return measured_over_predicted(self.comparison.runs, self._title)

    def where(self) -> dict[str, Any]:
        """Say where the model fails, see `kempf.pipeline.compare.misfit.where`; fitted and held-out runs apart."""
        return self.comparison.where()

    @property
    def _title(self) -> str:
        shown = self.comparison
        return f"{shown.vessel}, {shown.parameter_set.parameter_set_id}: {shown.horizon.words}"

    def _repr_html_(self) -> str:
        from kempf.workbench.figures.measured_over_predicted import as_png

        return as_html(self._title, (), [self.table], as_png(self.figure))
