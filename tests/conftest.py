"""Simulated logs for the tests of the flows and of the command line: sailed once a session, read by all."""

from __future__ import annotations

import gzip
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """One process more than there are cores: tests with servers, workers and kills wait more than they compute."""
    return (os.cpu_count() or 1) + 1


@dataclass(frozen=True)
class Ship:
    """One simulated ship: the bytes that her three loggers wrote of one zigzag, and her profile as YAML content."""

    name: str
    nmea: bytes
    csv: bytes
    mcap: bytes
    profile: dict[str, Any]

    @property
    def lines(self) -> list[bytes]:
        """The NMEA log, line by line."""
        return gzip.decompress(self.nmea).splitlines(keepends=True)

    def write(self, folder: Path) -> Path:
        """Put the three logs and ``profile.yaml`` into a folder."""
        folder.mkdir(parents=True, exist_ok=True)
        for ending, data in (("nmea.gz", self.nmea), ("csv.gz", self.csv), ("mcap", self.mcap)):
            (folder / f"{self.name}.{ending}").write_bytes(data)
        (folder / "profile.yaml").write_text(yaml.safe_dump(self.profile), encoding="utf-8")
        return folder


def sail(hull: str, duration_s: float, seed: int) -> Ship:
    from kempf.pipeline.simulate.csv_log import to_csv
    from kempf.pipeline.simulate.logger_profile import logger_profile
    from kempf.pipeline.simulate.mcap_log import to_mcap
    from kempf.pipeline.simulate.nmea_log import to_nmea
    from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings

    settings = zigzag_settings(hull, duration_s=duration_s, seed=seed)
    trial = simulate_trial(settings)
    profile = logger_profile(settings).model_dump(mode="json", exclude_defaults=True)
    return Ship(hull, to_nmea(trial), to_csv(trial), to_mcap(trial), profile)


@pytest.fixture(scope="session")
def mariner() -> Ship:
    return sail("mariner", 400.0, 1)


@pytest.fixture(scope="session")
def ferry() -> Ship:
    return sail("ferry", 400.0, 2)
