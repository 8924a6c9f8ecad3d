"""What a prediction rests on beside a set: the manoeuvres behind it, the speed and the rudder in them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kempf.flows.jobs.identify.loads_of_logs import loads_of_logs
from kempf.flows.jobs.identify.ship_model import ShipOfSet
from kempf.flows.jobs.identify.vessel_runs import LENGTH_M, Like, VesselRuns, assemble
from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.filtered import RunFilter
from kempf.pipeline.estimate.record.grid_run import common_slip
from kempf.pipeline.estimate.record.left_out import left_out
from kempf.pipeline.manoeuvre.covered import covered
from kempf.pipeline.manoeuvre.draws import Identified
from kempf.pipeline.manoeuvre.rudder_rate import RudderRate, rudder_rate
from kempf.pipeline.manoeuvre.sailed import Reach
from kempf.pipeline.manoeuvre.ship import Waters
from kempf.pipeline.manoeuvre.surge.identify import surge_of
from kempf.pipeline.manoeuvre.surge.surge_fit import SurgeFit
from kempf.pipeline.manoeuvre.widening import widening
from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.segment.particulars import Particulars
from kempf.schemas.errors import DataRejected, NotFound
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, vessels
from kempf.warehouse.tables.parameter_set import Bounds, ParameterSet


@dataclass(frozen=True, eq=False)
class Basis:
    """What a set's own manoeuvres say beside the set."""

    profile: VesselProfile
    runs: VesselRuns
    #: Which part of which log every run is of, by its name.
    bounds: Mapping[str, Bounds]
    surge: SurgeFit
    rudder_rate: RudderRate
    #: How far out the manoeuvres go.
    logs: Reach
    #: Length by which her time scale goes.
    scale_m: float

    @property
    def particulars(self) -> Particulars:
        """What the standards need to know of her."""
        return Particulars.of(self.profile)

    @property
    def kept_m(self) -> float | None:
        """Way that a turn of the shaft keeps on a straight course, m, as models take it; None without a shaft speed."""
        logged = [run for run in self.runs.runs if "shaft_speed" in run.channels and run.approach_per_s > 0.0]
        return float(np.median([run.approach_m_s / run.approach_per_s for run in logged])) if logged else None

    @property
    def alike(self) -> Like:
        """What other runs of hers are to share with these."""
        return Like(self.runs.runs[0].step_s, common_slip(self.runs.runs))

    @property
    def approach_m_s(self) -> float:
        """Mean speed of the approaches."""
        return float(np.mean([run.approach_m_s for run in self.runs.runs]))


def basis_of(warehouse: Warehouse, parameter_set: ParameterSet, progress: Progress = silent) -> Basis:
    """Return what the manoeuvres of a set say beside it.

    Raises
    ------
    NotFound
        ``logs_of_set_gone``: none of its logs is there any more, ``no_runs``.
    """
    inputs: dict[str, Any] = dict(parameter_set.provenance.get("inputs") or {})
    rows = {row.log_id: row.ingest_id for row in logs.current(warehouse, parameter_set.vessel)}
    every = list(inputs.get("segments", ()))
    # a pooled set names its segments in the order of the bounds
    names = parameter_set.settings.get("segments") or [f"{b['log_id'][:8]}-{k}" for k, b in enumerate(every)]
    bounds = [
        (name, Bounds(b["log_id"], b["start_utc_ns"], b["end_utc_ns"]))
        for name, b in zip(names, every, strict=True)
        if b["log_id"] in rows
    ]
    if not bounds:
        raise NotFound(
            "logs_of_set_gone",
            f"None of the logs that {parameter_set.parameter_set_id} was identified from is in the warehouse.",
            "Ingest them again: the speed in turns and the rudder's rate are read from them.",
        )
    log_ids = list(dict.fromkeys(each.log_id for _, each in bounds))
    instruments = {}
    for done, log_id in enumerate(log_ids):
        progress(done, len(log_ids), "reading the logs of the set")
        instruments[log_id] = channels_of(warehouse, rows[log_id])
    profile = vessels.get(warehouse, str(inputs["profile_sha256"]))
    laden = loads_of_logs(bounds, inputs.get("draughts_m", {}))
    runs = assemble(instruments, profile, bounds, ModelSpec.model_validate(dict(parameter_set.model_spec)), laden=laden)
    scale = profile.length_m or _scale_m(parameter_set)
    surge = surge_of(runs.runs, scale, runs.spec.rudder_speed_exponent)
    return Basis(profile, runs, dict(bounds), surge, rudder_rate(runs.records), covered(runs.runs, scale), scale)


