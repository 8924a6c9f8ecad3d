"""Speed of a diagnosis on two cores: simulated ships of four and eight zigzags, and the tank's 13 runs of 20 Hz."""

from __future__ import annotations

import argparse
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from benchmarks import measured_ships, result_page
from benchmarks.diagnose.hidden_effects.cases import Case
from benchmarks.diagnose.hidden_effects.effects import Kind
from benchmarks.diagnose.hidden_effects.write import logs_of
from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_vessel
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.vessel_runs import assembled
from kempf.flows.jobs.ingest.files import read_model, read_profiles
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.pipeline.diagnose.screening.screen import screen
from kempf.pipeline.estimate.plain_fit import fit_plain
from kempf.schemas.effects import catalogue
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse

_REPEATS, _CORES = 5, 2
_MODEL = Path(__file__).parents[2] / "docs" / "models" / "tank.yaml"
#: hidden effect, its kind, days: four zigzags each
_SIMULATED: tuple[tuple[str, Kind, int], ...] = (
    ("rudder_lag", "catalogue", 1),
    ("none", "none", 1),
    ("bank_shear", "outsider", 1),
    ("rudder_lag", "catalogue", 2),
)


def simulated(place: Path, effect: str, kind: Kind, days: int) -> Warehouse:
    """Sail a ship with a hidden effect and take her logs in."""
    files, _ = logs_of(Case("speed", kind, effect, "mariner", 1.0, "moderate", 1, False, ("csv", "mcap"), 1))  # noqa: FBT003
    for name, data in files.items():
        (place / name).write_bytes(data)
    warehouse = Warehouse(str(place / "warehouse"))
    logs = sorted(place / name for name in files if name != "profile.yaml")[:days]
    ingest(warehouse, logs, None, read_profiles([place / "profile.yaml"]))
    return warehouse


def timed(warehouse: Warehouse, vessel: str, spec: ModelSpec) -> list[str]:
    """Return zigzags, instants, seconds of a screen and of a diagnosis, and the verdict, the filters being compiled."""
    runs = assembled(warehouse, choose(warehouse, vessel), spec)
    with ThreadPoolExecutor(max_workers=_CORES) as workers:
        fit = fit_plain(runs.runs, runs.spec, workers).fit
        screen(fit, catalogue(), workers)
        taken = []
        for _ in range(_REPEATS):
            begun = time.perf_counter()
            screen(fit, catalogue(), workers)
            taken.append(time.perf_counter() - begun)
    begun = time.perf_counter()
    found, _ = diagnose_vessel(warehouse, vessel, spec)
    seconds = time.perf_counter() - begun
    instants = sum(run.measured.shape[0] for run in runs.runs)
    return [str(len(runs.runs)), str(instants), f"{median(taken):.2f}", f"{seconds:.1f}", found.verdict]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    given = parser.parse_args()
    rows = []
    for effect, kind, days in _SIMULATED:
        with TemporaryDirectory() as place:
            row = timed(simulated(Path(place), effect, kind, days), "speed", ModelSpec())
        rows.append([f"simulated, {effect}", *row])
    with TemporaryDirectory() as place:
        warehouse, ship = Warehouse(place), measured_ships.tank(given.data)
        measured_ships.take_in(warehouse, ship)
        rows.append(["towing tank, 20 Hz", *timed(warehouse, ship.name, read_model(_MODEL))])
    head = ["ship", "zigzags", "instants", f"screen of {len(catalogue())}, s", "diagnosis, s", "verdict"]
    lines = [
        *result_page.table(head, rows),
        "",
        "Wanted: 4 zigzags within 30 s, the tank's 13 runs within 90 s, both on two cores; what cannot be decided "
        "ends no later. Logs are read and the zigzags found before, the filters compiled; seconds are those of the "
        "machine as it was.",
    ]
    result_page.write("diagnose.diagnosis_speed", "Speed of a diagnosis", lines)


if __name__ == "__main__":
    main()
