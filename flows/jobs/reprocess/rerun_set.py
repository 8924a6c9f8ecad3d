"""The job that builds a stored parameter set again from the raw bytes and compares every bit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from kempf.flows.jobs.identify.chosen_set import named_set
from kempf.flows.jobs.identify.identify_vessel import build
from kempf.flows.jobs.identify.parameter_set_of import SetRequest
from kempf.flows.jobs.identify.standing_model import POOLED, WITH_EFFECTS, Own, known_effects
from kempf.flows.jobs.identify.update_model import build_updated
from kempf.flows.jobs.identify.vessel_model import build_model
from kempf.flows.jobs.ingest.spool import spooled
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.instruments import Instruments, from_readings
from kempf.pipeline.estimate.names import NAMES
from kempf.schemas.errors import NotFound
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.code import code_version
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import agreement, logs, parameter_sets, raw, vessels
from kempf.warehouse.tables.agreement import Difference
from kempf.warehouse.tables.logs import LogRow
from kempf.warehouse.tables.parameter_set import Bounds, Inputs, ParameterSet


@dataclass(frozen=True)
class Rerun:
    """The verdict on one parameter set."""

    parameter_set_id: str
    #: ``bit-identical``, ``equal within tolerance`` or ``different``.
    verdict: str
    #: Fields that differ.
    differences: list[Difference]
    #: code_changed, packages_changed: Dict. Whether the code or an effect, and which packages, or what of the machine,
    #: are others than when the set was made.
    code_changed: bool
    packages_changed: dict[str, list[str | None]]
    #: Verdicts on the sets that it brings forward, by id, the one that was fitted at once first.
    rests_on: dict[str, str] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """Return the verdict as JSON content."""
        return {
            "parameter_set_id": self.parameter_set_id,
            "verdict": self.verdict,
            "differences": [difference.as_json() for difference in self.differences],
            "code_changed": self.code_changed,
            "packages_changed": self.packages_changed,
            "rests_on": self.rests_on,
        }


def rerun(warehouse: Warehouse, name: str, tolerance: float = 1e-9, progress: Progress = silent) -> Rerun:
    """Build a parameter set again from the raw bytes, and every one that it brings forward; nothing is stored.

    Parameters
    ----------
    name : str
        Its id, a beginning of it, or an alias.
    tolerance : float, optional
        Largest relative difference that still counts as equal.
    progress : Progress, optional
        Called before every set.

    Returns
    -------
    Rerun
        On the set, from those before it as they are stored; theirs stand beside it.

    Raises
    ------
    NotFound
        ``no_parameter_set``, ``no_raw_log``, ``no_profile``.
    KempfError
        ``raw_bytes_damaged``.
    """
    named = named_set(warehouse, name)
    chain = parameter_sets.chain_of(warehouse, named.parameter_set_id, named.vessel)
    verdicts = []
    for done, stored in enumerate(chain):
        progress(done, len(chain), f"building {stored.parameter_set_id} again")
        verdicts.append(rerun_alone(warehouse, stored, tolerance))
    progress(len(chain), len(chain), "done")
    return replace(verdicts[-1], rests_on={verdict.parameter_set_id: verdict.verdict for verdict in verdicts[:-1]})


def rerun_alone(warehouse: Warehouse, stored: ParameterSet, tolerance: float = 1e-9) -> Rerun:
    """Build a parameter set again from the raw bytes and, where it brings another one forward, from that as stored.

    Errors are those of `rerun`.
    """
    return judged(stored, rebuilt(warehouse, stored, *raw_inputs(warehouse, stored)), tolerance)


def raw_inputs(warehouse: Warehouse, stored: ParameterSet) -> tuple[dict[str, Instruments], VesselProfile]:
    """Read what a parameter set was made from again from the raw bytes.

    Returns
    -------
    dict of str to Instruments
        Series by log.
    VesselProfile

    Raises
    ------
    NotFound
        ``no_raw_log``, ``no_profile``, ``no_ingest``.
    KempfError
        ``raw_bytes_damaged``.
    """
    profile = vessels.get(warehouse, str(stored.provenance["inputs"]["profile_sha256"]))
    instruments = {}
    for ingest_id in stored.provenance["ingest_ids"]:
        row = logs.of_ingest(warehouse, str(ingest_id))
        instruments[row.log_id] = _read_again(warehouse, row, profile)
    return instruments, profile


def _read_again(warehouse: Warehouse, row: LogRow, profile: VesselProfile) -> Instruments:
    """Read one log again from its raw bytes."""
    with raw.opened(warehouse, row.log_id) as log, spooled(row.file_name, log, profile) as readings:
        return from_readings(readings.lazy())


def rebuilt(
    warehouse: Warehouse, stored: ParameterSet, instruments: Mapping[str, Instruments], profile: VesselProfile
) -> ParameterSet:
    """Compute a stored parameter set again with the present code.

    Parameters
    ----------
    warehouse : Warehouse
        Of the set that it brings forward.
    stored : ParameterSet
        As it is stored.
    instruments : mapping of str to Instruments
        Series by log, see `raw_inputs`.
    profile : VesselProfile
        The one it was made with.

    Raises
    ------
    NotFound
        ``no_estimator``: an earlier version had it, this one has not.
    KempfError
        It can no longer be identified; the reason says why.
    """
    inputs = inputs_of(stored)
    if inputs.estimator not in (*NAMES, POOLED, WITH_EFFECTS):
        raise _no_estimator(stored)
    ids, origin = stored.segment_ids, dict(stored.provenance)
    before = parameter_sets.get(warehouse, stored.updates.set, stored.vessel) if stored.updates else None
    request = SetRequest(inputs, profile, stored.vessel, ids, origin, stored.parent, before)
    if before is not None:
        return build_updated(instruments, request)
    if inputs.estimator in (POOLED, WITH_EFFECTS):
        return build_model(instruments, request)
    return build(instruments, request)


def _no_estimator(stored: ParameterSet) -> NotFound:
    commit = stored.provenance.get("git_commit")
    return NotFound(
        "no_estimator",
        f"{stored.parameter_set_id} was made by the estimator {stored.estimator!r}, which this version of kempf no "
        "longer has: it cannot be built again.",
        "The stored set stays readable. To build it again, install the version that made it"
        + (f", commit {commit}." if commit else "."),
        {"parameter_set_id": stored.parameter_set_id, "estimator": stored.estimator, "git_commit": commit},
    )


def judged(stored: ParameterSet, again: ParameterSet, tolerance: float = 1e-9) -> Rerun:
    """Return the verdict on a parameter set that was computed again."""
    verdict, differences = agreement.verdict(stored, again, tolerance)
    now = {**code_version.packages(), **code_version.machine()}
    # sets of earlier versions do not say on which machine they were made
    then = {**(stored.provenance.get("packages") or {}), **(stored.provenance.get("machine") or {})}
    changed = {name: [then.get(name), now.get(name)] for name in sorted(then) if then.get(name) != now.get(name)}
    new_code = code_changed(inputs_of(stored), stored.provenance.get("made_by"))
    return Rerun(stored.parameter_set_id, verdict, differences, new_code, changed)


def code_changed(inputs: Inputs, made_by: str | None = None) -> bool:
    """Return whether the code, or what an effect of the model computes, is another than when a set was made.

    Parameters
    ----------
    made_by : str, optional
        Fingerprint of the code itself, where it went on under another one.
    """
    then = inputs.settings.get("effects", {})
    now = known_effects(Own.from_json(inputs.settings.get("own") or {})) if then else {}
    changed = any(name not in now or now[name].sha256 != hashed for name, hashed in then.items())
    return changed or (made_by or inputs.code_version) != code_version.fingerprint("estimate")


def inputs_of(stored: ParameterSet) -> Inputs:
    """Return all that a stored parameter set is a function of."""
    inputs = stored.provenance["inputs"]
    return Inputs(
        log_ids=tuple(inputs["log_ids"]),
        profile_sha256=inputs["profile_sha256"],
        bounds=tuple(Bounds(**bounds) for bounds in inputs["segments"]),
        model_spec=inputs["model"],
        estimator=inputs["estimator"],
        settings=inputs["settings"],
        code_version=inputs["code_version"],
        companions=tuple(Bounds(**bounds) for bounds in inputs.get("companions", ())),
        draughts_m=inputs.get("draughts_m", {}),
    )
