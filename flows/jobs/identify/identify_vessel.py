"""The job that identifies a model from every zigzag and random manoeuvre of a vessel and stores the parameter sets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from kempf.flows.jobs.identify.chosen_manoeuvres import no_segments, without_log
from kempf.flows.jobs.identify.no_speed_log import CAN, KEY, companions_of, estimate_of, no_log_settings
from kempf.flows.jobs.identify.parameter_set_of import SetRequest, arm_of, as_parameter_set, without_arm
from kempf.flows.jobs.identify.pending import PendingSets, waiting
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN, SINGLE, Own, effect_settings
from kempf.flows.jobs.identify.vessel_model import build_single, build_with_errors_that_last
from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.flows.jobs.ingest.refresh_logs import Refreshed, refresh_logs
from kempf.flows.process.cores import usable
from kempf.flows.process.progress import Progress, silent
from kempf.flows.process.wrap_error import wrapped
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.estimate.estimators import default_settings, estimate
from kempf.pipeline.estimate.plausibility import may_last
from kempf.pipeline.estimate.record.cut import make_record
from kempf.schemas.errors import KempfError, UsageError
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.code import code_version
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, parameter_sets, provenance, segments, vessels
from kempf.warehouse.tables.equivalents import code_of
from kempf.warehouse.tables.parameter_set import Bounds, Inputs, ParameterSet, ids_of_each, parameter_set_id
from kempf.warehouse.tables.segments import Segment


@dataclass(frozen=True)
class Request:
    """What a person asks for: which model, which estimator.

    ``own`` are effects of the model that are not in the catalogue. ``no_log`` are the settings of
    `pipeline.estimate.no_log.identify.NoLogSettings`, for segments without a speed through the water.
    """

    spec: ModelSpec = field(default_factory=ModelSpec)
    estimator: str = "ml"
    no_log: tuple[tuple[str, Any], ...] = ()
    own: Own = NONE_OF_ONES_OWN

    def __post_init__(self) -> None:
        if self.spec.effects and self.estimator != SINGLE:
            raise UsageError(
                "effects_need_ml",
                f"The model has the effects {', '.join(self.spec.effects)}, which {self.estimator!r} cannot estimate.",
                f"Take the estimator {SINGLE!r}, or a model without effects.",
            )

    @property
    def looks_beside(self) -> bool:
        """Whether a segment without a speed through the water is identified with others beside it."""
        return self.estimator in CAN and not self.spec.effects

    @cached_property
    def all_settings(self) -> dict[str, Any]:
        """Every setting of the estimator, defaults included; they are part of a set's identity."""
        if self.spec.effects:
            return effect_settings(self.spec, self.own)
        return default_settings(self.estimator)


@dataclass(frozen=True)
class IdentifyOutcome:
    """What became of one segment: a parameter set (new, or there already), or the reason why there is none."""

    segment: Segment
    #: None where there is none; of `identify_segments` also where it was there already.
    parameter_set: ParameterSet | None
    new: bool = False
    error: KempfError | None = None
    #: Id of the set; None where there is none.
    set_id: str | None = None
    converged: bool = False


def _made(segment: Segment, parameter_set: ParameterSet) -> IdentifyOutcome:
    converged = bool(parameter_set.convergence.get("converged"))
    return IdentifyOutcome(segment, parameter_set, new=True, set_id=parameter_set.parameter_set_id, converged=converged)


def identify_vessel(
    warehouse: Warehouse,
    vessel: str,
    request: Request = Request(),
    *,
    flow_run: str | None = None,
    progress: Progress = silent,
) -> list[IdentifyOutcome]:
    """Identify a model from every zigzag and random manoeuvre of a vessel.

    Logs that were read with another profile or other code are read anew first. A set whose inputs, code, model and
    settings are the same as before is not computed again. Segments share the cores: the compiled likelihood runs
    outside the interpreter's lock.

    Parameters
    ----------
    flow_run : str, optional
        Run that asks, for the provenance.

    Returns
    -------
    list of IdentifyOutcome
        One a segment, in order of time.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``, ``no_segments``: nothing to identify from.
    """
    refreshed = refresh_logs(warehouse, vessel, progress)
    with waiting(warehouse, vessel) as new:
        outcomes = identify_segments(warehouse, vessel, request, refreshed, new, flow_run=flow_run, progress=progress)
    there = [o.set_id for o in outcomes if o.set_id is not None and o.parameter_set is None]
    stored_sets = {
        parameter_set.parameter_set_id: parameter_set
        for parameter_set in parameter_sets.get_all(warehouse, vessel, there)
    }
    return [o if o.set_id not in stored_sets else replace(o, parameter_set=stored_sets[o.set_id]) for o in outcomes]


