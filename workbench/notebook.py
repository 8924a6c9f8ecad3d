"""For a notebook: what `kempf compare` tells, as an object that draws itself."""

from __future__ import annotations

import html
from base64 import b64encode
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from kempf.workbench.figures.measured_over_predicted import as_png, measured_over_predicted

if TYPE_CHECKING:
    import polars as pl

    from kempf.flows.jobs.compare_vessel import Comparison

_WORDS = {"held_out": "held out", "fitted": "fitted"}


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
        return self.comparison.show()

    @cached_property
    def figure(self) -> Any:
        """Measured over predicted, a matplotlib figure."""
        return measured_over_predicted(self.comparison.runs, self._title)

    @cached_property
    def table(self) -> pl.DataFrame:
        """One row a run and channel, with ``sample``, ``fit_percent``, ``rms`` in ``unit`` and ``n``."""
        import polars as pl

        rows = [
            {
                "segment_id": run["segment_id"],
                "sample": run["sample"],
                "channel": channel,
                "fit_percent": fit,
                "rms": run["rms_told"][channel]["value"],
                "unit": run["rms_told"][channel]["unit"],
                "n": run["n"][channel],
            }
            for run in self.document["runs"]
            for channel, fit in run["fit_percent"].items()
        ]
        return pl.DataFrame(rows)

    def where(self) -> dict[str, Any]:
        """Say where the model fails, see `kempf.pipeline.compare.misfit.where`; fitted and held-out runs apart."""
        return self.comparison.where()

    @property
    def _title(self) -> str:
        one = self.comparison
        return f"{one.vessel}, {one.parameter_set.parameter_set_id}: {one.horizon.words}"

    @cached_property
    def _picture(self) -> str:
        # of a figure of its own: drawing one a second time moves its panels
        fresh = measured_over_predicted(self.comparison.runs, self._title)
        return b64encode(as_png(fresh)).decode("ascii")

    def _repr_html_(self) -> str:
        title = html.escape(self._title)
        head = "".join(f"<th>{name}</th>" for name in ("run", "sample", "channel", "fit %", "rms", "n"))
        rows = "".join(
            f"<tr><td>{html.escape(r['segment_id'])}</td><td>{_WORDS[r['sample']]}</td><td>{r['channel']}</td>"
            f"<td>{r['fit_percent']:.2f}</td><td>{r['rms']:.3g} {r['unit']}</td><td>{r['n']}</td></tr>"
            for r in self.table.rows(named=True)
        )
        return (
            f"<figure><figcaption>{title}</figcaption>"
            f'<img alt="Measured over predicted: {title}" src="data:image/png;base64,{self._picture}"/></figure>'
            f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
        )


def compare(warehouse: str, vessel: str, set_id: str | None = None, horizon: str = "free") -> ComparisonView:
    """Put every run of a vessel beside what a parameter set predicts of it.

    Parameters
    ----------
    warehouse : str
        A folder, or ``s3://bucket/prefix``.
    vessel : str
    set_id : str, optional
        Parameter set, by id or alias; by default the vessel's current one.
    horizon : str, optional
        ``1`` (one step), a time such as ``10s`` or ``60s``, or ``free``.

    Returns
    -------
    ComparisonView
        The last line of a notebook's cell draws it.

    Raises
    ------
    KempfError
        See `kempf.flows.jobs.compare_vessel.compare_vessel`.
    """
    from kempf.flows.jobs.compare_vessel import compare_vessel
    from kempf.warehouse.store import Warehouse

    return ComparisonView(compare_vessel(Warehouse(warehouse), vessel, set_id, horizon))
