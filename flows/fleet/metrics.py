"""Figures of a run for Prometheus: a flow is a batch job, so they are left or pushed at its end, not scraped."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kempf.flows.process.configuration import setting

if TYPE_CHECKING:
    from prometheus_client import CollectorRegistry

#: Figures by name, what each is, and by what it is divided.
FIGURES: dict[str, tuple[str, tuple[str, ...]]] = {
    "kempf_run_end_timestamp_seconds": ("When the flow's last run ended, s since 1970", ()),
    "kempf_run_duration_seconds": ("How long the flow's last run took", ()),
    "kempf_run_succeeded": ("1 where the flow's last run ended as Completed, else 0", ()),
    "kempf_run_vessels": ("Vessels of the flow's last run", ("status",)),
    "kempf_run_new_parameter_sets": ("Parameter sets that the flow's last run made", ()),
    "kempf_run_failures": ("What failed in the flow's last run", ("code",)),
    "kempf_run_findings": ("Findings on logs and models in the flow's last run", ("kind",)),
    "kempf_run_logs": ("Logs of the flow's last run", ("outcome",)),
}
#: Label of every figure: which flow it is of.
_FLOW = "flow"
Figure = tuple[str, tuple[str, ...], float]


def figures_of(flow: str, result: Any) -> Iterator[Figure]:
    """Yield what a run's result says, each with the name of the figure and the values of its labels.

    Parameters
    ----------
    flow : str
        Name of the flow.
    result : object
        What it returned, or the error that it ended with.
    """
    details = getattr(result, "details", None)
    rows = details if isinstance(details, Mapping) else result
    if flow == "ingest":
        yield from _counted("kempf_run_logs", _outcomes(rows))
    elif flow == "reprocess":
        reports = _rows(rows, "reports")
        yield from _counted("kempf_run_vessels", [report["status"] for report in reports])
        yield from _counted("kempf_run_findings", [f["kind"] for report in reports for f in report["findings"]])
        yield from _counted(
            "kempf_run_failures", [f["error"]["code"] for report in reports for f in report["failures"]]
        )
        if reports:
            yield "kempf_run_new_parameter_sets", (), float(sum(report["new_sets"] for report in reports))
    elif flow == "identify":
        sets = [row for row in _rows(rows) if row.get("parameter_set")]
        yield "kempf_run_new_parameter_sets", (), float(len(sets))
    elif flow == "diagnose":
        by_vessel = {row["vessel"]: row for row in _rows(rows)}
        yield from _counted("kempf_run_vessels", [row["verdict"] for row in by_vessel.values()])


def _outcomes(rows: Any) -> list[str]:
    """Return what became of every log, whether the run was of logs or of an inbox, and however it ended."""
    outcomes = [str(row["outcome"]) for row in _rows(rows, "outcomes", "ingested")]
    return outcomes + ["quarantined"] * (len(rows.get("quarantined", ())) if isinstance(rows, Mapping) else 0)


def _rows(result: Any, *keys: str) -> Sequence[Any]:
    """Return the rows of a result; of an error's details those under some keys. Of neither there are none."""
    if isinstance(result, Mapping):
        return [row for key in keys for row in result.get(key, ())]
    return result if isinstance(result, list) else []


def _counted(name: str, values: Sequence[str]) -> Iterator[Figure]:
    for value, count in sorted(Counter(values).items()):
        yield name, (value,), float(count)


def registry_of(flow: str, *, end_s: float, duration_s: float, succeeded: bool, found: Any) -> CollectorRegistry:
    """Return the figures of one run.

    Parameters
    ----------
    end_s, duration_s : float
        When it ended, s since 1970, and how long it took, s.
    succeeded : bool
        Whether it ended as Completed.
    found : object
        See `figures_of`.
    """
    from prometheus_client import CollectorRegistry, Gauge

    registry = CollectorRegistry()
    gauges = {name: Gauge(name, text, (_FLOW, *by), registry=registry) for name, (text, by) in FIGURES.items()}
    of_run = (
        ("kempf_run_end_timestamp_seconds", (), end_s),
        ("kempf_run_duration_seconds", (), duration_s),
        ("kempf_run_succeeded", (), float(succeeded)),
    )
    for name, labels, value in (*of_run, *figures_of(flow, found)):
        gauges[name].labels(flow, *labels).set(value)
    return registry


def publish(flow: str, registry: CollectorRegistry) -> list[str]:
    """Leave the figures of a run where the settings say.

    Returns
    -------
    list of str
        Why it could not be done, a sentence each: a run does not fail by it.
    """
    from prometheus_client import pushadd_to_gateway, write_to_textfile

    failed = []
    folder, gateway = setting("metrics.textfile"), setting("metrics.pushgateway")
    if folder:
        path = Path(folder).expanduser() / f"kempf_{flow}.prom"
        try:
            write_to_textfile(os.fspath(path), registry)
        except OSError as error:
            failed.append(f"The metrics of the run could not be written to {path}: {error.strerror or error}.")
    if gateway:
        try:
            pushadd_to_gateway(gateway, job="kempf", registry=registry, grouping_key={_FLOW: flow}, timeout=10)
        except (OSError, ValueError) as error:
            failed.append(f"The metrics of the run could not be pushed to {gateway}: {error}.")
    return failed


def wanted() -> bool:
    """Return whether the settings name a place for metrics."""
    return bool(setting("metrics.textfile") or setting("metrics.pushgateway"))
