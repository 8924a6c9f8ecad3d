"""The real traps: measured logs read by a profile without the line that mends them, and what the doctor says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from benchmarks import measured_ships
from kempf.flows.jobs.ingest.examine_log import ExaminedLog, examine_instruments
from kempf.pipeline.channels.doctor.refused import count
from kempf.pipeline.channels.instruments import from_readings
from kempf.schemas.profile import VesselProfile, parse
from tests.reading import read_log


@dataclass(frozen=True)
class Trap:
    """A fault of the real world: the logs, how their profile is spoilt, what must be named."""

    name: str
    kind: str
    channels: tuple[str, ...]
    logs: tuple[Path, ...]
    #: Without the line that mends it.
    profile: VesselProfile


def traps(data: Path) -> list[Trap]:
    """Every trap of the measured logs."""
    tank, boat = measured_ships.tank(data), measured_ships.boat(data)
    rtk = data / "data" / "nmea" / "rtk_usv_202412051751.txt"
    body = ("velocity_forward", "velocity_starboard")
    zigzag = tuple(path for path in boat.logs if path.name.startswith("zigzag"))
    return [
        Trap(
            "earth-fixed velocities read as body-fixed", "frame", body, tank.logs, _spoilt(tank.profiles[0], _as_body)
        ),
        Trap("rudder positive to port", "sign", ("rudder_angle",), tank.logs, _spoilt(tank.profiles[0], _unturned)),
        Trap("knots unlabelled", "unit", ("speed_over_ground",), boat.logs, _spoilt(boat.profiles[0], _metres)),
        Trap("rudder order with midships at 40", "offset", ("rudder_order",), zigzag, _spoilt(boat.profiles[0], _bare)),
        Trap("antenna baseline off the bow", "offset", ("heading",), (rtk,), VesselProfile(vessel="rtk")),
    ]


def examined(path: Path, profile: VesselProfile) -> ExaminedLog:
    """One log as it is read with a profile."""
    read = read_log(path.name, path.read_bytes(), profile)
    refused = count(read.rejections())
    return examine_instruments(from_readings(read.frame), profile, path.name, read.format, refused)


def _spoilt(path: Path, spoil: Callable[[dict[str, Any]], None]) -> VesselProfile:
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    for source in content["sources"]:
        for entry in source["channels"].values():
            spoil(entry)
    return parse(content, path.name)


def _as_body(entry: dict[str, Any]) -> None:
    other = {"velocity_north": "velocity_forward", "velocity_east": "velocity_starboard"}
    entry["channel"] = other.get(entry["channel"], entry["channel"])


def _unturned(entry: dict[str, Any]) -> None:
    entry.pop("positive", None)


def _metres(entry: dict[str, Any]) -> None:
    if entry["unit"] == "kn":
        entry["unit"] = "m/s"


def _bare(entry: dict[str, Any]) -> None:
    entry.pop("offset", None)
