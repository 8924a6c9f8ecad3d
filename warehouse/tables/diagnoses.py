"""The tables of diagnoses and of what their reports show: rows are added and never changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from orjson import loads

from kempf.schemas.diagnosis_evidence import DiagnosisEvidence, evidence_from_json
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.canonical import canonical_json, plain, sha256
from kempf.warehouse.storage.keys import quoted, vessel_key
from kempf.warehouse.storage.retry import with_retry
from kempf.warehouse.storage.store import Warehouse


def diagnosis_id(inputs: Mapping[str, Any]) -> str:
    """Return the id of what these inputs produce: ``dx-`` and 16 hex digits of the hash of their canonical JSON."""
    return "dx-" + sha256(canonical_json(plain(inputs, name_non_finite=True)))[:16]


@dataclass(frozen=True)
class StoredDiagnosis:
    """One diagnosis as it is kept."""

    diagnosis_id: str
    vessel: str
    #: The model that was diagnosed.
    parameter_set_id: str
    #: First instant of the manoeuvres.
    start_utc_ns: int
    verdict: str
    #: Of all sets.
    effects: tuple[str, ...]
    #: content, inputs: JSON content.
    content: Mapping[str, Any]
    inputs: Mapping[str, Any]
    code_version: str

    def as_json(self) -> dict[str, Any]:
        """Return the diagnosis as the command line's JSON object."""
        return {
            "vessel": self.vessel,
            "diagnosis_id": self.diagnosis_id,
            "parameter_set_id": self.parameter_set_id,
            **self.content,
            "provenance": dict(self.inputs),
        }


def insert(warehouse: Warehouse, diagnosis: StoredDiagnosis) -> bool:
    """Add a diagnosis; one that is there already changes nothing.

    Returns
    -------
    bool
        Whether it is new.
    """
    row: dict[str, Any] = {
        "vessel_key": vessel_key(diagnosis.vessel),
        "vessel": diagnosis.vessel,
        "diagnosis_id": diagnosis.diagnosis_id,
        "parameter_set_id": diagnosis.parameter_set_id,
        "start_utc_ns": diagnosis.start_utc_ns,
        "verdict": diagnosis.verdict,
        "effects": list(diagnosis.effects),
        "content_json": canonical_json(plain(diagnosis.content)),
        "inputs_json": canonical_json(plain(diagnosis.inputs, name_non_finite=True)),
        "code_version": diagnosis.code_version,
    }

    def attempt() -> bool:
        with delta.ensured(warehouse, "diagnoses") as table:
            if delta.rows(table, "diagnoses", {"diagnosis_id": diagnosis.diagnosis_id}).height:
                return False
            predicate = f"vessel_key = {quoted(row['vessel_key'])} AND diagnosis_id = {quoted(diagnosis.diagnosis_id)}"
            delta.replace(table, "diagnoses", [row], predicate)
            return True

    return with_retry(attempt)


def keep_evidence(warehouse: Warehouse, vessel: str, name: str, evidence: DiagnosisEvidence) -> None:
    """Store what the report of a diagnosis shows, in place of what was stored for it before.

    Parameters
    ----------
    vessel, name : str
        The diagnosis by its vessel and id.
    """
    key = vessel_key(vessel)
    row = {"vessel_key": key, "vessel": vessel, "diagnosis_id": name, "evidence_json": evidence.model_dump_json()}

    def attempt() -> None:
        with delta.ensured(warehouse, "diagnosis_evidence") as table:
            predicate = f"vessel_key = {quoted(key)} AND diagnosis_id = {quoted(name)}"
            delta.replace(table, "diagnosis_evidence", [row], predicate)

    with_retry(attempt)


def evidence(warehouse: Warehouse, vessel: str, name: str) -> DiagnosisEvidence | None:
    """Return what the report of a diagnosis shows; None where none is stored, or in the form of another version.

    Parameters
    ----------
    vessel, name : str
        The diagnosis by its vessel and id.
    """
    frame = delta.read(warehouse, "diagnosis_evidence", {"vessel_key": vessel_key(vessel), "diagnosis_id": name})
    return evidence_from_json(frame["evidence_json"][0]) if frame.height else None


def find(warehouse: Warehouse, name: str) -> StoredDiagnosis | None:
    """Return a diagnosis by its id, None where there is none."""
    frame = delta.read(warehouse, "diagnoses", {"diagnosis_id": name})
    return _stored(frame.row(0, named=True)) if frame.height else None


def of_vessel(warehouse: Warehouse, vessel: str) -> list[StoredDiagnosis]:
    """Return the diagnoses of a vessel, those of the newest manoeuvres last."""
    frame = delta.read(warehouse, "diagnoses", {"vessel_key": vessel_key(vessel)})
    return [_stored(row) for row in frame.sort("start_utc_ns", "diagnosis_id").rows(named=True)]


def by_vessel(warehouse: Warehouse) -> dict[str, list[StoredDiagnosis]]:
    """Return all diagnoses of every vessel that has any, in the order of her manoeuvres, of equal ones by id."""
    frame = delta.read(warehouse, "diagnoses").sort("start_utc_ns", "diagnosis_id")
    diagnoses: dict[str, list[StoredDiagnosis]] = {}
    for diagnosis in map(_stored, frame.rows(named=True)):
        diagnoses.setdefault(diagnosis.vessel, []).append(diagnosis)
    return diagnoses


def newest(warehouse: Warehouse) -> dict[str, StoredDiagnosis]:
    """Return the diagnosis of every vessel that has one: that of her newest manoeuvres.

    Of several it is the one that began from the fewest effects, which says what the plain model lacks; then the last by
    id.
    """
    return {vessel: max(every, key=_newest) for vessel, every in by_vessel(warehouse).items()}


def _newest(diagnosis: StoredDiagnosis) -> tuple[int, int, str]:
    began = (diagnosis.inputs.get("model") or {}).get("effects") or ()
    return diagnosis.start_utc_ns, -len(began), diagnosis.diagnosis_id


def _stored(r: Mapping[str, Any]) -> StoredDiagnosis:
    return StoredDiagnosis(
        r["diagnosis_id"],
        r["vessel"],
        r["parameter_set_id"],
        r["start_utc_ns"],
        r["verdict"],
        tuple(r["effects"]),
        loads(r["content_json"]),
        loads(r["inputs_json"]),
        r["code_version"],
    )
