"""What the jobs do: each is the job that the command line runs.

Each returns JSON content. Of it ``to`` is the address of what it made; a job without one is its own page, which shows
the result.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from urllib.parse import urlencode

from kempf.flows.process.progress import Progress
from kempf.schemas.errors import DataRejected, KempfError
from kempf.schemas.instants import iso_utc
from kempf.warehouse.storage.store import Warehouse
from kempf.workbench.instants import end_of
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.uploads import paths_of

if TYPE_CHECKING:
    from kempf.flows.jobs.corrections.correct_segments import Planned


@dataclass(frozen=True)
class Work:
    """What a job is given."""

    warehouse: Warehouse
    #: Folder of the queue and of what is kept.
    state: Path
    arguments: Mapping[str, Any]
    progress: Progress


def compare(work: Work) -> dict[str, Any]:
    """Put a vessel's manoeuvres beside what a parameter set predicts of them, at every horizon, and keep it."""
    vessel, name, horizon = work.arguments["vessel"], work.arguments["set"], work.arguments["horizon"]
    _keep_predictions(work.warehouse, work.state, vessel, name, work.progress, horizon)
    return {"to": f"{of_vessel(vessel)}/model?set={name}&h={horizon}"}


def _keep_predictions(
    warehouse: Warehouse, state: Path, vessel: str, name: str, progress: Progress, asked: str | None = None
) -> None:
    """Keep what a set predicts at every horizon; one that is too long for the runs is left out, unless asked for."""
    from kempf.flows.jobs.compare.bound_runs import bound
    from kempf.flows.jobs.compare.compare_vessel import compared
    from kempf.flows.jobs.state.vessel_state import fleet_state
    from kempf.pipeline.predict.horizon import horizon_of
    from kempf.workbench.web.data.predictions import HORIZONS, keep, key_of

    rests_on = fleet_state(warehouse, [vessel])[vessel]
    bound_runs = bound(warehouse, vessel, name, progress)
    every = dict.fromkeys((*([asked] if asked else []), *(horizon_of(short).name for short, _ in HORIZONS)))
    for horizon in every:
        if horizon == "legs" and bound_runs.legs is None:
            continue  # it is the free run
        try:
            keep(state, key_of(rests_on, name, horizon), compared(bound_runs, horizon_of(horizon), progress))
        except DataRejected:
            if horizon == asked:
                raise


def _keep_those_of_current(warehouse: Warehouse, state: Path, vessel: str, progress: Progress) -> None:
    """Keep what a vessel's current set predicts, so that the page of her model need not wait."""
    from kempf.flows.jobs.identify.standing_model import current_id

    _keep_those_of(warehouse, state, vessel, current_id(warehouse, vessel), progress)


def _keep_those_of(warehouse: Warehouse, state: Path, vessel: str, name: str | None, progress: Progress) -> None:
    """Keep what a set predicts, where there is a set and it is not kept."""
    from kempf.workbench.web.data.predictions import kept_of

    if name is not None:
        with suppress(KempfError):  # the page says why when it is asked for
            if kept_of(warehouse, state, vessel, name, None).prediction is None:
                _keep_predictions(warehouse, state, vessel, name, progress)


def diagnose(work: Work) -> dict[str, Any]:
    """Find which physical effect a vessel's model lacks."""
    from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_vessel
    from kempf.flows.jobs.identify.standing_model import standing_model

    spec, own = standing_model(work.warehouse, work.arguments["vessel"])
    diagnosis, _ = diagnose_vessel(work.warehouse, work.arguments["vessel"], spec, own, progress=work.progress)
    _keep_those_of(work.warehouse, work.state, work.arguments["vessel"], diagnosis.parameter_set_id, work.progress)
    return {"to": f"/diagnoses/{diagnosis.diagnosis_id}"}


def report(work: Work) -> dict[str, Any]:
    """Write the report of a diagnosis, made first where it is not stored; the file is that of `kempf report`."""
    from kempf.workbench.chosen_model import chosen_model
    from kempf.workbench.report.build import make_report
    from kempf.workbench.report.file_name import called_after
    from kempf.workbench.web.data.reports import keep

    vessel = work.arguments["vessel"]
    spec, own = chosen_model(work.warehouse, vessel, work.arguments["set"] or None, None)
    made = make_report(work.warehouse, vessel, spec, own, work.progress)
    return {
        "report": keep(work.state, made.html),
        "file_name": called_after(vessel),
        "bytes": len(made.html.encode()),
        "diagnosis_id": made.diagnosis_id,
        "headline": made.content.wording.headline,
    }


