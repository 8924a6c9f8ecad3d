"""Runs of the flows: what ran on which inputs and how it ended. When it ran stands in the table's own commits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from json import loads
from typing import TYPE_CHECKING, Any

from kempf.warehouse.storage import delta
from kempf.warehouse.storage.canonical import canonical_json, plain, sha256
from kempf.warehouse.storage.keys import one_of
from kempf.warehouse.storage.retry import with_retry
from kempf.warehouse.storage.store import Warehouse

if TYPE_CHECKING:
    import polars as pl


def run_id(flow: str, inputs: Any) -> str:
    """Return the id of a run, ``run-`` and 16 hex digits: the flow and what it ran on (JSON content)."""
    return "run-" + sha256(canonical_json([flow, inputs], name_non_finite=True))[:16]


@dataclass(frozen=True)
class FlowRun:
    """One run; `counts` and `message` are JSON content."""

    run_id: str
    flow: str
    vessel: str | None
    status: str
    counts: Mapping[str, int] = field(default_factory=dict)
    message: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "counts", plain(self.counts))
        object.__setattr__(self, "message", plain(self.message))


def record_all(warehouse: Warehouse, runs: Sequence[FlowRun]) -> tuple[str, ...]:
    """Store how runs stand, in place of how they stood, in at most one commit.

    Parameters
    ----------
    warehouse : Warehouse
        Made where there is none.
    runs : sequence of FlowRun
        Of one id the last counts.

    Returns
    -------
    tuple of str
        Ids of those that stand otherwise than before, sorted.
    """
    rows = {
        run.run_id: {
            "run_id": run.run_id,
            "flow": run.flow,
            "vessel": run.vessel,
            "status": run.status,
            "counts_json": canonical_json(run.counts),
            "message_json": canonical_json(run.message),
        }
        for run in runs
    }
    if not rows:
        return ()

    def attempt() -> tuple[str, ...]:
        with delta.ensured(warehouse, "runs") as table:
            stored = {
                row["run_id"]: row for row in delta.rows(table, "runs", {"run_id": sorted(rows)}).rows(named=True)
            }
            changed = tuple(name for name in sorted(rows) if stored.get(name) != rows[name])
            if changed:
                delta.replace(table, "runs", [rows[name] for name in changed], one_of("run_id", changed))
            return changed

    return with_retry(attempt)


def some(warehouse: Warehouse, run_ids: Sequence[str]) -> list[FlowRun]:
    """Return those of some runs that are stored, sorted by flow then id."""
    return _runs(delta.read(warehouse, "runs", {"run_id": sorted(set(run_ids))}))


def all_runs(warehouse: Warehouse, flow: str | None = None) -> list[FlowRun]:
    """Return every run, of one flow or of all, sorted by flow then id."""
    return _runs(delta.read(warehouse, "runs", {} if flow is None else {"flow": flow}))


def _runs(frame: pl.DataFrame) -> list[FlowRun]:
    return [
        FlowRun(r["run_id"], r["flow"], r["vessel"], r["status"], loads(r["counts_json"]), loads(r["message_json"]))
        for r in frame.sort("flow", "run_id").rows(named=True)
    ]
