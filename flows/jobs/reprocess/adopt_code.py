"""The job that lets the present code count as the one that made what is stored, where a preview moved nothing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from kempf.flows.jobs.reprocess.preview_code import VesselPreview, standing_sets
from kempf.schemas.errors import DataRejected
from kempf.warehouse.code import code_version
from kempf.warehouse.code.code_version import Stage
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import equivalents, logs, segments
from kempf.warehouse.tables.equivalents import Equivalent


def adopt_code(warehouse: Warehouse, previews: Sequence[VesselPreview]) -> list[Equivalent]:
    """Let the present code count as the one that made what is stored.

    Logs, manoeuvres and sets then stand as they are, and what comes goes on under the fingerprint of that code; what
    another version than that one made is still made anew.

    Parameters
    ----------
    previews : sequence of VesselPreview
        What the present code makes of some vessels or of all: the evidence.

    Returns
    -------
    list of Equivalent
        One a stage; empty where the present code made everything already, or counts as that which did.

    Raises
    ------
    DataRejected
        ``code_moves``: something would be otherwise. ``nothing_compared``: no set was made by both, or no log read and
        looked through, where that is to be adopted.
    """
    moving = [
        preview.vessel
        for preview in previews
        if any((preview.moves, preview.new, preview.gone, preview.failures, preview.logs_otherwise))
    ]
    if moving:
        raise DataRejected(
            "code_moves",
            f"The present code says something else of {len(moving)} of {len(previews)} vessels: "
            f"{', '.join(moving[:5])}{' ...' if moving[5:] else ''}. It is not adopted.",
            "See above what moves. Where that is wanted, `kempf reprocess` makes everything anew.",
            {"vessels": moving},
        )
    made_by = _codes(warehouse, previews)
    sets, read = sum(preview.identical for preview in previews), sum(preview.logs for preview in previews)
    compared = tuple(preview.vessel for preview in previews if preview.identical or preview.logs)
    new_equivalents = []
    for stage, old in made_by.items():
        present = code_version.fingerprint(stage)
        if old is not None and old not in (present, equivalents.code_of(warehouse, stage)):
            new_equivalents.append(Equivalent(stage, present, old, sets, compared, code_version.git_commit()))
    if any(not (sets if equivalent.stage == "estimate" else read) for equivalent in new_equivalents):
        raise DataRejected(
            "nothing_compared",
            f"The present code and the one before made {sets} parameter sets of {len(previews)} vessels and read "
            f"{read} logs: too little to say that they do the same.",
            "Preview a vessel that has logs and parameter sets.",
        )
    equivalents.adopt(warehouse, new_equivalents)
    return new_equivalents


def _codes(warehouse: Warehouse, previews: Sequence[VesselPreview]) -> dict[Stage, str | None]:
    """Return the code that made most of what stands, by stage."""
    rows = logs.current(warehouse)
    sets = [stored for preview in previews for stored in standing_sets(warehouse, preview.vessel)]
    return {
        "ingest": _most(row.code_version for row in rows),
        "segment": _most(segment.code_version for segment in segments.found_in(warehouse)),
        "estimate": _most(str(stored.provenance["code_version"]) for stored in sets),
    }


def _most(codes: Iterable[str]) -> str | None:
    counted = Counter(codes)
    return min(counted, key=lambda code: (-counted[code], code)) if counted else None