def identify_segments(
    warehouse: Warehouse,
    vessel: str,
    request: Request,
    refreshed: Refreshed,
    new: PendingSets,
    *,
    adopt: bool = True,
    flow_run: str | None = None,
    progress: Progress = silent,
) -> list[IdentifyOutcome]:
    """Do as `identify_vessel` where the logs have just been read anew, and the caller stores what is new.

    Sets that are there already are not read, but named: a vessel may have thousands.

    Parameters
    ----------
    refreshed : Refreshed
        What came of reading the logs anew.
    new : PendingSets
        Takes the new sets, and where ``current`` shall point.
    adopt : bool, optional
        Whether ``current`` may move to this model from another one.

    Raises
    ------
    NotFound
        ``no_segments``.
    """
    by_ingest = {row.ingest_id: row for row in logs.current(warehouse, vessel)}
    # of the logs just listed only: another process may read one anew at any moment
    current = [segment for segment in segments.current(warehouse, vessel) if segment.ingest_id in by_ingest]
    if not current:
        raise no_segments(vessel, logs.current(warehouse, vessel))
    table_versions = delta.versions(warehouse)
    readable = [segment for segment in current if segment.ingest_id not in refreshed.failed]
    tasks = _wanted(warehouse, request, readable, by_ingest)
    known = parameter_sets.converged(warehouse, vessel, [task.set_id for task in tasks])
    outcomes = [
        IdentifyOutcome(segment, None, error=refreshed.failed[segment.ingest_id])
        for segment in current
        if segment.ingest_id in refreshed.failed
    ]
    missing: dict[str, list[_Wanted]] = {}
    for task in tasks:
        if task.set_id not in known:
            missing.setdefault(task.segment.ingest_id, []).append(task)
        else:
            outcomes.append(IdentifyOutcome(task.segment, None, set_id=task.set_id, converged=known[task.set_id]))
    with ThreadPoolExecutor(max_workers=usable()) as pool:
        for done, (ingest, log_segments) in enumerate(missing.items()):
            progress(done, len(missing), f"identifying {len(log_segments)} segments of {by_ingest[ingest].file_name}")
            log_outcomes = _identify_log(warehouse, vessel, log_segments, pool, flow_run, table_versions, by_ingest)
            outcomes += log_outcomes
            new.keep([o.parameter_set for o in log_outcomes if o.parameter_set])
    progress(len(missing), len(missing), "done")
    outcomes.sort(key=lambda o: (o.segment.start_utc_ns, o.segment.segment_id))
    _point_to_current(new, outcomes, request, adopt=adopt)
    return outcomes


@dataclass(frozen=True)
class _Wanted:
    """A segment, and all that its set is a function of."""

    segment: Segment
    set_id: str
    companions: tuple[Segment, ...]
    profile: VesselProfile
    #: Without the segment, its companions and their logs.
    common: Inputs

    @property
    def inputs(self) -> Inputs:
        """All that the set is a function of."""
        return _with(self.common, self.segment, self.companions)


def _wanted(
    warehouse: Warehouse, request: Request, readable: Sequence[Segment], by_ingest: Mapping[str, logs.LogRow]
) -> list[_Wanted]:
    """Return what is wanted of every segment, in order of time."""
    hashes = dict.fromkeys(by_ingest[segment.ingest_id].profile_sha256 for segment in readable)
    profiles = {sha256: vessels.get(warehouse, sha256) for sha256 in hashes}
    code = code_of(warehouse, "estimate")
    alike: dict[tuple[str, bool], list[Segment]] = {}
    for segment in readable:
        alike.setdefault((by_ingest[segment.ingest_id].profile_sha256, without_log(segment)), []).append(segment)
    tasks = []
    for (sha256, logless), hers in alike.items():
        common = _common_inputs(sha256, request, code, logless=logless)
        if logless and request.looks_beside:
            for segment in hers:
                beside = tuple(companions_of(segment, readable, by_ingest))
                name = parameter_set_id(_with(common, segment, beside))
                tasks.append(_Wanted(segment, name, beside, profiles[sha256], common))
        else:
            names = ids_of_each(common, [_bounds(segment) for segment in hers])
            tasks += [
                _Wanted(segment, name, (), profiles[sha256], common) for segment, name in zip(hers, names, strict=True)
            ]
    return sorted(tasks, key=lambda task: (task.segment.start_utc_ns, task.segment.segment_id))


