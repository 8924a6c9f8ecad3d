"""The job that identifies a model from every zigzag of a vessel and stores the parameter sets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

from kempf.flows.jobs.chosen_manoeuvres import without_log
from kempf.flows.jobs.log_channels import channels_of
from kempf.flows.jobs.no_speed_log import CAN, KEY, companions_of, estimate_of, no_log_settings
from kempf.flows.jobs.parameter_set_of import SetRequest, arm_of, as_parameter_set, without_arm
from kempf.flows.jobs.pending import Waiting, waiting
from kempf.flows.jobs.refresh_logs import Refreshed, refresh_logs
from kempf.flows.jobs.standing_model import NONE_OF_ONES_OWN, SINGLE, Own, effect_settings
from kempf.flows.jobs.vessel_model import build_single, build_with_errors_that_last
from kempf.flows.process.cores import usable
from kempf.flows.process.progress import Progress, silent
from kempf.flows.process.wrap_error import wrapped
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.estimate.estimators import default_settings, estimate
from kempf.pipeline.estimate.plausibility import may_last
from kempf.pipeline.estimate.record.cut import make_record
from kempf.schemas.errors import KempfError, NotFound, UsageError
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse import code_version, delta, logs, parameter_sets, provenance, segments, vessels
from kempf.warehouse.keys import vessel_key
from kempf.warehouse.parameter_set import Bounds, Inputs, ParameterSet, parameter_set_id
from kempf.warehouse.scan import Where
from kempf.warehouse.segments import Segment
from kempf.warehouse.store import Warehouse


@dataclass(frozen=True)
class Request:
    """What a person asks for: which model, which estimator, which of its settings differ from the defaults.

    ``own`` are effects of the model that are not in the catalogue. ``no_log`` are the settings of
    `pipeline.estimate.no_log.identify.NoLogSettings`, for segments without a speed through the water.
    """

    spec: ModelSpec = field(default_factory=ModelSpec)
    estimator: str = "ml"
    settings: tuple[tuple[str, Any], ...] = ()
    no_log: tuple[tuple[str, Any], ...] = ()
    own: Own = NONE_OF_ONES_OWN

    def __post_init__(self) -> None:
        if self.spec.effects and self.estimator != SINGLE:
            raise UsageError(
                "effects_need_ml",
                f"The model has the effects {', '.join(self.spec.effects)}, which {self.estimator!r} cannot estimate.",
                f"Take the estimator {SINGLE!r}, or a model without effects.",
            )

    def all_settings(self) -> dict[str, Any]:
        """Return every setting of the estimator, defaults included; they are part of a set's identity."""
        if self.spec.effects:
            return effect_settings(self.spec, self.own)
        return {**default_settings(self.estimator), **dict(self.settings)}


@dataclass(frozen=True)
class IdentifyOutcome:
    """What became of one segment: a parameter set (new, or there already), or the reason why there is none."""

    segment: Segment
    parameter_set: ParameterSet | None
    new: bool = False
    error: KempfError | None = None


def identify_vessel(
    warehouse: Warehouse,
    vessel: str,
    request: Request = Request(),
    *,
    flow_run: str | None = None,
    progress: Progress = silent,
) -> list[IdentifyOutcome]:
    """Identify a model from every zigzag of a vessel.

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
        return identify_segments(warehouse, vessel, request, refreshed, new, flow_run=flow_run, progress=progress)


def identify_segments(
    warehouse: Warehouse,
    vessel: str,
    request: Request,
    refreshed: Refreshed,
    new: Waiting,
    *,
    adopt: bool = True,
    flow_run: str | None = None,
    progress: Progress = silent,
) -> list[IdentifyOutcome]:
    """Do as `identify_vessel` where the logs have just been read anew, and the caller stores what is new.

    Parameters
    ----------
    refreshed : Refreshed
        What came of reading the logs anew.
    new : Waiting
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
        raise _no_segments(warehouse, vessel)
    table_versions = delta.versions(warehouse)
    outcomes: list[IdentifyOutcome] = []
    readable = [segment for segment in current if segment.ingest_id not in refreshed.failed]
    ingests = list(dict.fromkeys(segment.ingest_id for segment in current))
    with ThreadPoolExecutor(max_workers=usable()) as pool:
        for done, ingest in enumerate(ingests):
            hers = [segment for segment in current if segment.ingest_id == ingest]
            progress(done, len(ingests), f"identifying {len(hers)} segments of {by_ingest[ingest].file_name}")
            if ingest in refreshed.failed:
                outcomes += [IdentifyOutcome(segment, None, error=refreshed.failed[ingest]) for segment in hers]
            else:
                beside = {s.segment_id: companions_of(s, readable, by_ingest) for s in hers if without_log(s)}
                job = _Identification(warehouse, request, pool, flow_run, table_versions, by_ingest)
                outcomes += _identify_log(job, by_ingest[ingest], hers, beside)
                new.keep([o.parameter_set for o in outcomes[-len(hers) :] if o.new and o.parameter_set])
    progress(len(ingests), len(ingests), "done")
    outcomes.sort(key=lambda o: (o.segment.start_utc_ns, o.segment.segment_id))
    _point_to_current(new, outcomes, request.spec, adopt=adopt)
    return outcomes


