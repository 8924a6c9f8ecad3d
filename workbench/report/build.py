"""A vessel's report from the warehouse: diagnosed, gathered, written as a page."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

from kempf.flows.jobs.diagnose_vessel import diagnose_in_full
from kempf.flows.jobs.parameter_set_of import channel_warnings
from kempf.flows.jobs.standing_model import Own
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.diagnose.diagnosis import DiagnosisSettings
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse import code_version, examinations, vessels
from kempf.warehouse.diagnoses import StoredDiagnosis
from kempf.warehouse.store import Warehouse
from kempf.workbench.report.content import ReportContent
from kempf.workbench.report.page import page
from kempf.workbench.report.view_model import gather


@dataclass(frozen=True, eq=False)
class Report:
    """A report with what it shows.

    Attributes
    ----------
    diagnosis_id : str
        Of the stored diagnosis that it tells of.
    content : ReportContent
    html : str
    """

    diagnosis_id: str
    content: ReportContent
    html: str


def made(
    warehouse: Warehouse,
    vessel: str,
    spec: ModelSpec,
    own: Own,
    progress: Progress = silent,
    settings: DiagnosisSettings | None = None,
) -> Report:
    """Make a vessel's report.

    Parameters
    ----------
    warehouse : Warehouse
    vessel : str
    spec : ModelSpec
        The model to begin from.
    own : Own
        Effects beyond the catalogue.
    progress : Progress, optional
    settings : DiagnosisSettings, optional

    Raises
    ------
    NotFound
        ``no_vessel``, ``no_segments``, ``no_runs``.
    """
    settings = settings or DiagnosisSettings()
    # the curves are not stored, so a known diagnosis is made again from the same inputs
    stored, examined = diagnose_in_full(warehouse, vessel, spec, own, settings, progress)
    profile = vessels.get(warehouse, examined.chosen.profile_sha256)
    content = gather(
        vessel,
        examined.diagnosis,
        examined.chosen.segments,
        examined.chosen.file_names,
        _ship(profile),
        _provenance(stored, examined.chosen.profile_sha256, examined.runs.spec, settings)
        + [(f"left out, {name}", why) for name, why in sorted(examined.runs.skipped.items())],
    )
    said = examinations.of_ingests(warehouse, [segment.ingest_id for segment in examined.chosen.segments])
    channels = channel_warnings({"channels": {one.log_id: one.findings for one in said.values() if one.findings}})
    content = replace(content, sentences=(*content.sentences, *(f"Warning: {words}." for words in channels)))
    progress(0, 1, "drawing")
    return Report(stored.diagnosis_id, content, page(content))


def _ship(profile: VesselProfile) -> dict[str, str]:
    told = {"length": profile.length_m, "beam": profile.beam_m, "draught": profile.draught_m}
    return {name: f"{value:g} m" for name, value in told.items() if value is not None}


def _provenance(
    stored: StoredDiagnosis, profile_sha256: str, spec: ModelSpec, settings: DiagnosisSettings
) -> list[tuple[str, str]]:
    return [
        ("diagnosis", stored.diagnosis_id),
        ("parameter set it began from", stored.parameter_set_id),
        ("code", stored.code_version),
        ("commit of the source", code_version.git_commit() or "not known"),
        *((f"package {name}", version) for name, version in sorted(code_version.packages().items())),
        ("vessel profile, SHA-256", profile_sha256),
        *((f"model, {name}", str(value)) for name, value in sorted(spec.model_dump(mode="json").items())),
        *((f"setting, {name}", str(value)) for name, value in sorted(asdict(settings).items())),
    ]
