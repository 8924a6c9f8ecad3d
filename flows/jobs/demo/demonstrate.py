"""The demonstration: a simulated ship's raw logs through the whole main job, and the truth beside what was found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple, dataclass
from pathlib import Path

import yaml

from kempf.flows.jobs.identify.identify_vessel import IdentifyOutcome, identify_vessel
from kempf.flows.jobs.ingest.ingest_logs import IngestOutcome, ingest
from kempf.flows.jobs.reprocess.rerun_set import Rerun, rerun
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.manoeuvre import HandSteering, SteadyCourse, TurningCircle, ZigzagTest
from kempf.pipeline.simulate.mcap_log import to_mcap
from kempf.pipeline.simulate.nmea_log import to_nmea
from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT, Trial, TrialSettings, simulate_trial
from kempf.schemas.errors import UsageError
from kempf.schemas.model_spec import HULL_PARAMETERS
from kempf.schemas.profile import VesselProfile
from kempf.schemas.units import DAY_NS
from kempf.warehouse.storage.store import Warehouse

#: Seed, first day, days between and headings of the three trial days: nothing hangs on them.
_SEED, _FIRST_NS, _APART = 7, 1_746_252_000_000_000_000, 90
_DAYS: tuple[tuple[str, Callable[[Trial], bytes], float], ...] = (
    ("20250503.nmea.gz", to_nmea, 20.0),
    ("20250801.csv.gz", to_csv, 140.0),
    ("20251030.mcap", to_mcap, 265.0),
)
_PROGRAMME = (
    SteadyCourse(90.0),
    ZigzagTest(20.0, 20.0, "starboard", duration_s=900.0),
    SteadyCourse(240.0, heading_deg=60.0),
    ZigzagTest(10.0, 10.0, "port", duration_s=600.0),
    SteadyCourse(200.0, heading_deg=100.0),
    TurningCircle(25.0, 360.0),
    SteadyCourse(200.0, heading_deg=30.0),
    HandSteering(300.0),
)


@dataclass(frozen=True)
class Demonstration:
    """What the demonstration did."""

    #: Where the raw logs, the profile and the warehouse go.
    folder: Path
    vessel: str
    #: The six parameters that the simulator used.
    truth: dict[str, float]
    ingested: list[IngestOutcome]
    identified: list[IdentifyOutcome]
    reruns: list[Rerun]


def demonstrate(folder: Path, progress: Progress = silent) -> Demonstration:
    """Simulate three trial days of one ship as raw logs and run the main job on them.

    Parameters
    ----------
    folder : Path
        Made where it is not; a second demonstration in the same folder changes nothing.

    Raises
    ------
    UsageError
        ``cannot_write``: the folder cannot be written to.
    """
    logs, warehouse = folder / "logs", Warehouse(str(folder / "warehouse"))
    hull = HULLS["mariner"]
    trials: dict[str, bytes] = {}
    profile = VesselProfile()
    for day, (name, write, heading) in enumerate(_DAYS):
        progress(day, len(_DAYS), f"simulating {name}")
        settings = TrialSettings(
            hull,
            _PROGRAMME,
            PAPER_ENVIRONMENT,
            seed=_SEED + day,
            start_utc_ns=_FIRST_NS + day * _APART * DAY_NS,
            heading_deg=heading,
        )
        trials[name] = write(simulate_trial(settings))
        profile = logger_profile(settings)
    text = yaml.safe_dump(profile.model_dump(mode="json", exclude_defaults=True), sort_keys=False)
    try:
        logs.mkdir(parents=True, exist_ok=True)
        for name, data in trials.items():
            (logs / name).write_bytes(data)
        (folder / "profile.yaml").write_text(text, encoding="utf-8")
    except OSError as error:
        raise UsageError(
            "cannot_write", f"Writing to {folder} failed: {error.strerror or error}.", "Give another folder."
        ) from error
    ingested = ingest(warehouse, [logs / name for name in trials], hull.name, profile, progress)
    identified = identify_vessel(warehouse, hull.name, progress=progress)
    set_ids = [o.parameter_set.parameter_set_id for o in identified if o.parameter_set is not None]
    reruns = []
    for done, name in enumerate(set_ids):
        progress(done, len(set_ids), f"rerunning {name}")
        reruns.append(rerun(warehouse, name))
    truth = dict(zip(HULL_PARAMETERS, astuple(hull.parameters), strict=True))
    return Demonstration(folder, hull.name, truth, ingested, identified, reruns)
