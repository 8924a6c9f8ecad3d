"""A vessel's report from the warehouse: what is stored of her diagnosis, written as a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import nan
from typing import Any

from kempf.flows.jobs.diagnose.stored_diagnosis import diagnosed_with_evidence
from kempf.flows.jobs.identify.chosen_manoeuvres import Chosen, choose_refreshed
from kempf.flows.jobs.identify.parameter_set_of import channel_warnings
from kempf.flows.jobs.identify.standing_model import Own, standing
from kempf.flows.process.progress import Progress, silent
from kempf.schemas.diagnosis_evidence import DiagnosisEvidence, FittedParameter
from kempf.schemas.instants import iso_utc, minute
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.code import code_version
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import examinations, vessels
from kempf.warehouse.tables.diagnoses import StoredDiagnosis
from kempf.workbench.effect_row import EffectRow
from kempf.workbench.report.content import ReportContent, ShownManoeuvre
from kempf.workbench.report.page import page
from kempf.workbench.report.wording import ReportWording, wording_of


@dataclass(frozen=True, eq=False)
class MadeReport:
    """A report with what it shows."""

    #: Of the stored diagnosis that it shows.
    diagnosis_id: str
    content: ReportContent
    html: str


def make_report(
    warehouse: Warehouse,
    vessel: str,
    spec: ModelSpec,
    own: Own,
    progress: Progress = silent,
    say: Callable[[str], None] = lambda _: None,
) -> MadeReport:
    """Make a vessel's report; a diagnosis that is stored is read, one that is not is made first.

    Parameters
    ----------
    spec : ModelSpec
        The model to begin from.
    own : Own
        Effects beyond the catalogue.
    say : callable, optional
        Takes one line where a stored diagnosis has to be computed again.

    Raises
    ------
    NotFound
        ``no_vessel``, ``no_segments``, ``no_runs``.
    """
    chosen = choose_refreshed(warehouse, vessel, progress)
    stored, evidence = diagnosed_with_evidence(warehouse, chosen, spec, own, progress, say)
    current = standing(warehouse, vessel)
    included = () if current is None else tuple(current.model_spec["effects"])
    profile = vessels.get(warehouse, chosen.profile_sha256)
    examined = examinations.of_ingests(warehouse, [segment.ingest_id for segment in chosen.segments])
    channels = {
        "channels": {
            examination.log_id: examination.findings for examination in examined.values() if examination.findings
        }
    }
    content = content_of(
        vessel,
        stored.content,
        evidence,
        chosen,
        wording_of(vessel, stored.content, evidence, included),
        warnings=tuple(f"Warning: {words}." for words in channel_warnings(channels)),
        ship=_ship(profile),
        provenance=_provenance(stored, chosen, evidence.left_out),
    )
    progress(0, 1, "drawing")
    return MadeReport(stored.diagnosis_id, content, page(content))


def content_of(
    vessel: str,
    diagnosis: Mapping[str, Any],
    evidence: DiagnosisEvidence,
    chosen: Chosen,
    wording: ReportWording,
    *,
    warnings: tuple[str, ...],
    ship: Mapping[str, str],
    provenance: tuple[tuple[str, str], ...],
) -> ReportContent:
    """Put together what a report shows.

    Parameters
    ----------
    diagnosis : mapping
        Under the command line's keys.
    chosen : Chosen
        The manoeuvres.
    warnings : tuple of str
        About the channels of the logs.
    ship : mapping of str to str
        Dimensions with units.
    provenance : tuple of (str, str)
        Ids, versions and settings, as shown at the end.
    """
    segments = {segment.segment_id: segment for segment in chosen.segments}
    shown = []
    for number, manoeuvre in enumerate(evidence.manoeuvres, start=1):
        segment = segments[manoeuvre.segment_id]
        start = minute(iso_utc(manoeuvre.start_utc_ns))
        shown.append(
            ShownManoeuvre(
                number=number,
                label=f"Manoeuvre {number}: {segment.words}, {segment.first_side} first, {start} UTC",
                log=chosen.file_names[segment.log_id],
                psi0_deg=segment.psi0_deg,
                imo=segment.imo,
                evidence=manoeuvre,
            )
        )
    return ReportContent(
        vessel=vessel,
        wording=wording,
        effects=tuple(_effect_row(candidate, wording) for candidate in diagnosis["candidates"]),
        sets=tuple(diagnosis["sets"]) if wording.claims else (),
        manoeuvres=tuple(shown),
        evidence=evidence,
        warnings=warnings,
        ship=ship,
        provenance=provenance,
    )


def _effect_row(candidate: Mapping[str, Any], wording: ReportWording) -> EffectRow:
    def known(value: float | None) -> float:
        return nan if value is None else value

    return EffectRow(
        title=candidate["title"],
        verdict=wording.effect_verdict(candidate["verdict"]),
        why=candidate["why"],
        set_id=(candidate["set_id"] or "") if wording.claims else "",
        score=known(candidate["score"]),
        p_adjusted=known(candidate["p_adjusted"]),
        absorption=known(candidate["absorption"]),
        changes=tuple(
            FittedParameter(name=name, unit=change["unit"], value=change["value"], std=change["std"])
            for name, change in candidate["expected_change"].items()
        ),
    )


def _ship(profile: VesselProfile) -> dict[str, str]:
    dimensions = {"length": profile.length_m, "beam": profile.beam_m, "draught": profile.draught_m}
    return {name: f"{value:g} m" for name, value in dimensions.items() if value is not None}


def _provenance(stored: StoredDiagnosis, chosen: Chosen, left_out: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
    return (
        ("diagnosis", stored.diagnosis_id),
        ("parameter set it began from", stored.parameter_set_id),
        ("code", stored.code_version),
        ("commit of the source", code_version.git_commit() or "not known"),
        *((f"package {name}", version) for name, version in sorted(code_version.packages().items())),
        ("vessel profile, SHA-256", chosen.profile_sha256),
        *((f"model, {name}", str(value)) for name, value in sorted(stored.inputs["model"].items())),
        *((f"setting, {name}", str(value)) for name, value in sorted(stored.inputs["settings"].items())),
        *((f"left out, {name}", why) for name, why in sorted(left_out.items())),
    )
