from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from shutil import copytree

import pytest

from tests.conftest import Ship
from tests.made_once import made_once
from tests.workbench.driving import kempf, tree


@pytest.fixture(scope="session")
def logs(mariner: Ship, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the three logs of the ship and her profile."""
    return mariner.write(tmp_path_factory.mktemp("logs"))


@pytest.fixture(scope="session")
def _filled(logs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    def fill(folder: Path) -> None:
        paths = [logs / "mariner.nmea.gz", logs / "mariner.csv.gz"]
        done = kempf("ingest", *paths, "--profile", logs / "profile.yaml", "--warehouse", folder)
        assert done.code == 0, done
        for estimator in ("least-squares", "ml"):
            done = kempf("identify", "--vessel", "mariner", "--estimator", estimator, "--warehouse", folder)
            assert done.code == 0, done

    # a copy for each process: `filled` looks at every file
    return copytree(made_once(tmp_path_factory, "filled", fill), tmp_path_factory.mktemp("filled") / "warehouse")


@pytest.fixture
def filled(_filled: Path) -> Iterator[Path]:
    """A warehouse with two logs and four parameter sets of one ship, which the test must leave as it is."""
    before = tree(_filled)
    yield _filled
    assert tree(_filled) == before


@pytest.fixture
def own(_filled: Path, tmp_path: Path) -> Path:
    """A copy of it that the test may change."""
    return copytree(_filled, tmp_path / "own")
