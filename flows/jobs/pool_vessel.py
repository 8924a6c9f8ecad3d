"""The job that identifies one hull from all zigzags of a vessel and stores it as a parameter set of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from kempf.flows.jobs.chosen_manoeuvres import choose_refreshed
from kempf.flows.jobs.identify_vessel import IdentifyOutcome, Request
from kempf.flows.jobs.log_channels import channels_of
from kempf.flows.jobs.no_speed_log import without_log
from kempf.flows.jobs.parameter_set_of import arm_of, as_parameter_set, without_arm
from kempf.flows.jobs.pending import Waiting, waiting
from kempf.flows.jobs.vessel_model import store_model
from kempf.flows.process.cores import usable
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.estimate import pooling
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings
from kempf.pipeline.estimate.pooling import Member
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.rudder_inflow import with_rudder_inflow
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse import code_version, logs, parameter_sets, provenance, vessels
from kempf.warehouse.deduplicate import once, overlap
from kempf.warehouse.parameter_set import Bounds, Inputs, ParameterSet, parameter_set_id
from kempf.warehouse.store import Warehouse

#: the estimator of pooled sets, and the one whose outcomes are pooled
POOLED, SEPARATE = "ml-pooled", "ml"


def pool_vessel(
    warehouse: Warehouse,
    vessel: str,
    request: Request,
    outcomes: Sequence[IdentifyOutcome],
    *,
    flow_run: str | None = None,
    progress: Progress = silent,
) -> tuple[ParameterSet, bool] | None:
    """Identify one hull from the segments that maximum likelihood could identify one by one, and store it.

    Parameters, results and errors are those of `pool_segments`, which leaves the storing to its caller.
    """
    with waiting(warehouse, vessel) as new:
        return pool_segments(warehouse, vessel, request, outcomes, new, flow_run=flow_run, progress=progress)


def pool_segments(
    warehouse: Warehouse,
    vessel: str,
    request: Request,
    outcomes: Sequence[IdentifyOutcome],
    new: Waiting,
    *,
    adopt: bool = True,
    flow_run: str | None = None,
    progress: Progress = silent,
) -> tuple[ParameterSet, bool] | None:
    """Identify one hull from the segments that maximum likelihood could identify one by one.

    Parameters
    ----------
    warehouse : Warehouse
    vessel : str
    request : Request
        What the segments were identified with.
    outcomes : sequence of IdentifyOutcome
        Of that job.
    new : Waiting
        Takes the set where it is new, and where ``current`` shall point.
    adopt : bool, optional
        Whether ``current`` may move to this model from another one.
    flow_run : str, optional
    progress : Progress, optional

    Returns
    -------
    (ParameterSet, bool) or None
        The pooled set, and whether it is new; None where the estimator is another or fewer than two segments with a
        log converged. A manoeuvre that two logs hold counts once.

    Raises
    ------
    KempfError
        The segments have nothing in common.
    """
    if request.spec.effects:
        return _pool_with_effects(warehouse, vessel, request, new, adopt=adopt, flow_run=flow_run, progress=progress)
    rows = {row.ingest_id: row for row in logs.current(warehouse, vessel)}
    chosen = [
        o.segment
        for o in outcomes
        if o.parameter_set is not None
        and o.parameter_set.convergence.get("converged")
        and o.segment.kind == "zigzag"
        and o.segment.ingest_id in rows
        # pooled with the speed over ground they would be wrong together, and sure of it
        and not without_log(o.segment)
    ]
    if request.estimator != SEPARATE or not chosen:
        return None
    # one profile is one reading of the logs; a log that could not be read anew stays out
    profile_sha256 = rows[max(chosen, key=lambda s: s.start_utc_ns).ingest_id].profile_sha256
    chosen, _ = once([s for s in chosen if rows[s.ingest_id].profile_sha256 == profile_sha256], overlap)
    if len(chosen) < 2:
        return None
    chosen.sort(key=lambda s: (s.log_id, s.start_utc_ns, s.end_utc_ns))
    inputs = Inputs(
        log_ids=tuple(s.log_id for s in chosen),
        profile_sha256=profile_sha256,
        bounds=tuple(Bounds(s.log_id, s.start_utc_ns, s.end_utc_ns) for s in chosen),
        model_spec=request.spec.model_dump(mode="json"),
        estimator=POOLED,
        settings=request.all_settings(),
        code_version=code_version.fingerprint("estimate"),
    )
    name = parameter_set_id(inputs)
    known = name in set(parameter_sets.summaries(warehouse, vessel)["parameter_set_id"].to_list())
    if known:
        made = parameter_sets.get(warehouse, name)
    else:
        ingests = {s.log_id: s.ingest_id for s in chosen}
        instruments = {}
        for done, (log_id, ingest_id) in enumerate(ingests.items()):
            progress(done, len(ingests), f"pooling {len(chosen)} segments: reading {rows[ingest_id].file_name}")
            instruments[log_id] = channels_of(warehouse, ingest_id)
        progress(len(ingests), len(ingests), f"pooling {len(chosen)} segments")
        origin = provenance.collect(warehouse, inputs, list(ingests.values()), flow_run)
        profile = vessels.get(warehouse, profile_sha256)
        made = build_pooled(instruments, profile, inputs, vessel, tuple(s.segment_id for s in chosen), origin)
        new.keep([made])
    if made.convergence.get("converged") and new.may_move(request.spec, adopt=adopt):
        new.point(made.parameter_set_id)
    return made, not known


def _pool_with_effects(
    warehouse: Warehouse,
    vessel: str,
    request: Request,
    new: Waiting,
    *,
    adopt: bool,
    flow_run: str | None,
    progress: Progress,
) -> tuple[ParameterSet, bool] | None:
    """Fit hull and effects to all manoeuvres but the held-out ones, as `kempf effects add` does."""
    chosen = choose_refreshed(warehouse, vessel, progress)
    if len(chosen.segments) < 2:
        return None
    made, is_new = store_model(warehouse, chosen, request.spec, request.own, progress, flow_run)
    if made.convergence.get("converged") and new.may_move(request.spec, adopt=adopt):
        new.point(made.parameter_set_id)
    return made, is_new


def build_pooled(
    instruments: Mapping[str, Instruments],
    profile: VesselProfile,
    inputs: Inputs,
    vessel: str,
    segment_ids: tuple[str, ...],
    origin: dict[str, Any],
) -> ParameterSet:
    """Compute the pooled set that some inputs describe; nothing is stored.

    Parameters
    ----------
    instruments : mapping of str to Instruments
        Series by log.
    profile : VesselProfile
    inputs : Inputs
        At least two segments.
    vessel : str
    segment_ids : tuple of str
        In the order of the inputs' bounds.
    origin : dict
        Provenance.

    Raises
    ------
    KempfError
        See `kempf.pipeline.estimate.pooling.identify`.
    """
    spec = ModelSpec.model_validate(dict(inputs.model_spec))
    arm = arm_of(spec, profile)
    settings: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in inputs.settings.items()}
    members = []
    for name, bounds in zip(segment_ids, inputs.bounds, strict=True):
        record = make_record(instruments[bounds.log_id], bounds.start_utc_ns, bounds.end_utc_ns)
        members.append(Member(name, with_rudder_inflow(record, spec), arm or 0.0))
    with ThreadPoolExecutor(max_workers=usable()) as workers:
        result = pooling.identify(members, spec.with_arm(arm), MaximumLikelihoodSettings(**settings), workers)
    return as_parameter_set(result, inputs, vessel, segment_ids, origin, without_arm(spec, arm))
