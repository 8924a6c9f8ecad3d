"""How a run over the fleet is reported: a table, a summary, one sentence, and whether somebody should be woken."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from kempf.schemas.errors import DataRejected

#: Rows of a table that a page can still show; of a larger fleet those where nothing happened are left out.
MOST_ROWS = 1000
#: Failures that the summary spells out.
_MOST_TOLD = 20

Reports = Sequence[Mapping[str, Any]]


class VesselsFailed(DataRejected):
    """A run over the fleet in which vessels failed; every other one is up to date.

    Parameters
    ----------
    reports : sequence of dict
        One a vessel, those that did not fail among them; kept in ``details``.
    """

    def __init__(self, reports: Reports) -> None:
        super().__init__(
            "vessels_failed",
            f"{sentence(reports)}.",
            "The artifact kempf-fleet of the run says for each what to do; then run it again.",
            {"reports": list(reports)},
        )


def alarming(report: Mapping[str, Any]) -> bool:
    """Return whether a vessel failed in a way that has not been reported yet, or that another attempt may overcome."""
    return any(not (failure["lasting"] and failure["known"]) for failure in report["failures"])


def sentence(reports: Reports) -> str:
    """Return the outcome in one sentence.

    Examples
    --------
    >>> sentence([{"vessel": "a", "status": "changed", "failures": []}])
    '1 vessels: 1 changed'
    """
    counts = Counter(str(report["status"]) for report in reports)
    counted = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
    names = [str(report["vessel"]) for report in reports if alarming(report)]
    woken = f"; look at {', '.join(names[:5])}{' ...' if names[5:] else ''}" if names else ""
    known = sum(1 for report in reports if report["failures"] and not alarming(report))
    return f"{len(reports)} vessels: {counted or 'none'}" + (f" ({known} as the run before)" if known else "") + woken


def table(reports: Reports) -> list[dict[str, Any]]:
    """Return one row a vessel, failures in words; of a large fleet only those where something happened."""
    shown = reports if len(reports) <= MOST_ROWS else [r for r in reports if r["status"] != "unchanged"]
    return [
        {
            **{k: v for k, v in report.items() if k not in ("failures", "verified")},
            "failures": "; ".join(f"{f['what']}: {f['error']['message']}" for f in report["failures"]),
        }
        for report in shown
    ]


def markdown(reports: Reports) -> str:
    """Return the summary of a run as Markdown: what was done, who failed with what, and what to do about it."""
    keys = ("logs", "reread", "searched", "segments", "new_sets", "kept_sets")
    totals = {key: sum(int(r[key]) for r in reports) for key in keys}
    verified: Counter[str] = sum((Counter(r["verified"]) for r in reports), Counter())
    lines = [
        f"# {sentence(reports)}",
        "",
        f"{totals['logs']} logs, {totals['reread']} read anew, {totals['searched']} only searched anew; "
        f"{totals['segments']} zigzags; {totals['new_sets']} new parameter sets, {totals['kept_sets']} kept.",
    ]
    if verified:
        lines += ["", "Verified: " + ", ".join(f"{count} {verdict}" for verdict, count in sorted(verified.items()))]
    failed = sorted((r for r in reports if r["failures"]), key=lambda r: (not alarming(r), r["vessel"]))
    if failed:
        lines += ["", "| vessel | failed | since | what to do |", "| --- | --- | --- | --- |"]
    for report in failed[:_MOST_TOLD]:
        first, *others = sorted(report["failures"], key=lambda f: f["known"])
        more = f" (and {len(others)} more)" if others else ""
        since = "before" if first["known"] else "this run"
        cells = (report["vessel"], f"{first['what']}: {first['error']['message']}{more}", since)
        lines.append(f"| {' | '.join(map(_cell, (*cells, first['error']['next_step'])))} |")
    if failed[_MOST_TOLD:]:
        lines += ["", f"... and {len(failed) - _MOST_TOLD} more, in the table `kempf-reprocess`."]
    return "\n".join(lines)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