def _identify_log(
    warehouse: Warehouse,
    vessel: str,
    tasks: Sequence[_Wanted],
    pool: ThreadPoolExecutor,
    flow_run: str | None,
    table_versions: Mapping[str, int],
    by_ingest: Mapping[str, logs.LogRow],
) -> list[IdentifyOutcome]:
    """Identify segments of one log, one a thread; the new sets are stored by the caller."""
    ingests = {s.ingest_id for task in tasks for s in (task.segment, *task.companions)}
    held = {by_ingest[i].log_id: channels_of(warehouse, i) for i in sorted(ingests)}

    def one(task: _Wanted) -> IdentifyOutcome:
        used = [s.ingest_id for s in (task.segment, *task.companions)]
        origin = provenance.collect(warehouse, task.inputs, used, flow_run, table_versions, vessel)
        ids = (task.segment.segment_id,)
        try:
            parameter_set = build(held, SetRequest(task.inputs, task.profile, vessel, ids, origin))
        except Exception as error:  # noqa: BLE001 - whatever it is, the other segments are identified
            return IdentifyOutcome(task.segment, None, error=wrapped(error))
        return _made(task.segment, parameter_set)

    return list(pool.map(one, tasks))


def _point_to_current(new: PendingSets, outcomes: Sequence[IdentifyOutcome], request: Request, *, adopt: bool) -> None:
    """Let ``current`` point to the latest whole zigzag whose maximum-likelihood identification converged.

    Of a vessel without one, to the latest random manoeuvre.
    """

    def converged(kind: str) -> list[str]:
        return [o.set_id for o in outcomes if o.set_id is not None and o.segment.kind == kind and o.converged]

    whole = converged("zigzag") or converged("random_manoeuvre")
    if whole and request.estimator == SINGLE and new.may_move(request.spec, adopt=adopt):
        new.point(whole[-1])


def inputs_of(
    segment: Segment,
    profile_sha256: str,
    request: Request,
    companions: Sequence[Segment] = (),
    code: str | None = None,
) -> Inputs:
    """Return all that the parameter set of one segment is a function of.

    Parameters
    ----------
    companions : sequence of Segment
        Of a segment without a log.
    code : str, optional
        Fingerprint under which the present code estimates; its own by default.
    """
    made_by = code or code_version.fingerprint("estimate")
    return _with(_common_inputs(profile_sha256, request, made_by, logless=without_log(segment)), segment, companions)


def _common_inputs(profile_sha256: str, request: Request, code: str, *, logless: bool) -> Inputs:
    """Return what sets of single segments are a function of beside these: of segments that all have a log, or none."""
    settings = request.all_settings
    if logless and request.looks_beside:
        settings = {**settings, KEY: no_log_settings(dict(request.no_log))}
    return Inputs(
        log_ids=(),
        profile_sha256=profile_sha256,
        bounds=(),
        model_spec=request.spec.model_dump(mode="json"),
        estimator=request.estimator,
        settings=settings,
        code_version=code,
    )


def _with(common: Inputs, segment: Segment, companions: Sequence[Segment]) -> Inputs:
    return replace(
        common,
        log_ids=(segment.log_id, *(s.log_id for s in companions)),
        bounds=(_bounds(segment),),
        companions=tuple(map(_bounds, companions)),
    )


def _bounds(segment: Segment) -> Bounds:
    return Bounds(segment.log_id, segment.start_utc_ns, segment.end_utc_ns)


def build(instruments: Mapping[str, Instruments], request: SetRequest) -> ParameterSet:
    """Compute the parameter set of one segment; nothing is stored.

    Parameters
    ----------
    instruments : mapping of str to Instruments
        Series by log, those of companions too.

    Raises
    ------
    KempfError
        The segment cannot be identified from; the reason says why.
    """
    inputs, profile, spec = request.inputs, request.profile, request.spec
    if len(inputs.bounds) != 1:
        raise UsageError(
            "one_segment_at_a_time",
            f"{len(inputs.bounds)} segments were given; this estimator takes one.",
            "Identify them one by one.",
        )
    if spec.effects:
        return build_single(instruments, request)
    (bounds,), arm = inputs.bounds, arm_of(spec, profile)
    record = make_record(instruments[bounds.log_id], bounds.start_utc_ns, bounds.end_utc_ns)
    if KEY in inputs.settings:
        result = estimate_of(record, spec.with_arm(arm), arm or 0.0, profile, inputs, instruments)
        return as_parameter_set(result, request, without_arm(spec, arm))
    single, unsure = inputs.estimator == SINGLE, not record.instant_errors.known
    parameter_set = build_with_errors_that_last(instruments, request) if single and unsure else None
    if parameter_set is not None:
        return parameter_set
    result = estimate(
        *(inputs.estimator, record, spec.with_arm(arm), arm or 0.0, dict(inputs.settings), profile.length_m)
    )
    if single and not unsure and may_last(result.fit):
        parameter_set = build_with_errors_that_last(instruments, request)
        if parameter_set is not None:
            return parameter_set
    return as_parameter_set(result, request, without_arm(spec, arm))
