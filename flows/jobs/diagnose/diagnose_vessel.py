"""The job that finds what a vessel's model lacks and stores the diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass

from kempf.flows.jobs.diagnose.stored_diagnosis import inputs_of_diagnosis
from kempf.flows.jobs.identify.chosen_manoeuvres import Chosen, choose_refreshed
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN, Own, known_effects, named
from kempf.flows.jobs.identify.vessel_model import Fitted, store_model
from kempf.flows.jobs.identify.vessel_runs import VesselRuns, layout_of
from kempf.flows.process.cores import usable
from kempf.flows.process.fit_report import reported_to
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.found_instants import FoundInstants
from kempf.pipeline.diagnose.evidence.evidence import evidence_of
from kempf.pipeline.diagnose.evidence.manoeuvre_evidence import SailedZigzag
from kempf.pipeline.diagnose.evidence.misfit import where_left
from kempf.pipeline.diagnose.settings import STANDARD, DiagnosisSettings
from kempf.pipeline.diagnose.verdicts.diagnosis import Diagnosis, diagnose
from kempf.pipeline.diagnose.verdicts.diagnosis_json import as_json
from kempf.pipeline.predict.run_residuals import PhaseInterval, phases_s
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import diagnoses
from kempf.warehouse.tables.diagnoses import StoredDiagnosis, diagnosis_id


@dataclass(frozen=True, eq=False)
class FullDiagnosis:
    """A diagnosis just made, with what it was made of."""

    chosen: Chosen
    runs: VesselRuns
    diagnosis: Diagnosis
    #: Laid out with the instants of measurement as they are taken, to which parameter sets are fitted.
    as_taken: VesselRuns
    #: By log, the instants that were found, at which ``runs`` are laid out.
    instants: Mapping[str, FoundInstants]


def diagnose_vessel(
    warehouse: Warehouse,
    vessel: str,
    spec: ModelSpec,
    own: Own = NONE_OF_ONES_OWN,
    progress: Progress = silent,
) -> tuple[StoredDiagnosis, bool]:
    """Diagnose a vessel; what was diagnosed before from the same inputs is not computed again.

    Parameters
    ----------
    spec : ModelSpec
        The model to begin from; its effects are taken as given.
    own : Own, optional
        Effects beyond the catalogue that are tried too.

    Returns
    -------
    (StoredDiagnosis, bool)
        And whether it is new.
    """
    chosen = choose_refreshed(warehouse, vessel, progress)
    stored = diagnoses.find(warehouse, diagnosis_id(inputs_of_diagnosis(chosen, spec, own)))
    if stored is not None:
        return stored, False
    return diagnose_again(warehouse, chosen, spec, own, progress), True


def diagnose_again(
    warehouse: Warehouse,
    chosen: Chosen,
    spec: ModelSpec,
    own: Own = NONE_OF_ONES_OWN,
    progress: Progress = silent,
) -> StoredDiagnosis:
    """Diagnose manoeuvres and store what was found, what its report shows, and the model that was diagnosed.

    Whatever is stored of them; the parameters are those of `diagnose_vessel`.
    """
    examined = examine(warehouse, chosen, spec, own, progress=progress)
    diagnosis, inputs = examined.diagnosis, inputs_of_diagnosis(chosen, spec, own)
    fitted = Fitted(examined.as_taken, diagnosis.as_taken.plain, diagnosis.as_taken.fits)
    base, _ = store_model(warehouse, chosen, spec, own, fitted=fitted)
    phases = _phases(examined)
    instants = {log_id: asdict(found) for log_id, found in examined.instants.items()}
    content = {**as_json(diagnosis), "where": where_left(diagnosis, phases), "instants": instants}
    row = StoredDiagnosis(
        diagnosis_id=diagnosis_id(inputs),
        vessel=chosen.vessel,
        parameter_set_id=base.parameter_set_id,
        start_utc_ns=min(s.start_utc_ns for s in chosen.segments),
        verdict=content["verdict"],
        effects=tuple(name for effect_set in content["sets"] for name in effect_set["effects"]),
        content=content,
        inputs=inputs,
        code_version=inputs["code_version"],
    )
    with ThreadPoolExecutor(max_workers=usable()) as workers:
        evidence = evidence_of(diagnosis, phases, _zigzags(chosen), examined.runs.skipped, workers)
    diagnoses.keep_evidence(warehouse, chosen.vessel, row.diagnosis_id, evidence)
    diagnoses.insert(warehouse, row)
    # as it is read back, so that new and known answers are the same
    stored = diagnoses.find(warehouse, row.diagnosis_id)
    assert stored is not None
    return stored


def examine(
    warehouse: Warehouse,
    chosen: Chosen,
    spec: ModelSpec,
    own: Own,
    settings: DiagnosisSettings = STANDARD,
    progress: Progress = silent,
    only: tuple[str, ...] = (),
) -> FullDiagnosis:
    """Make a diagnosis with everything in it; nothing is stored.

    ``only`` names the effects to screen instead of all.
    """
    layout = layout_of(warehouse, chosen, spec, progress)
    runs = layout.runs()
    known = known_effects(own)
    screened = {name: known[name] for name in only} if only else known
    with ThreadPoolExecutor(max_workers=usable()) as workers:
        diagnosis = diagnose(
            *(runs.runs, runs.spec, screened, workers, settings),
            given=named(spec.effects, known),
            listener=reported_to(progress),
            lay_out=layout.runs_at,
        )
    progress(1, 1, "done")
    instants = {log_id: diagnosis.found[day] for day, log_id in enumerate(layout.logs) if day in diagnosis.found}
    laid_out = layout.moved(diagnosis.found).runs() if instants else runs
    return FullDiagnosis(chosen, laid_out, diagnosis, runs, instants)


def _phases(examined: FullDiagnosis) -> dict[str, tuple[PhaseInterval, ...]]:
    detail = {segment.segment_id: segment.detail for segment in examined.chosen.segments}
    return {run.name: phases_s(detail[run.name].get("phases", ()), run.start_utc_ns) for run in examined.runs.runs}


def _zigzags(chosen: Chosen) -> dict[str, SailedZigzag]:
    return {
        segment.segment_id: SailedZigzag(
            segment.base_heading_deg, segment.executes_utc_ns, tuple(segment.detail.get("overshoots", ()))
        )
        for segment in chosen.segments
    }
