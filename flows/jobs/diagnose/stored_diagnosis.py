"""A vessel's diagnosis with what its report shows: read where it is stored, made where it is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from kempf.flows.jobs.identify.chosen_manoeuvres import Chosen
from kempf.flows.jobs.identify.standing_model import Own, inputs_of, known_effects
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.diagnose.settings import STANDARD
from kempf.schemas.diagnosis_evidence import DiagnosisEvidence
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.code import code_version
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import diagnoses
from kempf.warehouse.tables.diagnoses import StoredDiagnosis, diagnosis_id


def inputs_of_diagnosis(chosen: Chosen, spec: ModelSpec, own: Own) -> dict[str, Any]:
    """Return all that a diagnosis is a function of; the model is the one to begin from."""
    return {
        **inputs_of(chosen, spec, own).as_json(),
        "estimator": "diagnosis",
        "code_version": code_version.fingerprint("diagnose"),
        "settings": asdict(STANDARD),
        "own": own.as_json(),
        # an effect that is tried may go by them, whatever the model to begin from
        **({"draughts_m": chosen.draughts_m} if chosen.draughts_m else {}),
        "catalogue": {name: effect.sha256 for name, effect in known_effects(own).items()},
    }


def diagnosed_with_evidence(
    warehouse: Warehouse,
    chosen: Chosen,
    spec: ModelSpec,
    own: Own,
    progress: Progress = silent,
    say: Callable[[str], None] = lambda _: None,
) -> tuple[StoredDiagnosis, DiagnosisEvidence]:
    """Return the diagnosis of a vessel with what its report shows; what is stored is not computed again.

    Parameters
    ----------
    spec : ModelSpec
        The model to begin from.
    own : Own
        Effects beyond the catalogue that are tried too.
    say : callable, optional
        Takes one line where a stored diagnosis has to be computed again.
    """
    name = diagnosis_id(inputs_of_diagnosis(chosen, spec, own))
    stored, evidence = diagnoses.find(warehouse, name), diagnoses.evidence(warehouse, chosen.vessel, name)
    if stored is not None and evidence is not None:
        return stored, evidence
    # what is stored is read without loading what computes
    from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_again

    if stored is not None:
        say(f"{name} was stored without the curves that a report shows; diagnosing {chosen.vessel} again")
    diagnosis = diagnose_again(warehouse, chosen, spec, own, progress)
    evidence = diagnoses.evidence(warehouse, chosen.vessel, name)
    assert evidence is not None
    return diagnosis, evidence