def add(work: Work) -> dict[str, Any]:
    """Add an effect to a vessel's current model."""
    from kempf.flows.jobs.diagnose.add_effect import add_effect
    from kempf.flows.jobs.diagnose.try_formula import formula_of_ones_own
    from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN

    name, formula = work.arguments["effect"], work.arguments["formula"]
    own = formula_of_ones_own(name, formula) if formula else NONE_OF_ONES_OWN
    parameter_set = add_effect(
        work.warehouse,
        work.arguments["vessel"],
        name,
        own,
        progress=work.progress,
        shown=work.arguments["standing"] or None,
    )
    # before and after are looked at beside each other
    for each in (parameter_set.parameter_set_id, parameter_set.parent):
        _keep_those_of(work.warehouse, work.state, work.arguments["vessel"], each, work.progress)
    return {"to": f"{of_vessel(work.arguments['vessel'])}/ladder", "parameter_set_id": parameter_set.parameter_set_id}


def undo(work: Work) -> dict[str, Any]:
    """Make the model before a vessel's current one the current one again."""
    from kempf.flows.jobs.identify import standing_model

    before = standing_model.undo(work.warehouse, work.arguments["vessel"], work.arguments["standing"] or None)
    return {"to": f"{of_vessel(work.arguments['vessel'])}/ladder", "parameter_set_id": before.parameter_set_id}


def reprocess(work: Work) -> dict[str, Any]:
    """Bring a vessel up to date with her profile, her logs and the code."""
    from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel

    report = reprocess_vessel(work.warehouse, work.arguments["vessel"], progress=work.progress)
    _keep_those_of_current(work.warehouse, work.state, work.arguments["vessel"], work.progress)
    return {"to": of_vessel(work.arguments["vessel"]), "report": report.as_json()}


def ingest(work: Work) -> dict[str, Any]:
    """Take the logs in that a browser sent; the result is what `kempf ingest --json` prints of each."""
    from kempf.flows.jobs.ingest.files import read_profiles
    from kempf.flows.jobs.ingest.ingest_logs import ingest as take_in

    paths = paths_of(work.state, work.arguments["files"])
    profiles = read_profiles(paths_of(work.state, work.arguments["profile"])) if work.arguments["profile"] else None
    new = bool(work.arguments["new_vessel"])
    outcomes = take_in(work.warehouse, paths, work.arguments["vessel"], profiles, work.progress, new_vessel=new)
    failed = [outcome.error for outcome in outcomes if outcome.error is not None]
    if len(failed) == len(outcomes):
        raise _with_draft(failed[0], paths[0], work.arguments["vessel"])
    return {"outcomes": [{**outcome.as_json(), "path": Path(outcome.path).name} for outcome in outcomes]}


def _with_draft(error: KempfError, log: Path, vessel: str) -> KempfError:
    """Return the error of a log that needs a profile with the draft of one, for a person to correct."""
    if error.code == "no_source_for_log":
        from kempf.flows.jobs.ingest.draft_profile import draft

        with suppress(KempfError):
            # a JSON text is a YAML one
            error.details["draft"] = draft(log).replace('vessel: "?"', f"vessel: {json.dumps(vessel)}", 1)
    return error


def preview(work: Work) -> dict[str, Any]:
    """Look what a correction of a manoeuvre would change; the result is what `kempf segments` prints of it."""
    work.progress(0, 1, "looking through the log with the correction")
    return {"planned": _planned(work.warehouse, work.arguments).as_json()}


def correct(work: Work) -> dict[str, Any]:
    """Correct, exclude, accept or add a manoeuvre, and supersede what rests on what it was."""
    work.progress(0, 1, "looking through the log with the correction")
    planned = _planned(work.warehouse, work.arguments)
    planned.store(work.warehouse)
    return {"planned": planned.as_json()}  # its own page says what can be done next


def _planned(warehouse: Warehouse, arguments: Mapping[str, Any]) -> Planned:
    from kempf.flows.jobs.corrections.correct_segments import plan_for, plan_new

    ends = arguments["bounds_utc_ns"]
    bounds = (int(ends[0]), int(ends[1])) if ends else None
    if bounds is not None and arguments["action"] == "add":
        return plan_new(warehouse, arguments["log"], bounds, arguments["reason"])
    return plan_for(warehouse, arguments["segment"], arguments["action"], arguments["reason"], bounds)


def predict_manoeuvre(work: Work) -> dict[str, Any]:
    """Predict a standard manoeuvre; the result is what `kempf predict --compare --json` prints, with what is drawn."""
    from kempf.flows.jobs.predict.checked_prediction import predict_checked
    from kempf.flows.jobs.predict.compare_predicted import measured_beside, other_orders
    from kempf.workbench.documents.prediction import prediction_document
    from kempf.workbench.web.data.sailed import curves_of, request_of

    predicted = predict_checked(work.warehouse, work.arguments["vessel"], request_of(work.arguments), work.progress)
    measured = measured_beside(work.warehouse, predicted, work.progress)
    document = prediction_document(predicted, measured, other_orders(work.warehouse, predicted))
    fields = {name: work.arguments[name] for name in ("manoeuvre", "rudder", "angles", "side", "speed", "set")}
    to = f"{of_vessel(work.arguments['vessel'])}/predict?{urlencode(fields)}"
    return {"to": to, "document": document, "curves": curves_of(predicted.prediction)}


