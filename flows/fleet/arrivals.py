"""How logs that arrived are reported: one row each, and the error of a run in which some did not get in."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from kempf.schemas.errors import DataRejected
from kempf.warehouse.inbox import InboxFile


class LogsFailed(DataRejected):
    """Some logs could not be taken in; all others are in.

    Parameters
    ----------
    outcomes : sequence of dict
        One a log, those that are in among them; kept in ``details``.
    """

    def __init__(self, outcomes: Sequence[dict[str, Any]]) -> None:
        failed = [outcome for outcome in outcomes if "error" in outcome]
        said = "; ".join(f"{Path(one['path']).name}: {one['error']['message']}" for one in failed[:5])
        super().__init__(
            "logs_failed",
            f"{len(failed)} of {len(outcomes)} logs could not be taken in: {said}{' ...' if failed[5:] else ''}",
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
    counts = Counter(str(one["outcome"]) for one in outcomes)
    said = ", ".join(f"{count} {what}" for what, count in sorted(counts.items()))
    return f"{len(outcomes)} log{'' if len(outcomes) == 1 else 's'}: {said}" if outcomes else "no log is new"


def in_quarantine(one: InboxFile) -> dict[str, Any]:
    """Return a file in quarantine as the outcome of a log."""
    error = {"code": one.code, "message": one.message, "next_step": one.next_step}
    return {"path": one.address, "outcome": "quarantined", "segments": [], "records": None, "error": error}


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
