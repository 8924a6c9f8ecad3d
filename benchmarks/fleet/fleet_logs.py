"""A fleet of simulated vessels in a warehouse: short logs of one zigzag each, for `fleet`.

A handful of trials is simulated; every vessel gets some of them, packed anew so that her bytes are her own. What is
computed from a log does not depend on how it is packed, so nothing is saved by that but the time to simulate.
"""

from __future__ import annotations

import gzip
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

from kempf.flows.jobs.ingest.ingest_logs import ingest_log
from kempf.flows.process.cores import usable
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels

DAY_NS = 86_400_000_000_000
HULLS = ("mariner", "ferry")
DURATION_S = 300.0


@dataclass(frozen=True)
class Voyages:
    """Logs as text by hull and day, and the profile of each hull."""

    rows: dict[str, list[bytes]]
    profiles: dict[str, VesselProfile]


def simulate(n_logs: int) -> Voyages:
    """Sail every hull on ``n_logs`` days and one more, which `one_more` brings later."""
    rows: dict[str, list[bytes]] = {hull: [] for hull in HULLS}
    profiles = {}
    for k, hull in enumerate(HULLS):
        for day in range(n_logs + 1):
            settings = zigzag_settings(hull, duration_s=DURATION_S, steady_s=40.0, seed=100 * k + day)
            settings = replace(settings, start_utc_ns=settings.start_utc_ns + day * DAY_NS)
            rows[hull].append(gzip.decompress(to_csv(simulate_trial(settings), rate_hz=2.0)))
            profiles[hull] = logger_profile(settings)
    return Voyages(rows, profiles)


def name_of(number: int) -> str:
    return f"vessel{number:05d}"


def take_in(warehouse: Warehouse, voyages: Voyages, numbers: range) -> None:
    """Bring the logs of some vessels in, a vessel a thread."""
    with ThreadPoolExecutor(usable()) as pool:
        list(pool.map(lambda number: _take_in(warehouse, voyages, number), numbers))


def _take_in(warehouse: Warehouse, voyages: Voyages, number: int) -> None:
    hull = HULLS[number % len(HULLS)]
    for day in range(len(voyages.rows[hull]) - 1):
        _one(warehouse, voyages, number, day)


def one_more(warehouse: Warehouse, voyages: Voyages, number: int) -> None:
    """Bring one vessel a day that she had not had."""
    _one(warehouse, voyages, number, len(voyages.rows[HULLS[number % len(HULLS)]]) - 1)


def _one(warehouse: Warehouse, voyages: Voyages, number: int, day: int) -> None:
    hull, name = HULLS[number % len(HULLS)], name_of(number)
    data = gzip.compress(voyages.rows[hull][day], mtime=number + 1)
    profile = voyages.profiles[hull].model_copy(update={"vessel": name})
    outcome = ingest_log(warehouse, name, f"day{day}.csv.gz", LogFile(data), profile, name)
    assert outcome.outcome == "new" and len(outcome.segments) == 1, outcome


def touch(warehouse: Warehouse, names: list[str]) -> None:
    """Change the profiles of some vessels a little: all of their logs are to be read and identified anew."""
    changed = []
    for name in names:
        profile = vessels.current(warehouse, name)
        changed.append((name, profile.model_copy(update={"wind_arm_per_m": (profile.wind_arm_per_m or 0.0) + 1e-5})))
    vessels.register_all(warehouse, changed)