def try_formula(work: Work) -> dict[str, Any]:
    """Try an effect of one's own; the result is what `kempf effects try --json` prints."""
    from kempf.flows.jobs.diagnose.try_formula import tried

    vessel, formula, name = (work.arguments[field] for field in ("vessel", "formula", "name"))
    return {"document": tried(work.warehouse, vessel, formula, name, work.progress)}


def what_if(work: Work) -> dict[str, Any]:
    """Move one parameter of a set; the result is what `kempf what-if --json` prints, with what is drawn."""
    from kempf.flows.jobs.compare import what_if as job

    vessel, fields = work.arguments["vessel"], {name: work.arguments[name] for name in ("parameter", "set", "segment")}
    segment_id = fields["segment"] or None
    outcome = job.what_if(work.warehouse, vessel, fields["parameter"], fields["set"], segment_id, work.progress)
    to = f"{of_vessel(vessel)}/what-if?{urlencode(fields)}"
    return {"to": to, "document": outcome.as_json(), "series": job.series_of(outcome)}


def explain(work: Work) -> dict[str, Any]:
    """Score every effect on a stretch of a manoeuvre; the result is what `kempf explain --json` prints."""
    from kempf.flows.jobs.diagnose.explain_stretch import explain_stretch

    vessel, (begin, end) = work.arguments["vessel"], work.arguments["window_utc_ns"]
    named = work.arguments["segment"]
    stretch = explain_stretch(work.warehouse, vessel, begin, end, work.arguments["set"], work.progress, named)
    fields = {"set": work.arguments["set"], "from": iso_utc(begin), "to": iso_utc(end), "segment": named}
    return {"to": f"{of_vessel(vessel)}/explain?{urlencode(fields)}", "document": stretch.as_json()}


def next_trial(work: Work) -> dict[str, Any]:
    """Find the zigzag to sail next; the result is what `kempf next-trial --json` prints."""
    from kempf.flows.jobs.predict import next_trial as job

    vessel, fields = work.arguments["vessel"], {name: work.arguments[name] for name in ("set", "parameter")}
    trial = job.next_trial(work.warehouse, vessel, fields["set"], fields["parameter"] or None, work.progress)
    return {"to": f"{of_vessel(vessel)}/next-trial?{urlencode(fields)}", "document": trial.as_json()}


def history_changes(work: Work) -> dict[str, Any]:
    """Put a vessel's parameters to the tests; the result is what `kempf history --changes --json` prints."""
    from kempf.warehouse.queries import history
    from kempf.warehouse.queries.comparable import comparable_sets
    from kempf.workbench.documents.changes import changes_document, examined

    vessel, as_of = work.arguments["vessel"], work.arguments["as_of"]
    then = end_of(as_of, "as_of") if as_of else None
    kinds = comparable_sets(work.warehouse, vessel, then)
    changes = []
    for done, kind in enumerate(kinds):
        work.progress(done, len(kinds), f"testing the sets of model {kind.model}, {kind.estimator}")
        changes.append(examined(kind).as_json())
    of = history.of_vessel(work.warehouse, vessel, as_of=then)
    to = f"{of_vessel(vessel)}/changes" + (f"?{urlencode({'as_of': as_of})}" if as_of else "")
    return {"to": to, "document": changes_document(vessel, of, changes)}


class Kind(NamedTuple):
    """What a form may ask for."""

    do: Callable[[Work], dict[str, Any]]
    #: What it is called.
    title: str
    #: Fields of the form besides the vessel's; one that is not sent is blank.
    fields: tuple[str, ...]
    #: Whether it changes the warehouse: asked for again in a state that was there before, it is done again.
    changes: bool = False


#: By the name that a form gives.
KINDS: Mapping[str, Kind] = {
    "ingest": Kind(ingest, "Take logs in", ("files", "profile", "new_vessel"), changes=True),
    "predict": Kind(compare, "Predict", ("set", "horizon")),
    "explain": Kind(explain, "Explain a stretch", ("from", "to", "set", "segment")),
    "what_if": Kind(what_if, "Move a parameter", ("parameter", "set", "segment")),
    "sail": Kind(predict_manoeuvre, "Predict a manoeuvre", ("set", "manoeuvre", "rudder", "angles", "side", "speed")),
    "next_trial": Kind(next_trial, "Find the next trial", ("set", "parameter")),
    "changes": Kind(history_changes, "Look for changes", ("as_of",)),
    "diagnose": Kind(diagnose, "Diagnose", ()),
    "report": Kind(report, "Write the report", ("set",), changes=True),
    "try": Kind(try_formula, "Try a formula", ("formula", "name")),
    "add": Kind(add, "Add the effect", ("effect", "formula", "standing"), changes=True),
    "undo": Kind(undo, "Undo the last effect", ("standing",), changes=True),
    "reprocess": Kind(reprocess, "Bring up to date", (), changes=True),
    "preview": Kind(preview, "Preview a correction", ("action", "segment", "log", "from", "to", "reason")),
    "correct": Kind(correct, "Correct a manoeuvre", ("action", "segment", "log", "from", "to", "reason"), changes=True),
}
