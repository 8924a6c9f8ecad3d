"""One vessel for a notebook: what the commands with ``--vessel`` do, with results as polars frames."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import polars as pl

from kempf.schemas.errors import DataRejected, KempfError
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.parameter_set import ParameterSet
from kempf.workbench.notebook.comparison_view import ComparisonView
from kempf.workbench.notebook.diagnosis_view import DiagnosisView, ladder_frame
from kempf.workbench.notebook.frames import frame_of, with_instants

_SEGMENT = {
    **{"segment_id": pl.String, "log": pl.String, "kind": pl.String, "psi0_deg": pl.Float64, "delta0_deg": pl.Float64},
    **{"first_side": pl.String, "base_heading_deg": pl.Float64, "start_utc_ns": pl.Int64, "end_utc_ns": pl.Int64},
    "overshoots_deg": pl.List(pl.Float64),
}
_PARAMETER = {
    **{"parameter_set_id": pl.String, "estimator": pl.String, "segment_ids": pl.List(pl.String)},
    **{"parameter": pl.String, "value": pl.Float64, "std": pl.Float64, "unit": pl.String},
    **{"converged": pl.Boolean, "error": pl.String},
}


@dataclass(frozen=True)
class VesselView:
    """A vessel of a warehouse.

    Attributes
    ----------
    warehouse : Warehouse
    name : str
    """

    warehouse: Warehouse
    name: str

    def segments(self) -> pl.DataFrame:
        """Return the manoeuvres in her logs that models are fitted to, one row each, in order of time."""
        from kempf.warehouse.tables import logs, segments

        files = {row.ingest_id: row.file_name for row in logs.current(self.warehouse, self.name)}
        manoeuvres = segments.current(self.warehouse, self.name)
        rows = [{**vars(s), "log": files[s.ingest_id]} for s in manoeuvres if s.ingest_id in files]
        return frame_of(rows, _SEGMENT)

    def identify(self, model: str | os.PathLike[str] | None = None, estimator: str = "ml") -> pl.DataFrame:
        """Identify a model from every zigzag, and one hull from all of them together; all is stored.

        Parameters
        ----------
        model : path or str, optional
            Model specification in YAML, or a parameter set whose model it is, by id or alias.
        estimator : str, optional
            See `kempf.pipeline.estimate.names.NAMES`.

        Returns
        -------
        polars.DataFrame
            One row a parameter of a set, with its value and its standard error ``std`` in ``unit``; the sets of single
            zigzags in order of time, then the pooled one. A zigzag that gave no set has a row with its ``error``; those
            that are not pooled have one at the end that says why.

        Raises
        ------
        KempfError
            No zigzag could be identified from, or there is none.
        """
        from kempf.flows.jobs.identify.default_model import default_model_of
        from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
        from kempf.flows.jobs.identify.pool_vessel import not_pooled, pool_vessel
        from kempf.flows.jobs.identify.standing_model import Own
        from kempf.workbench.chosen_model import named_model

        name = None if model is None else os.fspath(model)
        spec, own = (
            named_model(self.warehouse, self.name, name)
            if name
            else (default_model_of(self.warehouse, self.name), Own())
        )
        request = Request(spec, estimator, own=own)
        outcomes = identify_vessel(self.warehouse, self.name, request)
        failed = [outcome.error for outcome in outcomes if outcome.error is not None]
        if len(failed) == len(outcomes):
            raise failed[0]
        rows = [row for o in outcomes for row in _parameters(o.parameter_set, [o.segment.segment_id], o.error)]
        try:
            pooled = pool_vessel(self.warehouse, self.name, request, outcomes)
            rows += _parameters(pooled[0], pooled[0].segment_ids) if pooled else []
            alone = not_pooled(self.warehouse, self.name, request, outcomes, pooled[0] if pooled else None)
        except KempfError as error:
            alone = not_pooled(self.warehouse, self.name, request, outcomes, error)
        for why in dict.fromkeys(alone.values()):
            rows += _parameters(None, [name for name, reason in alone.items() if reason == why], f"not pooled: {why}")
        return frame_of(rows, _PARAMETER)

    def parameter_sets(self) -> pl.DataFrame:
        """Return her parameter sets, one row each: id, start of the first zigzag, model, estimator, parent."""
        from kempf.warehouse.tables import parameter_sets

        return with_instants(parameter_sets.summaries(self.warehouse, self.name).drop("vessel"))

    def compare(self, set_id: str | None = None, horizon: str = "free") -> ComparisonView:
        """Put every run beside what a parameter set predicts of it.

        Parameters
        ----------
        set_id : str, optional
            Parameter set, by id or alias; by default her current one.
        horizon : str, optional
            ``1`` (one step), a time such as ``10s`` or ``60s``, or ``free``.

        Raises
        ------
        KempfError
            See `kempf.flows.jobs.compare.compare_vessel.compare_vessel`.
        """
        from kempf.flows.jobs.compare.compare_vessel import compare_vessel

        return ComparisonView(compare_vessel(self.warehouse, self.name, set_id, horizon))

    def predict(self, segment_id: str, set_id: str | None = None, horizon: str = "free") -> pl.DataFrame:
        """Predict one zigzag: measured and predicted series beside each other, see `ComparisonView.series`.

        A free run is given the logged rudder and speed alone, and begins in a state fitted to the run itself.

        Parameters
        ----------
        segment_id : str
        set_id, horizon : str, optional
            As for `compare`.

        Raises
        ------
        NotFound
            ``no_segment``.
        DataRejected
            ``nothing_to_compare``: this zigzag cannot be predicted; the message says why.
        """
        from kempf.warehouse.tables import segments

        segments.get(self.warehouse, segment_id)
        view = self.compare(set_id, horizon)
        series = view.series.filter(segment_id=segment_id)
        if series.is_empty():
            why = view.comparison.skipped.get(segment_id, f"it is no zigzag of {self.name!r}")
            raise DataRejected(
                "nothing_to_compare", f"{segment_id} is not predicted: {why}.", "Predict another zigzag.", {}
            )
        return series

    def diagnose(self) -> DiagnosisView:
        """Find which physical effect the plain model of eq. (16) lacks, and say how sure that is."""
        from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_vessel
        from kempf.flows.jobs.identify.default_model import default_model_of

        return DiagnosisView(diagnose_vessel(self.warehouse, self.name, default_model_of(self.warehouse, self.name))[0])

    def add_effect(self, name: str) -> pl.DataFrame:
        """Add an effect of the catalogue to her model and refit; return the ladder from the plain model to this one."""
        from kempf.flows.jobs.diagnose.add_effect import add_effect

        add_effect(self.warehouse, self.name, name)
        return self.ladder()

    def undo_effect(self) -> pl.DataFrame:
        """Go back to the model before the last effect was added; nothing is deleted. Return the ladder to it."""
        from kempf.flows.jobs.identify.standing_model import undo

        undo(self.warehouse, self.name)
        return self.ladder()

    def ladder(self) -> pl.DataFrame:
        """Return the models that lead to hers, one row each, with their free-run errors; no row where she has none."""
        from kempf.flows.jobs.identify.standing_model import rungs_to, standing

        model = standing(self.warehouse, self.name)
        return ladder_frame([] if model is None else rungs_to(self.warehouse, model))

    def history(self, parameter: str | None = None) -> pl.DataFrame:
        """Return her parameters over time, one row a parameter of a set, with its standard error ``std``.

        Parameters
        ----------
        parameter : str, optional
            Only this one, such as ``b2``.

        Raises
        ------
        UsageError
            ``no_parameter``.
        """
        from kempf.warehouse.queries.history import of_vessel

        return with_instants(of_vessel(self.warehouse, self.name, parameter).frame)


def _parameters(
    parameter_set: ParameterSet | None, segment_ids: Sequence[str], error: KempfError | str | None = None
) -> list[dict[str, Any]]:
    """Return one row a parameter of a set, or one that says why there is no set."""
    if parameter_set is None:
        return [{"segment_ids": segment_ids, "error": str(error)}]
    common = {
        "parameter_set_id": parameter_set.parameter_set_id,
        "estimator": parameter_set.estimator,
        "segment_ids": segment_ids,
        "converged": parameter_set.convergence.get("converged"),
    }
    return [{**common, **vars(parameter), "parameter": parameter.name} for parameter in parameter_set.parameters]
