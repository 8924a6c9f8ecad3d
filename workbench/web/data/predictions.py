"""Predictions that were made for the pages, kept beside the warehouse; deleting them costs time only."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kempf.flows.fleet.state import VesselState, responsible_code
from kempf.pipeline.channels.series import Float, Nanoseconds
from kempf.warehouse.canonical import canonical_json, sha256

if TYPE_CHECKING:
    from kempf.flows.jobs.compare_vessel import Comparison

#: Horizons that the pages offer: as asked for, and in words.
HORIZONS = (("1", "one step"), ("10s", "10 s ahead"), ("60s", "60 s ahead"), ("free", "free run"))
#: predictions kept: the ones made longest ago go first
_MOST = 200
_CHANNELS = {"yaw_rate": "rad_s", "heading": "rad", "lateral_speed": "m_s"}


@dataclass(frozen=True, eq=False)
class KeptPrediction:
    """A vessel's manoeuvres beside what a parameter set predicts of them."""

    #: What `kempf compare --where --json` prints.
    document: dict[str, Any]
    #: By segment and column, shape (n,) each; see `kempf.pipeline.compare.run_series`.
    columns: dict[str, dict[str, Float]]

    def time_utc_ns(self, segment_id: str) -> Nanoseconds:
        """Return the instants of a manoeuvre, shape (n,)."""
        return self.columns[segment_id]["time_utc_ns"].astype(np.int64)


def key_of(state: VesselState, set_id: str, horizon: str) -> str:
    """Return what a prediction of a vessel is kept under: other logs, corrections or code have another."""
    rests_on = [*state.inputs, state.ingest_ids, responsible_code()]
    return sha256(canonical_json([state.vessel, set_id, horizon, rests_on]))[:24]


def keep(state: Path, key: str, found: Comparison) -> None:
    """Keep a prediction."""
    from kempf.pipeline.compare.run_series import run_series

    folder = state / "predictions"
    folder.mkdir(parents=True, exist_ok=True)
    document = json.dumps({**found.show(), "where": found.where()})
    columns = {f"{run.name}/{name}": values for run in found.runs for name, values in run_series(run).items()}
    part = folder / f"{key}.{os.getpid()}.part"
    with part.open("wb") as file:
        np.savez(file, allow_pickle=False, document=np.frombuffer(document.encode(), dtype=np.uint8), **columns)
    part.replace(folder / f"{key}.npz")
    held = sorted(folder.glob("*.npz"), key=lambda one: (one.stat().st_mtime_ns, one.name))
    for one in held[:-_MOST]:
        one.unlink()


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
