from __future__ import annotations

from pathlib import Path

import pytest

from tests.conftest import Ship


@pytest.fixture(scope="session")
def harbour(mariner: Ship, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the three logs of the ship and her profile."""
    return mariner.write(tmp_path_factory.mktemp("harbour"))
