"""The speed without a log on eight ships of another simulator, whose physics eq. (16) does not hold: for `no_log`.

The ships have a log. It is kept from the estimator and compared with what it says.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks import measured_ships, result_page
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.pipeline.channels.instruments import from_readings
from kempf.pipeline.estimate.maximum_likelihood import MaximumLikelihoodSettings, identify
from kempf.pipeline.estimate.no_log.companions import Passage, companions_of, shaft_speed
from kempf.pipeline.estimate.no_log.identify import NoLogSettings, identify_without_log
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.record import Record
from kempf.pipeline.segment.zigzags.find_zigzags import find_zigzags
from kempf.schemas.model_spec import ModelSpec
from tests.reading import read_log

WAYS = {
    "sure": "no log, the hull taken at its word (`hull_misfit` 0)",
    "none": "no log",
    "trial": "no log, trial speed of the particulars",
    "others": "as `kempf identify` does it: trial speed and companions",
}


@dataclass(frozen=True)
class Zigzag:
    """One zigzag with its log and without, and the trial speed of the ship."""

    ship: str
    day: str
    arm_per_m: float
    trial_speed_m_s: float | None
    passage: Passage
    logged: Record
    blind: Record


@dataclass(frozen=True)
class Found:
    """Mean speed by the log and without it, its standard error, and b2 without the log over b2 with it."""

    ship: str
    way: str
    log_m_s: float
    speed_m_s: float
    std_m_s: float
    b2_ratio: float
    b2_std: float


def zigzags(data: Path, days: int = 2) -> list[Zigzag]:
    """Read every log of every ship, or those of her first days."""
    found = []
    for ship in measured_ships.fleet(data):
        profile = read_profiles(ship.profiles)
        for path in ship.logs[:days]:
            instruments = from_readings(read_log(path.name, path.read_bytes(), profile).frame)
            series = instruments.series
            blind = replace(instruments, series={n: s for n, s in series.items() if n != "speed_through_water"})
            for z in find_zigzags(series["heading"], series["rudder_angle"], series["speed_through_water"]):
                records = (make_record(i, z.start_utc_ns, z.end_utc_ns) for i in (instruments, blind))
                arm, speed = profile.wind_arm_per_m or 0.0, profile.trial_speed_m_s
                bounds = z.start_utc_ns, z.end_utc_ns
                engine = shaft_speed(instruments, *bounds)
                passage = Passage(*bounds, z.base_heading_deg, engine)
                found.append(Zigzag(ship.name, path.name, arm, speed, passage, *records))
    return found


def companions(zigzag: Zigzag, every: list[Zigzag]) -> tuple[Record, ...]:
    """Return the runs that `kempf identify` would take beside one."""
    of_ship = [z for z in every if z.ship == zigzag.ship]
    return tuple(of_ship[i].blind for i in companions_of(zigzag.passage, [z.passage for z in of_ship]))


def compare(zigzag: Zigzag, others: tuple[Record, ...]) -> list[Found]:
    """Identify one zigzag in every way."""
    spec, settings = ModelSpec(), MaximumLikelihoodSettings()
    with_log = identify(zigzag.logged, spec, zigzag.arm_per_m, settings).hull.b2
    known = NoLogSettings(trial_speed_m_s=zigzag.trial_speed_m_s)
    chosen: dict[str, tuple[NoLogSettings, tuple[Record, ...]]] = {
        "sure": (NoLogSettings(hull_misfit=0.0), ()),
        "none": (NoLogSettings(), ()),
        "trial": (known, ()),
        "others": (known, others),
    }
    found = []
    for way, (no_log, companions) in chosen.items():
        if way == "others" and not companions:
            continue
        e = identify_without_log(zigzag.blind, spec, zigzag.arm_per_m, settings, no_log, companions)
        stated, b2 = e.report["speed"], e.parameters[5]
        ratio, std = b2.value / with_log, b2.std / abs(with_log)
        log = zigzag.logged.mean_speed_m_s
        found.append(Found(zigzag.ship, way, log, stated["mean_m_s"], stated["std_m_s"], ratio, std))
    return found


def lines(found: list[Found]) -> list[str]:
    """Lines of the results page."""
    rows = []
    for ship in dict.fromkeys(f.ship for f in found):
        rows += [[ship, WAYS[way], *_summary([f for f in found if (f.ship, f.way) == (ship, way)])] for way in WAYS]
    total = [["all", WAYS[way], *_summary([f for f in found if f.way == way])] for way in WAYS]
    head = [
        "ship",
        "way",
        "zigzags",
        "V less the log's: rms, %",
        "rms std, %",
        "rms z",
        "inside 1.96 std",
        "b2: rms, %",
    ]
    return result_page.table(head, [row for row in [*total, *rows] if row[2] != "0"])


def _summary(group: list[Found]) -> list[str]:
    if not group:
        return ["0", "", "", "", "", ""]
    error = np.array([f.speed_m_s / f.log_m_s - 1.0 for f in group])
    std = np.array([f.std_m_s / f.log_m_s for f in group])
    b2 = np.array([f.b2_ratio - 1.0 for f in group])
    z = error / std
    inside = f"{int(np.sum(np.abs(z) < 1.96))} of {z.size}"
    rms = [float(np.sqrt(np.mean(x**2))) for x in (error, std, z, b2)]
    return [str(z.size), f"{100 * rms[0]:.2g}", f"{100 * rms[1]:.2g}", f"{rms[2]:.1f}", inside, f"{100 * rms[3]:.2g}"]
