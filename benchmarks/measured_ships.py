"""The measured logs as the main job takes them in: which files, which ship, which profile. No figures here."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.vessel_runs import RunLayout, VesselRuns, assembled
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.flows.jobs.ingest.ingest_logs import IngestOutcome, ingest
from kempf.pipeline.channels.instruments import from_readings
from kempf.schemas.errors import KempfError, NotFound
from kempf.schemas.units import SECOND_NS
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import readings, vessels
from kempf.warehouse.tables.parameter_set import Bounds

_PROFILES = Path(__file__).parents[1] / "docs" / "profiles"


@dataclass(frozen=True)
class Ship:
    """The logs of one ship."""

    name: str
    #: Laid over each other.
    profiles: tuple[Path, ...]
    #: In the order of their names.
    logs: tuple[Path, ...]


@dataclass(frozen=True)
class Run:
    """What the name of a towing-tank run says was ordered."""

    name: str
    rudder_deg: float
    heading_deg: float
    side: str


def _ship(name: str, profiles: Sequence[Path], logs: Sequence[Path], where: Path) -> Ship:
    if not logs:
        raise NotFound("no_measured_data", f"There are no logs of {name} in {where}.", "Say where with --data FOLDER.")
    return Ship(name, tuple(profiles), tuple(sorted(logs)))


def tank(data: Path) -> Ship:
    """The KVLCC2 model in the towing tank."""
    folder = data / "data" / "kvlcc2_hsva"
    return _ship("hsva_kvlcc2", [_PROFILES / "hsva_kvlcc2.yaml"], list(folder.glob("*.dat")), folder)


def pond(data: Path) -> Ship:
    """The Esso Osaka model on a pond."""
    folder = data / "data" / "esso_osaka"
    return _ship("esso_osaka", [_PROFILES / "esso_osaka.yaml"], list(folder.glob("*.csv.gz")), folder)


def boat(data: Path) -> Ship:
    """The small unmanned vessel at sea."""
    folder = data / "data" / "usv_open_water"
    return _ship("usv_open_water", [_PROFILES / "usv_open_water.yaml"], list(folder.glob("*_xy.csv")), folder)


def fleet(data: Path, trials: str = "trials") -> list[Ship]:
    """The ships of the trial logs: the eight of ``trials``, or the six of ``trials_as_sold``."""
    where = data / trials
    folders = sorted(p.parent for p in where.glob("*/particulars.json"))
    if not folders:
        raise NotFound("no_measured_data", f"There are no trial logs in {where}.", "Say where with --data FOLDER.")
    return [
        _ship(f.name, [f / "particulars.json", _PROFILES / "trial_logger.yaml"], list(f.glob("2*")), f) for f in folders
    ]


def take_in(warehouse: Warehouse, ship: Ship) -> list[IngestOutcome]:
    """Ingest the logs of a ship, one outcome a log in their order."""
    return ingest(warehouse, ship.logs, ship.name, read_profiles(ship.profiles))


def every(data: Path) -> Iterator[tuple[str, VesselRuns]]:
    """Lay out the runs of all ships, measured ones and trial logs, one after the other.

    Yields
    ------
    (str, VesselRuns)
        Name of a ship; those that are not there are left out.
    """
    for make in (tank, pond, boat):
        try:
            ship = make(data)
        except KempfError:
            continue
        yield ship.name, _laid_out(ship)
    for trials in ("trials", "trials_as_sold"):
        try:
            ships = fleet(data, trials)
        except KempfError:
            continue
        for ship in ships:
            yield f"{trials} {ship.name}", _laid_out(ship)


def _laid_out(ship: Ship) -> VesselRuns:
    with TemporaryDirectory() as folder:
        warehouse = Warehouse(str(Path(folder) / "warehouse"))
        take_in(warehouse, ship)
        return assembled(warehouse, choose(warehouse, ship.name), default_model_of(warehouse, ship.name))


def thinned(ship: Ship, row_s: float) -> RunLayout:
    """Return what the manoeuvres of a ship are laid out from, of a part of the rows of her logs, so far apart."""
    with TemporaryDirectory() as folder:
        warehouse = Warehouse(str(Path(folder) / "warehouse"))
        take_in(warehouse, ship)
        chosen = choose(warehouse, ship.name)
        instruments = {}
        for log_id, ingest_id in chosen.ingests.items():
            with readings.lent(warehouse, ingest_id) as rows:
                whole = rows.collect()
            apart_s = float(np.median(np.diff(whole["time_utc_ns"].to_numpy()))) / SECOND_NS
            instruments[log_id] = from_readings(whole.gather_every(round(row_s / apart_s)))
        bounds = [(s.segment_id, Bounds(s.log_id, s.start_utc_ns, s.end_utc_ns)) for s in chosen.segments]
        profile = vessels.get(warehouse, chosen.profile_sha256)
        return RunLayout(instruments, profile, bounds, default_model_of(warehouse, ship.name), None, chosen.loads, {})


def ordered(file_name: str) -> Run:
    """Read what was ordered off the name of a towing-tank run, rudder first, then heading."""
    found = re.search(r"Z_(\d+)_(\d+)(_[PS])?", file_name)
    if found is None:
        raise ValueError(f"{file_name} does not name a towing-tank run")
    return Run(found[0], float(found[1]), float(found[2]), "port" if found[3] == "_P" else "starboard")