def identified(ship: ShipOfSet, basis: Basis) -> Identified:
    """Return a stored model as manoeuvres take it.

    Raises
    ------
    DataRejected
        ``set_without_covariance``.
    """
    parameter_set, effects = ship.parameter_set, ship.effects
    if not np.all(np.isfinite(ship.covariance)):
        raise DataRejected(
            "set_without_covariance",
            f"{parameter_set.parameter_set_id} ({parameter_set.estimator}) has no covariance of all its parameters: "
            "there is no interval.",
            "Predict with a set of `kempf identify`, which has one; `kempf params list` names them.",
        )
    waters = Waters(
        model=effects.model if effects is not None else EffectModel(),
        length_m=basis.profile.length_m or LENGTH_M,
        draught_m=basis.profile.draught_m or 1.0,
        approach_m_s=ship.speed_m_s,
        scale_m=basis.scale_m,
        rudder_speed_exponent=ship.spec.rudder_speed_exponent,
        day=effects.day if effects is not None else 0.0,
        shaft_share=1.0 / basis.surge.settled[0] if basis.kept_m is not None else 1.0,
    )
    values = effects.values if effects is not None else np.zeros(0)
    hull, covariance = ship.hull.array(), ship.covariance
    if ship.leg_factor is None:
        factor = _widened(parameter_set, waters.model, basis, hull, values, covariance)
        covariance = factor**2 * covariance
    else:
        factor = ship.leg_factor
    return Identified(
        name=parameter_set.parameter_set_id,
        waters=waters,
        hull=hull,
        effects=values,
        covariance=covariance,
        surge=basis.surge,
        rudder_rate=basis.rudder_rate,
        widened=factor,
        fitted_to_legs=ship.leg_factor is not None,
    )


def _widened(
    parameter_set: ParameterSet, model: EffectModel, basis: Basis, hull: Float, values: Float, covariance: Float
) -> float:
    """Return how much wider than its covariance the errors of a pooled set are; 1 for a set of one manoeuvre."""
    levels: dict[str, Any] = dict(parameter_set.convergence.get("levels") or {})
    gross: dict[str, Any] = dict(parameter_set.convergence.get("gross_error_instants_s") or {})
    fitted = [run for run in basis.runs.runs if run.name in levels]
    filters = [RunFilter(left_out(run, gross.get(run.name, {})), model, basis.runs.spec) for run in fitted]
    own = [np.exp(np.array(levels[run.name], dtype=np.float64)) for run in fitted]
    # what the runs disagree about has widened the covariance already, and legs of runs that disagree show it again
    pooling: dict[str, Any] = dict(parameter_set.convergence.get("pooling") or {})
    already = float(parameter_set.convergence.get("widened") or pooling.get("widened") or 1.0)
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return max(widening(filters, own, hull, values, std) / already, 1.0) if filters else 1.0


def _scale_m(parameter_set: ParameterSet) -> float:
    """Return the length of a ship who answers as she does: of usual hulls a22 is about -2.5 / L."""
    damping = next((abs(p.value) for p in parameter_set.parameters if p.name == "a22"), 0.0)
    return float(min(max(2.5 / damping if damping > 0.0 else LENGTH_M, 0.3), 500.0))
