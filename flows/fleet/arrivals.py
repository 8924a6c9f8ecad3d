"""How logs that arrived are reported: one row each, and the error of a run in which some did not get in."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from kempf.schemas.enumeration import counted
from kempf.schemas.errors import DataRejected
from kempf.warehouse.tables.inbox import InboxFile


class LogsFailed(DataRejected):
    """Some logs could not be taken in; all others are in.

    Parameters
    ----------
    outcomes : sequence of dict
        One a log, those that are in among them; kept in ``details``.
    """

    def __init__(self, outcomes: Sequence[dict[str, Any]]) -> None:
        failed = [outcome for outcome in outcomes if "error" in outcome]
        reasons = "; ".join(f"{Path(outcome['path']).name}: {outcome['error']['message']}" for outcome in failed[:5])
        super().__init__(
            "logs_failed",
            f"{len(failed)} of {len(outcomes)} logs could not be taken in: {reasons}{' ...' if failed[5:] else ''}",
            "The artifact kempf-ingest of the run says for each why; then run it again.",
            {"outcomes": list(outcomes)},
        )


def sentence(outcomes: Sequence[dict[str, Any]]) -> str:
    """Return what became of logs in one sentence.

    Examples
    --------
    >>> sentence([{"outcome": "new"}, {"outcome": "new"}, {"outcome": "unchanged"}])
    '3 logs: 2 new, 1 unchanged'
    """
    counts = Counter(str(outcome["outcome"]) for outcome in outcomes)
    tally = ", ".join(f"{count} {kind}" for kind, count in sorted(counts.items()))
    return f"{counted(len(outcomes), 'log')}: {tally}" if outcomes else "no log is new"


def not_ingested(file: InboxFile) -> dict[str, Any]:
    """Return a file that was not ingested, as it is in quarantine or was removed, as the outcome of a log."""
    error = {"code": file.code, "message": file.message, "next_step": file.next_step}
    return {"path": file.address, "outcome": file.outcome, "segments": [], "records": None, "error": error}


def table(outcomes: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return one row a log, failures in words."""
    return [
        {
            "log": Path(o["path"]).name,
            "outcome": o["outcome"],
            "manoeuvres to fit": len(o["segments"]),
            "rejected": (o["records"] or {}).get("rejected"),
            "error": o.get("error", {}).get("message", ""),
        }
        for o in outcomes
    ]
