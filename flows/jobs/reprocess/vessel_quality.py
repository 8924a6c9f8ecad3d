"""The job that judges what is stored of a vessel: sets that did not converge, logs without one to fit, and the like.

Nothing of it is a failure: the work was done, and this is what a person should know of what came of it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

from kempf.schemas.quality import Kind
from kempf.warehouse.queries.standing import standing_ids
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import examinations, logs, parameter_sets, segments
from kempf.warehouse.tables.equivalents import code_of


@dataclass(frozen=True)
class Finding:
    """What is wrong with one log or one parameter set of a vessel."""

    kind: Kind
    #: Id of the log, the segment or the set.
    subject: str
    #: One sentence.
    words: str
    #: Segments that it is about.
    segment_ids: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return {**asdict(self), "segment_ids": list(self.segment_ids)}


def quality_of(warehouse: Warehouse, vessel: str) -> list[Finding]:
    """Return what is wrong with the logs and the standing parameter sets of a vessel.

    Returns
    -------
    list of Finding
        Of logs first, in the order of time.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    manoeuvres = segments.found_in(warehouse, vessel)
    standing = {name: place for place, name in enumerate(standing_ids(warehouse, vessel))}
    sets = parameter_sets.convergences_to_look_at(warehouse, vessel, names=list(standing))
    sets.sort(key=lambda row: standing[row.parameter_set_id])
    return [*_of_logs(warehouse, vessel, manoeuvres), *_of_sets(sets)]


def _of_logs(warehouse: Warehouse, vessel: str, manoeuvres: Iterable[segments.Segment]) -> Iterable[Finding]:
    # a circle or a spiral is not fitted and is not for nothing: models are held against it
    with_manoeuvres = {manoeuvre.ingest_id for manoeuvre in manoeuvres}
    rows = logs.current(warehouse, vessel)
    found = examinations.findings(warehouse, [row.ingest_id for row in rows], [vessel])
    without = [row.ingest_id for row in rows if row.ingest_id not in with_manoeuvres]
    examined = examinations.of_ingests(warehouse, without, [vessel])
    for row in rows:
        yield from (
            Finding("channels", row.log_id, f"{row.file_name}: {words}") for words in found.get(row.ingest_id, ())[:1]
        )
        if row.ingest_id in with_manoeuvres:
            continue
        examination = examined.get(row.ingest_id)
        missing = [note for note in (examination.notes if examination else ()) if "cannot be looked for" in note]
        if missing:
            yield Finding("missing_channels", row.log_id, f"{row.file_name}: {missing[0]}.")
        else:
            yield Finding(
                "no_zigzag",
                row.log_id,
                f"{row.file_name}: no manoeuvre was found, neither one to fit nor one to hold a model against.",
            )


def _of_sets(sets: Iterable[parameter_sets.Convergence]) -> Iterable[Finding]:
    for row in sets:
        title = f"{row.parameter_set_id} ({row.model_name}, {row.estimator})"
        if not row.converged:
            yield Finding("not_converged", row.parameter_set_id, f"{title} did not converge.", row.segment_ids)
        if row.pooling.get("may_be_pooled") is False:
            pooling = row.pooling
            words = (
                f"{title}: its {pooling['segments']} manoeuvres do not share one hull (p = {pooling['p_value']:.1g})."
            )
            yield Finding("no_shared_hull", row.parameter_set_id, words, row.segment_ids)
        for name, why in sorted(row.left_out.items()):
            yield Finding("left_out", name, f"{title} leaves {name} out: {why}.", (name,))


def marks(warehouse: Warehouse, vessel: str | None = None) -> dict[str, list[str]]:
    """Return what sets of the present code say against segments of one vessel or of all, by segment, in a few words.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    marked: dict[str, list[str]] = {}
    for row in parameter_sets.convergences_to_look_at(warehouse, vessel, code_of(warehouse, "estimate")):
        remarks = dict.fromkeys(row.left_out, "left out of the pooled set")
        # of a pooled set that did not converge no single zigzag is at fault
        if not row.converged and len(row.segment_ids) == 1:
            remarks |= {row.segment_ids[0]: f"not converged ({row.estimator})"}
        for name, words in remarks.items():
            if words not in marked.setdefault(name, []):
                marked[name].append(words)
    return marked
