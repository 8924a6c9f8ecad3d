"""The job that identifies a model from every zigzag of a vessel and stores the parameter sets."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from os import cpu_count
from typing import Any

from flows.parameter_set_of import arm_of, as_parameter_set, without_arm
from flows.progress import Progress, silent
from flows.refresh_logs import Refreshed, refresh_logs
from flows.unforeseen import as_told
from pipeline.identify.estimators import default_settings, estimate
from pipeline.identify.record import make_record
from pipeline.normalise.instruments import Instruments, from_readings
from schemas.errors import KempfError, NotFound, UsageError
from schemas.model_spec import ModelSpec
from schemas.profile import VesselProfile
from warehouse import aliases, code_version, delta, logs, parameter_sets, provenance, readings, segments, vessels
from warehouse.parameter_set import Bounds, Inputs, ParameterSet, parameter_set_id
from warehouse.segments import Segment
from warehouse.store import Warehouse


@dataclass(frozen=True)
class Request:
    """What a person asks for: which model, which estimator, which of its settings differ from the defaults."""

    spec: ModelSpec = field(default_factory=ModelSpec)
    estimator: str = "ml"
    settings: tuple[tuple[str, Any], ...] = ()

    def all_settings(self) -> dict[str, Any]:
        """Return every setting of the estimator, defaults included; they are part of a set's identity."""
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
    refreshed: Refreshed | None = None,
    adopt: bool = True,
    flow_run: str | None = None,
    progress: Progress = silent,
) -> list[IdentifyOutcome]:
    """Identify a model from every zigzag of a vessel.

    Logs that were read with another profile or other code are read anew first. A set whose inputs, code, model and
    settings are the same as before is not computed again. Segments share the cores: the compiled likelihood runs
    outside the interpreter's lock.

    Parameters
    ----------
    warehouse : Warehouse
    vessel : str
    request : Request, optional
    refreshed : Refreshed, optional
        What came of reading the logs anew, where the caller has just done it; else it is done here.
    adopt : bool, optional
        Whether ``current`` may move to this model from another one.
    flow_run : str, optional
        Run that asks, for the provenance.
    progress : Progress, optional

    Returns
    -------
    list of IdentifyOutcome
        One a segment, in order of time.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``, ``no_segments``: nothing to identify from.
    """
    refreshed = refreshed or refresh_logs(warehouse, vessel, progress)
    by_ingest = {row.ingest_id: row for row in logs.current(warehouse, vessel)}
    # of the logs just listed only: another process may read one anew at any moment
    found = [segment for segment in segments.current(warehouse, vessel) if segment.ingest_id in by_ingest]
    if not found:
        raise _no_segments(warehouse, vessel)
    table_versions = delta.versions(warehouse)
    outcomes: list[IdentifyOutcome] = []
    ingests = list(dict.fromkeys(segment.ingest_id for segment in found))
    with ThreadPoolExecutor(max_workers=cpu_count()) as pool:
        for done, ingest in enumerate(ingests):
            hers = [segment for segment in found if segment.ingest_id == ingest]
            progress(done, len(ingests), f"identifying {len(hers)} segments of {by_ingest[ingest].file_name}")
            if ingest in refreshed.failed:
                outcomes += [IdentifyOutcome(segment, None, error=refreshed.failed[ingest]) for segment in hers]
            else:
                outcomes += _identify_log(warehouse, by_ingest[ingest], hers, request, pool, flow_run, table_versions)
    progress(len(ingests), len(ingests), "done")
    outcomes.sort(key=lambda o: (o.segment.start_utc_ns, o.segment.segment_id))
    _point_to_current(warehouse, vessel, outcomes, request.spec, adopt=adopt)
    return outcomes


