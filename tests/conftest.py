"""Simulated logs and what comes of them, for the tests of flows and command line: made once, read by all."""

from __future__ import annotations

import os

# before numpy is imported, as `kempf.flows` does: threads that wait for their share of small matrices take a quarter
# of the processors from the tests beside them
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import gzip
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
import yaml

from tests.made_once import made_once

# the tests and all processes that they start read nobody's own settings
_NO_SETTINGS = TemporaryDirectory(prefix="kempf-tests-")
os.environ["XDG_CONFIG_HOME"] = _NO_SETTINGS.name
# what one of hundreds of processes has compiled of its imports the next reads, also where none of it would be kept
os.environ["PYTHONDONTWRITEBYTECODE"] = ""


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


@pytest.fixture(scope="session")
def late_ingested(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with log, profile and warehouse ``w`` of a ship whose rudder answers late, to be copied."""
    from tests import late

    return made_once(tmp_path_factory, "late_ingested", late.take_in)


@pytest.fixture(scope="session")
def late_diagnosed(late_ingested: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same, diagnosed, with the answer in ``diagnosed.json``."""
    from tests import late

    return made_once(tmp_path_factory, "late_diagnosed", partial(late.diagnose, late_ingested))


@pytest.fixture(scope="session")
def late_added(late_diagnosed: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same, with the lag in her model."""
    from tests import late

    return made_once(tmp_path_factory, "late_added", partial(late.add_the_lag, late_diagnosed))
