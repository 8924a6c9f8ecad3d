"""Segments without a speed through the water, as the jobs see them: which they are, and what is identified beside them.

How the speed is estimated is the affair of `kempf.pipeline.estimate.no_log.identify`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

from kempf.flows.jobs.identify.chosen_manoeuvres import without_log
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.estimate.estimators import estimate_without_log
from kempf.pipeline.estimate.no_log import companions
from kempf.pipeline.estimate.no_log.companions import Passage
from kempf.pipeline.estimate.no_log.identify import NoLogSettings
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.estimate.result import Estimate
from kempf.schemas.errors import KempfError
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.tables.logs import LogRow
from kempf.warehouse.tables.parameter_set import Inputs
from kempf.warehouse.tables.segments import Segment

#: estimators that can estimate the speed; the others take the speed over ground along the bow, and say so
CAN = ("ml",)
#: place of `NoLogSettings` among the settings of a set
KEY = "no_log"


def no_log_settings(wished: Mapping[str, Any]) -> dict[str, Any]:
    """Return every field of `NoLogSettings` as JSON content, defaults included."""
    return asdict(NoLogSettings(**wished))


def companions_of(
    segment: Segment, segments: Sequence[Segment], by_ingest: Mapping[str, LogRow]
) -> tuple[Segment, ...]:
    """Return the segments to identify beside one without a log; see `pipeline.estimate.no_log.companions`.

    Parameters
    ----------
    segments : sequence of Segment
        Of the same vessel.
    by_ingest : mapping of str to LogRow
        The ingests that they were found in; one reading of the logs has one profile.
    """
    profile = by_ingest[segment.ingest_id].profile_sha256
    others = [
        other
        for other in segments
        if other.kind == "zigzag" and without_log(other) and by_ingest[other.ingest_id].profile_sha256 == profile
    ]
    chosen = companions.companions_of(_passage(segment), [_passage(other) for other in others])
    return tuple(others[i] for i in chosen)


def _passage(segment: Segment) -> Passage:
    shaft = segment.detail.get("shaft_speed_per_s")
    return Passage(
        segment.start_utc_ns,
        segment.end_utc_ns,
        segment.base_heading_deg,
        None if shaft is None else float(shaft),
    )


def estimate_of(
    record: Record,
    spec: ModelSpec,
    arm_per_m: float,
    profile: VesselProfile,
    inputs: Inputs,
    instruments: Mapping[str, Instruments],
) -> Estimate:
    """Identify the hull and the speed that some inputs describe.

    Parameters
    ----------
    record : Record
        Of the segment.
    arm_per_m : float
        l of eq. (16), 1/m.
    profile : VesselProfile
        Its trial speed counts where the settings have none.
    instruments : mapping of str to Instruments
        Series by log, those of the companions too.

    Raises
    ------
    DataRejected
        ``engine_changed``: see `pipeline.estimate.no_log.companions.check_engine`.
    """
    settings, (own,) = dict(inputs.settings), inputs.bounds
    # in still water the speed over ground is that through the water, whatever the engine does
    in_current = spec.current != "none"
    if in_current:
        companions.check_engine(instruments[own.log_id], own.start_utc_ns, own.end_utc_ns)
    no_log = dict(settings.pop(KEY))
    if no_log["trial_speed_m_s"] is None and profile.trial_speed_m_s is not None:
        no_log |= {"trial_speed_m_s": profile.trial_speed_m_s, "trial_speed_std_m_s": profile.trial_speed_std_m_s}
    beside, refused = [], []
    for bounds in inputs.companions:
        try:
            if in_current:
                companions.check_engine(instruments[bounds.log_id], bounds.start_utc_ns, bounds.end_utc_ns)
            beside.append(make_record(instruments[bounds.log_id], bounds.start_utc_ns, bounds.end_utc_ns))
        except KempfError as error:
            refused.append(error.code)
    result = estimate_without_log(record, spec, arm_per_m, settings, no_log, tuple(beside))
    if refused:
        warning = f"{len(refused)} of {len(inputs.companions)} other manoeuvres cannot be used: {', '.join(refused)}"
        result.report["speed"]["companions_refused"] = refused
        return replace(result, warnings=(*result.warnings, warning))
    return result
