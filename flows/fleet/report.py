"""How a run over the fleet is reported: a table, a summary, one sentence, and whether somebody should be woken."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from kempf.schemas.enumeration import counted
from kempf.schemas.errors import DataRejected
from kempf.schemas.quality import FINDINGS, NO_LIMITS, FleetLimits, in_words
from kempf.warehouse.storage.keys import segment_of_address

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

    def __init__(self, reports: Reports, quality: FleetLimits) -> None:
        super().__init__(
            "vessels_failed",
            f"{sentence(reports, quality)}.",
            "The artifact kempf-fleet of the run says for each what to do; then run it again.",
            {"reports": list(reports)},
        )


def alarming(report: Mapping[str, Any]) -> bool:
    """Return whether a vessel failed in a way that has not been reported yet, or that another attempt may overcome."""
    return any(not (failure["lasting"] and failure["known"]) for failure in report["failures"])


def beyond(report: Mapping[str, Any], quality: FleetLimits) -> list[str]:
    """Return what a vessel has more of than the limits allow, such as ``2 logs without a manoeuvre to fit``."""
    return [in_words(kind, count) for kind, count in _over(report, quality).items()]


def _over(report: Mapping[str, Any], quality: FleetLimits) -> dict[str, int]:
    """Return how many findings a vessel has of each kind of which she has more than the limits allow."""
    limits = {kind: quality.limit(str(report["vessel"]), kind) for kind in FINDINGS}
    counts = _counts([report])
    return {kind: counts[kind] for kind, limit in limits.items() if limit is not None and counts[kind] > limit}


def _counts(reports: Reports) -> Counter[str]:
    return Counter(str(finding["kind"]) for report in reports for finding in report["findings"])


def _in_words(counts: Mapping[str, int]) -> str:
    return ", ".join(in_words(kind, counts[kind]) for kind in FINDINGS if counts[kind])


def needs_a_person(report: Mapping[str, Any], quality: FleetLimits) -> bool:
    """Return whether a run is not to end as Completed for the sake of a vessel."""
    return alarming(report) or bool(beyond(report, quality))


def sentence(reports: Reports, quality: FleetLimits = NO_LIMITS) -> str:
    """Return the outcome in one sentence.

    Examples
    --------
    >>> sentence([{"vessel": "a", "status": "changed", "failures": [], "findings": []}])
    '1 vessel: 1 changed'
    """
    counts = Counter(str(report["status"]) for report in reports)
    by_status = ", ".join(f"{count} {status}" for status, count in sorted(counts.items()))
    names = [str(report["vessel"]) for report in reports if alarming(report)]
    woken = f"; look at {', '.join(names[:5])}{' ...' if names[5:] else ''}" if names else ""
    known = sum(1 for report in reports if report["failures"] and not alarming(report))
    bad = [str(report["vessel"]) for report in reports if beyond(report, quality)]
    poor = f"; {len(bad)} beyond the limits of quality: {', '.join(bad[:5])}{' ...' if bad[5:] else ''}" if bad else ""
    before = f" ({known} as the run before)" if known else ""
    vessels = counted(len(reports), "vessel")
    return f"{vessels}: {by_status or 'none'}{before}{woken}{poor}"


def table(reports: Reports) -> list[dict[str, Any]]:
    """Return one row a vessel, failures in words; of a large fleet only those where something happened."""
    shown = reports if len(reports) <= MOST_ROWS else [r for r in reports if r["status"] != "unchanged"]
    return [
        {
            **{k: v for k, v in report.items() if k not in ("failures", "verified", "findings")},
            "failures": "; ".join(f"{f['what']}: {f['error']['message']}" for f in report["failures"]),
            "findings": findings_in_words(report),
        }
        for report in shown
    ]


def findings_in_words(report: Mapping[str, Any]) -> str:
    """Return how many findings of each kind a vessel has, in words."""
    return _in_words(_counts([report]))


def markdown(reports: Reports, quality: FleetLimits = NO_LIMITS, pages: str | None = None) -> str:
    """Return the summary of a run as Markdown: what was done, who failed with what, what is wrong with the models.

    Parameters
    ----------
    pages : str, optional
        Address at which `kempf workbench` is served: vessels link to their pages there.
    """
    keys = ("logs", "reread", "searched", "segments", "new_sets", "kept_sets")
    totals = {key: sum(int(r[key]) for r in reports) for key in keys}
    verified: Counter[str] = sum((Counter(r["verified"]) for r in reports), Counter())
    lines = [
        f"# {sentence(reports, quality)}",
        "",
        f"{totals['logs']} logs, {totals['reread']} read anew, {totals['searched']} only searched anew; "
        f"{totals['segments']} manoeuvres to fit; {totals['new_sets']} new parameter sets, {totals['kept_sets']} kept.",
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
        cells = (f"{first['what']}: {first['error']['message']}{more}", since, first["error"]["next_step"])
        lines.append(f"| {' | '.join((_vessel(report, pages), *map(_cell, cells)))} |")
    if failed[_MOST_TOLD:]:
        lines += ["", f"... and {len(failed) - _MOST_TOLD} more, in the table `kempf-reprocess`."]
    return "\n".join(lines + _quality(reports, quality, pages))


def _quality(reports: Reports, quality: FleetLimits, pages: str | None) -> list[str]:
    """Return what is wrong with logs and models: how much in the fleet, and each of those who are beyond the limits."""
    totals = _counts(reports)
    if not totals:
        return []
    lines = ["", "## Quality", "", f"{_in_words(totals)}."]
    bad = [report for report in reports if beyond(report, quality)]
    if bad:
        lines += ["", "| vessel | beyond the limits | for example |", "| --- | --- | --- |"]
    for report in bad[:_MOST_TOLD]:
        over = _over(report, quality)
        example = next(str(finding["words"]) for finding in report["findings"] if finding["kind"] in over)
        cells = (", ".join(beyond(report, quality)), example)
        lines.append(f"| {' | '.join((_vessel(report, pages), *map(_cell, cells)))} |")
    if bad[_MOST_TOLD:]:
        lines += ["", f"... and {len(bad) - _MOST_TOLD} more, in the table `kempf-reprocess`."]
    return lines


def _vessel(report: Mapping[str, Any], pages: str | None) -> str:
    name = _cell(str(report["vessel"]))
    if pages is None:
        return name
    return f"[{name}]({pages.rstrip('/')}/v/{segment_of_address(str(report['vessel']))})"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
