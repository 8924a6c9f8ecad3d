"""The wheel: one top-level package, nothing missing, nothing besides; and it works where no checkout is."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

from tests.conftest import Ship

ROOT = Path(__file__).parents[2]
LAYERS = ("flows", "pipeline", "schemas", "warehouse", "workbench")
NOT_SOURCE = (".*", "__pycache__", "*.egg-info", "build", "results", "docs")

SESSION = """
import sys
import kempf

data = kempf.open("data")
data.ingest("mariner.csv.gz", "mariner", "profile.yaml")
ship = data.vessel("mariner")
found = ship.identify(estimator="least-squares")
assert found["parameter"].to_list() == ["a11", "a12", "a21", "a22", "b1", "b2"], found
assert ship.history("b2")["value"].to_list() == found.filter(parameter="b2")["value"].to_list()
loaded = [m for name, m in sys.modules.items() if name.partition(".")[0] == "kempf"]
print(len(loaded), *{str(m.__file__).partition("site-packages")[0] for m in loaded})
"""


def run(*command: str | Path, cwd: Path) -> str:
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "KEMPF_", "VIRTUAL_ENV"))}
    done = subprocess.run(list(map(str, command)), cwd=cwd, env=kept, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from a copy, without network: a build leaves its own files beside the source."""
    place = tmp_path_factory.mktemp("wheel")
    shutil.copytree(ROOT, place / "source", symlinks=True, ignore=shutil.ignore_patterns(*NOT_SOURCE))
    options = ("--quiet", "--no-deps", "--no-index", "--no-build-isolation", "--wheel-dir", place)
    run(sys.executable, "-m", "pip", "wheel", *options, place / "source", cwd=place)
    (made,) = place.glob("*.whl")
    return made


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Python of an environment that holds the wheel, and sees what it depends on in the environment of the tests.

    A folder that a ``.pth`` file names is searched, but the ``.pth`` files in it are not read: the editable install of
    the checkout does not come along.
    """
    place = tmp_path_factory.mktemp("environment")
    run(sys.executable, "-m", "venv", "--without-pip", place, cwd=place)
    python = place / "bin" / "python"
    site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=place).strip())
    here = dict.fromkeys((sysconfig.get_path("purelib"), sysconfig.get_path("platlib")))
    (site / "dependencies.pth").write_text("\n".join(here) + "\n", encoding="utf-8")
    options = ("--quiet", "--disable-pip-version-check", "--no-deps", "--no-index")
    run(sys.executable, "-m", "pip", "--python", python, "install", *options, wheel, cwd=place)
    return python


def test_the_wheel_holds_kempf_and_nothing_else(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    about = {name for name in names if name.partition("/")[0].endswith(".dist-info")}
    inside = {name for name in names if name not in about}
    assert {name.partition("/")[0] for name in inside} == {"kempf"}
    assert any(name.endswith("/licenses/LICENSE") for name in about)
    source = {
        f"kempf/{path.relative_to(ROOT).as_posix()}"
        for layer in LAYERS
        for path in (ROOT / layer).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert inside == {"kempf/__init__.py", "kempf/__main__.py", "kempf/py.typed", *source}


def test_the_wheel_works_where_no_checkout_is(python: Path, mariner: Ship, tmp_path: Path) -> None:
    mariner.write(tmp_path)
    assert run(python.parent / "kempf", "--version", cwd=tmp_path).startswith("kempf, version ")
    count, *homes = run(python, "-c", SESSION, cwd=tmp_path).split()
    assert int(count) > 50
    assert len(homes) == 1
    assert Path(homes[0]).is_relative_to(python.parents[1])
