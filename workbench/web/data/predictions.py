"""Predictions that were made for the pages, kept beside the warehouse; deleting them costs time only."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kempf.flows.jobs.identify.chosen_set import chosen_set
from kempf.flows.jobs.identify.leg_fit import by_name, shown_by_legs
from kempf.flows.jobs.state.vessel_state import VesselState, fleet_state, responsible_code
from kempf.pipeline.channels.series import Float, Mask
from kempf.pipeline.compare.evidence import evidence_in
from kempf.pipeline.predict.horizon import horizon_of
from kempf.warehouse.storage.canonical import canonical_json, sha256
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.storage.whole_file import keep_newest, whole_file
from kempf.warehouse.tables.parameter_set import ParameterSet

if TYPE_CHECKING:
    from kempf.flows.jobs.compare.compare_vessel import Comparison

#: Horizons that the pages offer: as asked for, and in words.
HORIZONS = (
    ("1", "one step"),
    ("10s", "10 s ahead"),
    ("60s", "60 s ahead"),
    ("free", "free run"),
    ("legs", "free run, fitted to legs"),
)
#: predictions kept: the ones made longest ago go first
_MOST = 200
#: what the name of a column begins with that holds at which instants evidence shows
MARK = "mark "


@dataclass(frozen=True, eq=False)
class KeptPrediction:
    """A vessel's manoeuvres beside what a parameter set predicts of them."""

    #: What `kempf compare --where --json` prints.
    document: dict[str, Any]
    #: By segment and column, shape (n,) each; see `kempf.pipeline.compare.run_series`.
    columns: dict[str, dict[str, Float]]

    def series(self, segment_id: str) -> dict[str, Float]:
        """Return what was measured and predicted of a manoeuvre by column, without marks, shape (n,) each."""
        return {name: values for name, values in self.columns[segment_id].items() if not name.startswith(MARK)}

    def shows(self, evidence: str) -> bool:
        """Return whether a piece of evidence shows at instants of its own."""
        return any(f"{MARK}{evidence}" in columns for columns in self.columns.values())

    def marked(self, segment_id: str, evidence: str | None) -> Mask | None:
        """Return at which instants of a manoeuvre a piece of evidence shows, shape (n,); None where it is not its."""
        mark = self.columns[segment_id].get(f"{MARK}{evidence}")
        return None if mark is None else mark.astype(np.bool_)


class Asked(NamedTuple):
    """Which set and horizon are asked for."""

    set_id: str
    horizon: str
    #: None where none is kept.
    prediction: KeptPrediction | None
    #: Whether predictions with the set take parameters fitted to legs.
    by_legs: bool


def free_horizon(parameter_set: ParameterSet, asked: str | None = None) -> str:
    """Return the horizon of a free run as it is shown of a set.

    Of a model with effects it is with the parameters that predictions take, as in its ladder. Of a plain one only where
    that is asked for: what effects bring is seen beside the likelihood's.

    Parameters
    ----------
    asked : str, optional
        ``legs`` takes those fitted to legs of a plain model too, where predictions take them.
    """
    by_legs = by_name(parameter_set) if asked == "legs" else shown_by_legs(parameter_set)
    return "legs" if by_legs else "free"


def key_of(state: VesselState, set_id: str, horizon: str) -> str:
    """Return what a prediction of a vessel is kept under: other logs, corrections or code have another."""
    rests_on = [*state.inputs, state.ingest_ids, responsible_code()]
    return sha256(canonical_json([state.vessel, set_id, horizon, rests_on]))[:24]


def keep(state: Path, key: str, comparison: Comparison) -> None:
    """Keep a prediction."""
    from kempf.pipeline.compare.run_series import run_series

    folder = state / "predictions"
    where = comparison.where()
    document = json.dumps({**comparison.as_json(), "where": where})
    columns: dict[str, NDArray[Any]] = {
        f"{run.name}/{name}": values for run in comparison.runs for name, values in run_series(run).items()
    }
    for evidence, by_run in comparison.marks(evidence_in(where)).items():
        columns |= {f"{name}/{MARK}{evidence}": inside for name, inside in by_run.items()}
    with whole_file(folder / f"{key}.npz") as passing, passing.open("wb") as file:
        np.savez(file, allow_pickle=False, document=np.frombuffer(document.encode(), dtype=np.uint8), **columns)
    keep_newest(folder, "*.npz", _MOST)


def kept_of(warehouse: Warehouse, state: Path, vessel: str, asked_set: str | None, asked_horizon: str | None) -> Asked:
    """Return which set and horizon of a vessel are asked for, and the prediction with them.

    Without a horizon it is that of `free_horizon`.

    Raises
    ------
    NotFound
        ``no_parameter_set``.
    UsageError
        ``set_of_another_vessel``, ``horizon_unknown``.
    """
    chosen, _ = chosen_set(warehouse, vessel, asked_set or None)
    horizon = horizon_of(asked_horizon or free_horizon(chosen)).name
    if horizon == "legs":
        horizon = free_horizon(chosen, "legs")
    rests_on = fleet_state(warehouse, [vessel])[vessel]
    name = chosen.parameter_set_id
    by_legs = free_horizon(chosen, "legs") == "legs"
    return Asked(name, horizon, kept(state, key_of(rests_on, name, horizon)), by_legs)


def kept(state: Path, key: str) -> KeptPrediction | None:
    """Return a prediction that is kept; None where it is not, or cannot be read any more."""
    path = state / "predictions" / f"{key}.npz"
    try:
        with np.load(path, allow_pickle=False) as file:
            document = json.loads(file["document"].tobytes())
            columns: dict[str, dict[str, Float]] = {}
            for name in file.files:
                segment, slash, column = name.partition("/")
                if slash:
                    columns.setdefault(segment, {})[column] = file[name]
    except (OSError, ValueError, KeyError):
        return None
    return KeptPrediction(document, columns)
