"""What of a damaged table no log gives again, in words, and what helps."""

from __future__ import annotations

import shlex

from kempf.flows.jobs.repair.repaired import Repaired
from kempf.schemas.errors import KempfError
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets

#: tables whose rows come of the bytes of a log and of nothing else
OF_LOGS = ("readings", "rejected", "lost", "examinations", "segments")

_AFTER = {
    "vessels": (
        ": profiles are made again from what is kept beside the raw logs, those of earlier ingests and of vessels "
        "without logs are not"
    ),
    "aliases": (
        ": which set is current is chosen anew by `kempf reprocess`, which cannot know the effects of a model; named "
        "aliases are lost, give them again with `kempf params alias NAME ID`"
    ),
    "diagnoses": ": `kempf diagnose` makes them again",
    "diagnosis_evidence": ": `kempf diagnose` makes them again",
    "purges": ": receipts are made again as far as they are kept beside the raw logs",
    "equivalents": ": code that was adopted has to be adopted again with `kempf rerun --all --adopt`",
    "run_history": ": what earlier runs did is not known any more",
    "runs": ": vessels are looked at once more",
    "inbox": ": files are looked at once more",
    "corrections": ": what people said of manoeuvres has to be said again",
    "notes": ": they have to be written again",
}


def say_lost(what: str, name: str, outcome: Repaired) -> None:
    """Say that rows of a table are lost that no log gives again.

    Parameters
    ----------
    what : str
        How much is lost, such as "2 rows of the table notes".
    name : str
        Key of `kempf.schemas.tables.TABLES`.
    """
    outcome.names |= name == "aliases"
    outcome.vessels |= name == "vessels"
    if name == "parameter_sets":
        outcome.sets.append(what)
    elif name not in OF_LOGS and name != "logs":
        outcome.gone.append(f"{what}{_AFTER.get(name, '')}")


def sets_lost(outcome: Repaired) -> None:
    """Say which parameter sets come again; of those that names point to nobody knows what they were made with."""
    named = any(problem.table == "aliases" and problem.kind == "reference" for problem in outcome.left)
    which = " that no name points to" if named else ""
    for what in outcome.sets:
        outcome.gone.append(f"{what}: those of the present code{which} are made again by `kempf reprocess`")


def say_models(warehouse: Warehouse, outcome: Repaired) -> None:
    """Name of every vessel without a current set the last one with effects: `kempf reprocess` chooses a plain one."""
    try:
        sets = parameter_sets.summaries(warehouse)
        effects = parameter_sets.specifications(warehouse, sets["parameter_set_id"].to_list())
        times = parameter_sets.stored_at_ms(warehouse)
        current = aliases.holders(warehouse, aliases.CURRENT)
    except KempfError:
        return  # it is named as what is still wrong
    last: dict[str, str] = {}
    for vessel, name in sorted(sets.select("vessel", "parameter_set_id").rows(), key=lambda row: times.get(row[1], 0)):
        if effects[name].get("effects") and vessel not in current:
            last[vessel] = name
    for vessel, name in sorted(last.items()):
        outcome.gone.append(
            f"which set was the current one of {vessel!r}: her last one with effects is {name} "
            f"({', '.join(effects[name]['effects'])}); `kempf params alias current {name} --vessel "
            f"{shlex.quote(vessel)}` before `kempf reprocess` points to it"
        )
