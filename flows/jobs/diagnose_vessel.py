"""The job that finds what a vessel's model lacks and stores the diagnosis."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from typing import Any

from kempf.flows.jobs.chosen_manoeuvres import Chosen, choose_refreshed
from kempf.flows.jobs.standing_model import NONE_OF_ONES_OWN, Own, inputs_of, known_effects, named
from kempf.flows.jobs.vessel_model import Fitted, store_model
from kempf.flows.jobs.vessel_runs import VesselRuns, assembled
from kempf.flows.process.cores import usable
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.diagnose.diagnosis import Diagnosis, DiagnosisSettings, diagnose
from kempf.pipeline.diagnose.misfit import where_left
from kempf.pipeline.diagnose.verdict import as_json
from kempf.pipeline.predict.run_residuals import PhaseInterval, phases_s
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse import code_version, diagnoses
from kempf.warehouse.diagnoses import StoredDiagnosis, diagnosis_id
from kempf.warehouse.store import Warehouse

STANDARD = DiagnosisSettings()


@dataclass(frozen=True, eq=False)
class Examined:
    """A diagnosis just made, with what it was made of."""

    chosen: Chosen
    runs: VesselRuns
    diagnosis: Diagnosis


def diagnose_vessel(
    warehouse: Warehouse,
    vessel: str,
    spec: ModelSpec,
    own: Own = NONE_OF_ONES_OWN,
    settings: DiagnosisSettings = STANDARD,
    progress: Progress = silent,
) -> tuple[StoredDiagnosis, bool]:
    """Diagnose a vessel; what was diagnosed before from the same inputs is not computed again.

    Parameters
    ----------
    warehouse : Warehouse
    vessel : str
    spec : ModelSpec
        The model to begin from; its effects are taken as given.
    own : Own, optional
        Effects beyond the catalogue that are tried too.
    settings : DiagnosisSettings, optional
    progress : Progress, optional

    Returns
    -------
    (StoredDiagnosis, bool)
        And whether it is new.
    """
    chosen = choose_refreshed(warehouse, vessel, progress)
    inputs = _inputs(chosen, spec, own, settings)
    found = diagnoses.find(warehouse, diagnosis_id(inputs))
    if found is not None:
        return found, False
    return _kept(warehouse, examine(warehouse, chosen, spec, own, settings, progress), spec, own, inputs), True


def diagnose_in_full(
    warehouse: Warehouse, vessel: str, spec: ModelSpec, own: Own, settings: DiagnosisSettings, progress: Progress
) -> tuple[StoredDiagnosis, Examined]:
    """Diagnose a vessel as `diagnose_vessel`, and return also what is not stored: it is computed in any case."""
    chosen = choose_refreshed(warehouse, vessel, progress)
    inputs = _inputs(chosen, spec, own, settings)
    examined = examine(warehouse, chosen, spec, own, settings, progress)
    found = diagnoses.find(warehouse, diagnosis_id(inputs))
    return found or _kept(warehouse, examined, spec, own, inputs), examined


def _kept(
    warehouse: Warehouse, examined: Examined, spec: ModelSpec, own: Own, inputs: dict[str, Any]
) -> StoredDiagnosis:
    """Store a diagnosis and the model that was diagnosed."""
    chosen, found = examined.chosen, examined.diagnosis
    fitted = Fitted(examined.runs, found.way, found.gross_errors)
    base, _ = store_model(warehouse, chosen, spec, own, fitted=fitted)
    content = {**as_json(found), "where": where_left(found, _phases(examined))}
    made = StoredDiagnosis(
        diagnosis_id=diagnosis_id(inputs),
        vessel=chosen.vessel,
        parameter_set_id=base.parameter_set_id,
        start_utc_ns=min(s.start_utc_ns for s in chosen.segments),
        verdict=content["verdict"],
        effects=tuple(name for one in content["sets"] for name in one["effects"]),
        content=content,
        inputs=inputs,
        code_version=inputs["code_version"],
    )
    diagnoses.insert(warehouse, made)
    # as it is read back, so that new and known answers are the same
    stored = diagnoses.find(warehouse, made.diagnosis_id)
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
) -> Examined:
    """Make a diagnosis with everything in it; nothing is stored.

    ``only`` names the effects to screen instead of all.
    """
    runs = assembled(warehouse, chosen, spec, progress)
    known = known_effects(own)
    screened = {name: known[name] for name in only} if only else known
    count = 0

    def told(what: str) -> None:
        nonlocal count
        count += 1
        # how many steps it takes is not known beforehand
        progress(count, count + 5, what)

    with ThreadPoolExecutor(max_workers=usable()) as workers:
        made = diagnose(
            *(runs.runs, runs.spec, runs.start, screened, workers, settings),
            given=named(spec.effects, known),
            told=told,
        )
    progress(count, count, "done")
    return Examined(chosen, runs, made)


def _phases(examined: Examined) -> dict[str, tuple[PhaseInterval, ...]]:
    detail = {segment.segment_id: segment.detail for segment in examined.chosen.segments}
    return {run.name: phases_s(detail[run.name].get("phases", ()), run.start_utc_ns) for run in examined.runs.runs}


def _inputs(chosen: Chosen, spec: ModelSpec, own: Own, settings: DiagnosisSettings) -> dict[str, Any]:
    told = inputs_of(chosen, spec, own).as_json()
    return {
        **told,
        "estimator": "diagnosis",
        "code_version": code_version.fingerprint("diagnose"),
        "settings": asdict(settings),
        "own": own.as_json(),
        "catalogue": {name: effect.sha256 for name, effect in known_effects(own).items()},
    }
