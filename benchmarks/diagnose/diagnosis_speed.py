"""Speed of a diagnosis: screening 30 candidates over 8 zigzags, and a whole diagnosis of one vessel, on two cores."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from benchmarks import result_page
from benchmarks.diagnose.hidden_effects.cases import Case
from benchmarks.diagnose.hidden_effects.write import logs_of
from kempf.flows.jobs.chosen_manoeuvres import choose
from kempf.flows.jobs.diagnose_vessel import diagnose_vessel
from kempf.flows.jobs.files import read_profiles
from kempf.flows.jobs.ingest_logs import ingest
from kempf.flows.jobs.standing_model import PLAIN
from kempf.flows.jobs.vessel_runs import assembled
from kempf.pipeline.diagnose.screen import screen
from kempf.pipeline.estimate.plain_fit import fit_plain
from kempf.schemas.effects import catalogue
from kempf.warehouse.store import Warehouse

_CANDIDATES, _REPEATS, _CORES = 30, 5, 2


def _case(effect: str, kind: str) -> Case:
    return Case("speed", kind, effect, "mariner", 1.0, "moderate", 1, ("csv", "mcap"), 1)  # type: ignore[arg-type]


def main() -> None:
    lines, wall = [], []
    for effect, kind in (("rudder_lag", "catalogue"), ("none", "none")):
        with TemporaryDirectory() as place:
            folder = Path(place) / "speed"
            folder.mkdir()
            files, _ = logs_of(_case(effect, kind))
            for name, data in files.items():
                (folder / name).write_bytes(data)
            warehouse = Warehouse(str(Path(place) / "warehouse"))
            logs = sorted(p for p in folder.iterdir() if p.name != "profile.yaml")
            ingest(warehouse, logs, None, read_profiles([folder / "profile.yaml"]))
            runs = assembled(warehouse, choose(warehouse, "speed"), PLAIN)
            with ThreadPoolExecutor(max_workers=_CORES) as workers:
                fit = fit_plain(runs.runs, runs.spec, workers).fit
                chosen = dict(list(catalogue().items())[:_CANDIDATES])
                screen(fit, chosen, workers)
                taken = []
                for _ in range(_REPEATS):
                    begun = time.perf_counter()
                    screen(fit, chosen, workers)
                    taken.append(time.perf_counter() - begun)
            begun = time.perf_counter()
            found, _ = diagnose_vessel(warehouse, "speed", PLAIN)
            wall.append(
                [
                    effect,
                    str(len(runs.runs)),
                    str(sum(run.measured.shape[0] for run in runs.runs)),
                    f"{median(taken):.2f}",
                    f"{time.perf_counter() - begun:.1f}",
                    found.verdict,
                ]
            )
    lines += result_page.table(
        ["hidden effect", "zigzags", "instants", f"screen of {_CANDIDATES}, s", "diagnosis, s", "verdict"], wall
    )
    lines += [
        "",
        "Wanted: the screen under 2 s, the diagnosis with its refits under 60 s, both on two cores, the filter warm. "
        "Logs are read and the zigzags found before; seconds are those of the machine as it was.",
    ]
    result_page.write("diagnose.diagnosis_speed", "Speed of a diagnosis", lines)


if __name__ == "__main__":
    main()
