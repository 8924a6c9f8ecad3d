"""What is said to the world outside when a run begins and ends: metrics and lineage, where the settings ask for them.

Nothing here fails a run: what cannot be sent is a warning in its log.
"""

from __future__ import annotations

from typing import Any

from kempf.flows.fleet import lineage, metrics

#: what an end is called in an event
_ENDS: dict[str, lineage.What] = {"COMPLETED": "COMPLETE", "CANCELLED": "ABORT"}


def began(flow: Any, run: Any, state: Any) -> None:
    """Say that a run began."""
    if lineage.wanted():
        _warn(run, lineage.emit(lineage.Event("START", flow.name, str(run.id), run.parameters)))


def ended(flow: Any, run: Any, state: Any) -> None:
    """Say how a run ended."""
    succeeded = state.type.name == "COMPLETED"
    if metrics.wanted():
        end = state.timestamp
        begun = run.start_time or end
        registry = metrics.registry_of(
            flow.name,
            end_s=end.timestamp(),
            duration_s=(end - begun).total_seconds(),
            succeeded=succeeded,
            found=_result(state),
        )
        _warn(run, metrics.publish(flow.name, registry))
    if lineage.wanted():
        message = "" if succeeded else str(state.message or state.name)
        kind = _ENDS.get(state.type.name, "FAIL")
        _warn(run, lineage.emit(lineage.Event(kind, flow.name, str(run.id), run.parameters, message)))


#: Of every flow.
HOOKS: dict[str, Any] = {
    "on_running": [began],
    "on_completion": [ended],
    "on_failure": [ended],
    "on_crashed": [ended],
    "on_cancellation": [ended],
}


def _result(state: Any) -> Any:
    """Return what a run returned or the error that it ended with; None where nobody knows any more."""
    try:
        return state.result(raise_on_failure=False)
    except Exception:  # noqa: BLE001 - of a run that crashed there is none
        return None


def _warn(run: Any, sentences: list[str]) -> None:
    from prefect.logging.loggers import flow_run_logger

    for sentence in sentences:
        flow_run_logger(run).warning(sentence)