def _identify_log(
    warehouse: Warehouse,
    row: logs.LogRow,
    found: Sequence[Segment],
    request: Request,
    pool: ThreadPoolExecutor,
    flow_run: str | None,
    table_versions: dict[str, int],
) -> list[IdentifyOutcome]:
    """Identify the segments of one log, one a thread, and store the new sets in one commit."""
    profile = vessels.get(warehouse, row.profile_sha256)
    wanted = [inputs_of(segment, row.profile_sha256, request) for segment in found]
    missing = _missing(warehouse, wanted)
    instruments = from_readings(readings.read(warehouse, row.ingest_id)) if missing else None

    def one(segment: Segment, inputs: Inputs) -> IdentifyOutcome:
        name = parameter_set_id(inputs)
        if name not in missing or instruments is None:
            return IdentifyOutcome(segment, parameter_sets.get(warehouse, name))
        told = provenance.collect(warehouse, inputs, [segment.ingest_id], flow_run, table_versions)
        try:
            made = build(instruments, profile, inputs, row.vessel, (segment.segment_id,), told)
        except Exception as error:  # noqa: BLE001 - whatever it is, the other segments are identified
            return IdentifyOutcome(segment, None, error=as_told(error))
        return IdentifyOutcome(segment, made, new=True)

    outcomes = list(pool.map(one, found, wanted))
    parameter_sets.insert(warehouse, [o.parameter_set for o in outcomes if o.new and o.parameter_set])
    return outcomes


def _no_segments(warehouse: Warehouse, vessel: str) -> NotFound:
    held = logs.current(warehouse, vessel)
    return NotFound(
        "no_segments",
        f"No zigzag was found in the {len(held)} logs of {vessel!r}, so there is nothing to identify from.",
        "Ingest a log that holds one; `kempf ingest` says for each log why none was found.",
        {"vessel": vessel, "logs": [row.file_name for row in held]},
    )


def _missing(warehouse: Warehouse, wanted: Sequence[Inputs]) -> set[str]:
    names = {parameter_set_id(inputs) for inputs in wanted}
    stored = delta.read(warehouse, "parameter_sets", {"parameter_set_id": sorted(names)}, ("parameter_set_id",))
    return names - set(stored["parameter_set_id"].to_list())


def _point_to_current(
    warehouse: Warehouse, vessel: str, outcomes: Sequence[IdentifyOutcome], spec: ModelSpec, *, adopt: bool
) -> None:
    """Let ``current`` point to the latest whole zigzag whose maximum-likelihood identification converged."""
    whole = [
        o.parameter_set
        for o in outcomes
        if o.parameter_set is not None
        and o.segment.kind == "zigzag"
        and o.parameter_set.convergence.get("converged")
        and o.parameter_set.estimator == "ml"
    ]
    if not whole:
        return
    pointed = aliases.of_vessel(warehouse, vessel).get(aliases.CURRENT)
    if (
        adopt
        or pointed is None
        or ModelSpec.model_validate(dict(parameter_sets.get(warehouse, pointed).model_spec)) == spec
    ):
        aliases.point(warehouse, vessel, whole[-1].parameter_set_id)


def inputs_of(segment: Segment, profile_sha256: str, request: Request) -> Inputs:
    """Return all that the parameter set of one segment is a function of."""
    return Inputs(
        log_ids=(segment.log_id,),
        profile_sha256=profile_sha256,
        bounds=(Bounds(segment.log_id, segment.start_utc_ns, segment.end_utc_ns),),
        model_spec=request.spec.model_dump(mode="json"),
        estimator=request.estimator,
        settings=request.all_settings(),
        code_version=code_version.fingerprint(),
    )


def build(
    instruments: Instruments,
    profile: VesselProfile,
    inputs: Inputs,
    vessel: str,
    segment_ids: tuple[str, ...],
    told: dict[str, Any],
) -> ParameterSet:
    """Compute the parameter set that some inputs describe; nothing is stored.

    Parameters
    ----------
    instruments : Instruments
        Series of the log.
    profile : VesselProfile
    inputs : Inputs
        One segment.
    vessel : str
    segment_ids : tuple of str
    told : dict
        Provenance.

    Raises
    ------
    KempfError
        The segment cannot be identified from; the reason says why.
    """
    if len(inputs.bounds) != 1:
        raise UsageError(
            "one_segment_at_a_time",
            f"{len(inputs.bounds)} segments were given; this estimator takes one.",
            "Identify them one by one.",
        )
    bounds, spec = inputs.bounds[0], ModelSpec.model_validate(dict(inputs.model_spec))
    arm = arm_of(spec, profile)
    record = make_record(instruments, bounds.start_utc_ns, bounds.end_utc_ns)
    result = estimate(inputs.estimator, record, spec.with_arm(arm), arm or 0.0, dict(inputs.settings))
    return as_parameter_set(result, inputs, vessel, segment_ids, told, without_arm(spec, arm))
