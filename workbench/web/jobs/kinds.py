"""What the jobs do: each is the job that the command line runs.

Each takes the warehouse, the folder of what is kept, its arguments and a `Progress`, and returns JSON content, of which
``to`` is the address of what it made.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from kempf.flows.process.progress import Progress
from kempf.warehouse.store import Warehouse
from kempf.workbench.web.addresses import of_vessel

Work = Callable[[Warehouse, Path, Mapping[str, Any], Progress], dict[str, Any]]


def predict(warehouse: Warehouse, state: Path, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """Put a vessel's manoeuvres beside what a parameter set predicts, and keep it for the page."""
    from kempf.flows.jobs.compare_vessel import compare_vessel
    from kempf.workbench.web.data.predictions import keep

    found = compare_vessel(warehouse, arguments["vessel"], arguments["set"], arguments["horizon"], progress)
    keep(state, arguments["key"], found)
    return {"to": f"{of_vessel(arguments['vessel'])}/model?set={arguments['set']}&h={arguments['horizon']}"}


def diagnose(warehouse: Warehouse, state: Path, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """Find which physical effect a vessel's model lacks."""
    from kempf.flows.jobs.diagnose_vessel import diagnose_vessel
    from kempf.flows.jobs.standing_model import standing_model

    spec, own = standing_model(warehouse, arguments["vessel"])
    made, _ = diagnose_vessel(warehouse, arguments["vessel"], spec, own, progress=progress)
    return {"to": f"/diagnoses/{made.diagnosis_id}"}


def add(warehouse: Warehouse, state: Path, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """Add an effect to a vessel's current model."""
    from kempf.flows.jobs.add_effect import add_effect

    made = add_effect(warehouse, arguments["vessel"], arguments["effect"], progress=progress)
    return {"to": f"{of_vessel(arguments['vessel'])}/ladder", "parameter_set_id": made.parameter_set_id}


def undo(warehouse: Warehouse, state: Path, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """Make the model before a vessel's current one the current one again."""
    from kempf.flows.jobs import standing_model

    before = standing_model.undo(warehouse, arguments["vessel"])
    return {"to": f"{of_vessel(arguments['vessel'])}/ladder", "parameter_set_id": before.parameter_set_id}


def reprocess(warehouse: Warehouse, state: Path, arguments: Mapping[str, Any], progress: Progress) -> dict[str, Any]:
    """Bring a vessel up to date with her profile, her logs and the code."""
    from kempf.flows.jobs.reprocess_vessel import reprocess_vessel

    report = reprocess_vessel(warehouse, arguments["vessel"], progress=progress)
    return {"to": of_vessel(arguments["vessel"]), "report": report.show()}


#: By the name that a form gives; what each is called, and what it needs besides the vessel.
KINDS: Mapping[str, tuple[Work, str, tuple[str, ...]]] = {
    "predict": (predict, "Predict", ("set", "horizon")),
    "diagnose": (diagnose, "Diagnose", ()),
    "add": (add, "Add the effect", ("effect",)),
    "undo": (undo, "Undo the last effect", ()),
    "reprocess": (reprocess, "Bring up to date", ()),
}
