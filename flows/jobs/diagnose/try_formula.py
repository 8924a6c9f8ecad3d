"""The job that tries an effect of a person's own on a vessel's manoeuvres. Nothing is stored."""

from __future__ import annotations

from typing import Any

from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.standing_model import Own, standing_model
from kempf.flows.process.progress import Progress, silent
from kempf.schemas.errors import UsageError
from kempf.warehouse.storage.canonical import plain
from kempf.warehouse.storage.store import Warehouse

#: letters that a formula may have
LONGEST = 500


def formula_of_ones_own(name: str, formula: str) -> Own:
    """Return an effect of a person's own; a slip of the pen is reported here, before anything is read.

    Raises
    ------
    UsageError
        ``formula_too_long``, ``effect_name``; and what reading the formula raises.
    """
    if len(formula) > LONGEST:
        raise UsageError(
            "formula_too_long",
            f"The formula has {len(formula)} letters; at most {LONGEST} are read.",
            "Write it shorter, or as the YAML file of an effect.",
        )
    own = Own(formulas={name: (formula,)})
    own.effects()
    return own


def tried(
    warehouse: Warehouse, vessel: str, formula: str, name: str = "own", progress: Progress = silent
) -> dict[str, Any]:
    """Return what a formula would explain beside the vessel's current model, and whether it holds, as JSON content.

    Parameters
    ----------
    formula : str
        Such as ``yaw: r*abs(r)``.
    name : str, optional
        What the effect is called.

    Raises
    ------
    UsageError
        What `formula_of_ones_own` raises.
    NotFound
        ``no_vessel``, ``no_segments``, ``no_runs``.
    """
    from kempf.flows.jobs.diagnose.diagnose_vessel import examine
    from kempf.pipeline.diagnose.settings import DiagnosisSettings
    from kempf.pipeline.diagnose.verdicts.diagnosis_json import as_json

    tried = formula_of_ones_own(name, formula)
    spec, own = standing_model(warehouse, vessel)
    chosen = choose(warehouse, vessel)
    settings = DiagnosisSettings(level=1.0, refits=1, certain_std=0.0, most_steps=1)
    examined = examine(warehouse, chosen, spec, own.beside(tried), settings, progress, only=(name,))
    document = as_json(examined.diagnosis)
    content = plain({"vessel": vessel, "formula": formula, "beside": list(spec.effects), **document})
    return dict(content)
