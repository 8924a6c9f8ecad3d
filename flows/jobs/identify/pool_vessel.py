"""The job that identifies one hull from all manoeuvres of a vessel and stores it as a parameter set of its own."""

from __future__ import annotations

from collections.abc import Sequence

from kempf.flows.jobs.identify.chosen_manoeuvres import Chosen, choose, without_log
from kempf.flows.jobs.identify.identify_vessel import IdentifyOutcome, Request
from kempf.flows.jobs.identify.pending import PendingSets, waiting
from kempf.flows.jobs.identify.standing_model import SINGLE
from kempf.flows.jobs.identify.update_model import store_up_to_date
from kempf.flows.process.progress import Progress, silent
from kempf.schemas.errors import KempfError
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs
from kempf.warehouse.tables.parameter_set import ParameterSet


def pool_vessel(
    warehouse: Warehouse,
    vessel: str,
    request: Request,
    outcomes: Sequence[IdentifyOutcome],
    *,
    flow_run: str | None = None,
    progress: Progress = silent,
) -> tuple[ParameterSet, bool] | None:
    """Identify one hull from the segments that maximum likelihood could identify one by one, and store it.

    Parameters, results and errors are those of `pool_segments`, which leaves the storing to its caller.
    """
    with waiting(warehouse, vessel) as new:
        return pool_segments(warehouse, vessel, request, outcomes, new, flow_run=flow_run, progress=progress)


def poolable(warehouse: Warehouse, vessel: str, request: Request, outcomes: Sequence[IdentifyOutcome]) -> Chosen | str:
    """Return the manoeuvres that are pooled, each manoeuvre once, or why there is nothing to pool."""
    if request.estimator != SINGLE:
        return f"the estimator {request.estimator} takes one manoeuvre at a time; {SINGLE} pools"
    # a log none of whose manoeuvres could be identified stays out
    usable = {o.segment.ingest_id for o in outcomes if o.set_id is not None}
    if not usable:
        return "no manoeuvre could be identified"
    unusable = {row.ingest_id for row in logs.current(warehouse, vessel)} - usable
    chosen = choose(warehouse, vessel, dict.fromkeys(unusable, "no manoeuvre of its log could be identified"))
    if len(chosen.segments) < 2:
        others = "; ".join(sorted(set(chosen.skipped.values())))
        return "there is one manoeuvre that counts" + (f", of the others: {others}" if others else "")
    # pooled with the speed over ground they would be wrong together, and sure of it
    if request.spec.current != "none" and any(without_log(segment) for segment in chosen.segments):
        return (
            "the manoeuvres have no speed through the water, and in a current that over ground is another; in still "
            "water `surroundings: pond` of the profile, or a model with `current: none` (--model FILE), pools them"
        )
    return chosen


def pool_segments(
    warehouse: Warehouse,
    vessel: str,
    request: Request,
    outcomes: Sequence[IdentifyOutcome],
    new: PendingSets,
    *,
    adopt: bool = True,
    flow_run: str | None = None,
    progress: Progress = silent,
) -> tuple[ParameterSet, bool] | None:
    """Identify one hull from the segments that maximum likelihood could identify one by one.

    Parameters
    ----------
    request : Request
        What the segments were identified with.
    outcomes : sequence of IdentifyOutcome
        Of that job.
    new : PendingSets
        Takes the set where it is new, and where ``current`` shall point.
    adopt : bool, optional
        Whether ``current`` may move to this model from another one.

    Returns
    -------
    (ParameterSet, bool) or None
        The pooled set, and whether it is new; None where there is nothing to pool, see `poolable`.

    Raises
    ------
    KempfError
        The segments have nothing in common.
    """
    chosen = poolable(warehouse, vessel, request, outcomes)
    if isinstance(chosen, str):
        return None
    parameter_set, is_new = store_up_to_date(
        *(warehouse, chosen, request.spec, request.own, progress, flow_run), keep=new.keep
    )
    if parameter_set.convergence.get("converged") and new.may_move(request.spec, adopt=adopt):
        new.point(parameter_set.parameter_set_id)
    return parameter_set, is_new


def not_pooled(
    warehouse: Warehouse,
    vessel: str,
    request: Request,
    outcomes: Sequence[IdentifyOutcome],
    pooled: ParameterSet | KempfError | None,
) -> dict[str, str]:
    """Say of every manoeuvre that the pooled set is not fitted to, by segment, why.

    Parameters
    ----------
    pooled : ParameterSet, KempfError or None
        What came of `pool_vessel`.

    Returns
    -------
    dict of str to str
        Empty for a vessel with a single manoeuvre: there is nothing to pool.
    """
    names = [outcome.segment.segment_id for outcome in outcomes]
    if len(names) < 2:
        return {}
    if isinstance(pooled, KempfError):
        return dict.fromkeys(names, pooled.message)
    chosen = poolable(warehouse, vessel, request, outcomes)
    if isinstance(chosen, str):
        return dict.fromkeys(names, chosen)
    left = chosen.skipped | dict(pooled.convergence.get("left_out") or {}) if pooled else chosen.skipped
    return {name: left[name] for name in names if name in left}
