"""The ship whose rudder answers late, from log to model, for tests that look at some effects of the catalogue."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import copytree

import pytest

from benchmarks.diagnose import late_rudder
from kempf.schemas import effects
from tests.workbench.driving import Ran, kempf

VESSEL = late_rudder.VESSEL
SOME = ("rudder_lag", "gyro_bias", "shallow_water")


@contextmanager
def some_effects() -> Iterator[None]:
    """Look for these alone: the whole catalogue takes too long for a test."""
    few = {name: effect for name, effect in effects.catalogue().items() if name in SOME}
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(effects, "catalogue", lambda: few)
        yield


def take_in(folder: Path) -> None:
    """Write her log and profile, and take the log into the warehouse ``w`` beside them."""
    late_rudder.write(folder)
    done = run(folder, "ingest", folder / "day.mcap", "--profile", folder / "late.yaml", "--json")
    assert [len(one["segments"]) for one in done.json] == [3], done


def diagnose(ingested: Path, folder: Path) -> None:
    """Diagnose her in a copy; the answer is kept in ``diagnosed.json``."""
    copytree(ingested, folder)
    with some_effects():
        done = run(folder, "diagnose", "--vessel", VESSEL, "--json")
    (folder / "diagnosed.json").write_text(done.out, encoding="utf-8")


def add_the_lag(diagnosed: Path, folder: Path) -> None:
    """Add the lag to her model in a copy."""
    copytree(diagnosed, folder)
    with some_effects():
        run(folder, "effects", "add", "rudder_lag", "--vessel", VESSEL)


def run(folder: Path, *arguments: object) -> Ran:
    done = kempf(*arguments, "--warehouse", folder / "w")
    assert done.code == 0, done
    return done