@dataclass(frozen=True)
class _Identification:
    """What is the same for every log of one call."""

    warehouse: Warehouse
    request: Request
    pool: ThreadPoolExecutor
    flow_run: str | None
    table_versions: dict[str, int]
    by_ingest: Mapping[str, logs.LogRow]


def _identify_log(
    job: _Identification, row: logs.LogRow, manoeuvres: Sequence[Segment], beside: Mapping[str, tuple[Segment, ...]]
) -> list[IdentifyOutcome]:
    """Identify the segments of one log, one a thread; the new sets are stored by the caller.

    ``beside`` are the companions by segment, of those without a log.
    """
    warehouse, pool = job.warehouse, job.pool
    profile = vessels.get(warehouse, row.profile_sha256)
    alone = job.request.estimator not in CAN or bool(job.request.spec.effects)
    companions = [() if alone else beside.get(s.segment_id, ()) for s in manoeuvres]
    wanted = [inputs_of(s, row.profile_sha256, job.request, c) for s, c in zip(manoeuvres, companions, strict=True)]
    missing = _missing(warehouse, row.vessel, wanted)
    asked = [c for c, inputs in zip(companions, wanted, strict=True) if parameter_set_id(inputs) in missing]
    ingests = {row.ingest_id, *(s.ingest_id for c in asked for s in c)} if missing else set()
    held = {job.by_ingest[i].log_id: channels_of(warehouse, i) for i in sorted(ingests)}

    def one(segment: Segment, inputs: Inputs, others: tuple[Segment, ...]) -> IdentifyOutcome:
        name = parameter_set_id(inputs)
        if name not in missing:
            return IdentifyOutcome(segment, parameter_sets.get(warehouse, name))
        used = [s.ingest_id for s in (segment, *others)]
        origin = provenance.collect(warehouse, inputs, used, job.flow_run, job.table_versions)
        try:
            made = build(held, SetRequest(inputs, profile, row.vessel, (segment.segment_id,), origin))
        except Exception as error:  # noqa: BLE001 - whatever it is, the other segments are identified
            return IdentifyOutcome(segment, None, error=wrapped(error))
        return IdentifyOutcome(segment, made, new=True)

    return list(pool.map(one, manoeuvres, wanted, companions))


def _no_segments(warehouse: Warehouse, vessel: str) -> NotFound:
    held = logs.current(warehouse, vessel)
    return NotFound(
        "no_segments",
        f"No zigzag was found in the {len(held)} logs of {vessel!r}, so there is nothing to identify from.",
        "Ingest a log that holds one; `kempf ingest` says for each log why none was found.",
        {"vessel": vessel, "logs": [row.file_name for row in held]},
    )


def _missing(warehouse: Warehouse, vessel: str, wanted: Sequence[Inputs]) -> set[str]:
    names = {parameter_set_id(inputs) for inputs in wanted}
    where: Where = {"vessel_key": vessel_key(vessel), "parameter_set_id": sorted(names)}
    stored = delta.read(warehouse, "parameter_sets", where, ("parameter_set_id",))
    return names - set(stored["parameter_set_id"].to_list())


def _point_to_current(new: Waiting, outcomes: Sequence[IdentifyOutcome], spec: ModelSpec, *, adopt: bool) -> None:
    """Let ``current`` point to the latest whole zigzag whose maximum-likelihood identification converged."""
    whole = [
        o.parameter_set
        for o in outcomes
        if o.parameter_set is not None
        and o.segment.kind == "zigzag"
        and o.parameter_set.convergence.get("converged")
        and o.parameter_set.estimator == "ml"
    ]
    if whole and new.may_move(spec, adopt=adopt):
        new.point(whole[-1].parameter_set_id)


def inputs_of(segment: Segment, profile_sha256: str, request: Request, companions: Sequence[Segment] = ()) -> Inputs:
    """Return all that the parameter set of one segment is a function of.

    Parameters
    ----------
    companions : sequence of Segment
        Of a segment without a log.
    """
    settings = request.all_settings()
    if request.estimator in CAN and without_log(segment) and not request.spec.effects:
        settings = {**settings, KEY: no_log_settings(dict(request.no_log))}
    return Inputs(
        log_ids=(segment.log_id, *(s.log_id for s in companions)),
        profile_sha256=profile_sha256,
        bounds=(Bounds(segment.log_id, segment.start_utc_ns, segment.end_utc_ns),),
        model_spec=request.spec.model_dump(mode="json"),
        estimator=request.estimator,
        settings=settings,
        code_version=code_version.fingerprint("estimate"),
        companions=tuple(Bounds(s.log_id, s.start_utc_ns, s.end_utc_ns) for s in companions),
    )


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
    else:
        given = (spec.with_arm(arm), arm or 0.0, dict(inputs.settings), profile.length_m)
        result = estimate(inputs.estimator, record, *given)
        if inputs.estimator == SINGLE and (may_last(result.fit) or record.velocity_late_std_s > 0.0):
            made = build_with_errors_that_last(instruments, request)
            if made is not None:
                return made
    return as_parameter_set(result, request, without_arm(spec, arm))
