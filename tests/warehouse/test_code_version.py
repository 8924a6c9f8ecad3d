from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from kempf.warehouse import code_version

ROOT = Path(__file__).parents[2]


def test_the_fingerprint_is_the_source() -> None:
    assert re.fullmatch(r"[0-9a-f]{16}", code_version.fingerprint())
    every = {p.relative_to(ROOT).as_posix(): p for top in ("pipeline", "schemas") for p in (ROOT / top).rglob("*.py")}
    files = {name: path for name, path in every.items() if not name.startswith("pipeline/simulate/")}
    assert 0 < len(files) < len(every)
    assert code_version.fingerprint_of({n: p.read_bytes() for n, p in files.items()}) == code_version.fingerprint()


def test_every_change_of_name_or_byte_changes_it() -> None:
    base = {"pipeline/a.py": b"x = 1\n", "pipeline/b.py": b""}
    others = [
        {"pipeline/a.py": b"x = 2\n", "pipeline/b.py": b""},
        {"pipeline/a.py": b"x = 1\n", "pipeline/c.py": b""},
        {"pipeline/a.py": b"x = 1\n"},
        {"pipeline/a.py": b"", "pipeline/b.py": b"x = 1\n"},
        {},
    ]
    found = {code_version.fingerprint_of(sources) for sources in (base, *others)}
    assert len(found) == len(others) + 1
    assert code_version.fingerprint_of(dict(reversed(base.items()))) == code_version.fingerprint_of(base)


def test_packages_are_named_with_their_versions() -> None:
    import numpy as np

    found = code_version.packages()
    assert found["numpy"] == np.__version__
    assert found["python"].startswith("3.")


def test_the_commit_is_that_of_the_source_and_of_no_other_checkout(tmp_path: Path) -> None:
    git = shutil.which("git")
    if git is None:
        pytest.skip("git is not installed")
    package = tmp_path / "pipeline"
    package.mkdir()
    (package / "__init__.py").write_text("")
    assert code_version.commit_of(package) is None  # no checkout

    names = {f"GIT_{who}_{what}": "x" for who in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}
    environment = {**os.environ, **names}

    def run(*arguments: str) -> str:
        done = subprocess.run(
            [git, *arguments], cwd=tmp_path, env=environment, check=True, capture_output=True, text=True
        )
        return done.stdout.strip()

    run("init", "-q")
    run("commit", "-q", "--allow-empty", "-m", "empty")
    assert code_version.commit_of(package) is None  # in a checkout, but not its file
    run("add", ".")
    run("commit", "-q", "-m", "package")
    commit = run("rev-parse", "HEAD")
    assert code_version.commit_of(package) == commit
    (package / "__init__.py").write_text("x = 1\n")
    assert code_version.commit_of(package) == f"{commit}-dirty"


def test_without_git_there_is_no_commit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert code_version.commit_of(ROOT / "pipeline") is None


def test_importing_the_store_loads_no_heavy_library() -> None:
    code = (
        "import sys, kempf.warehouse.store, kempf.warehouse.raw;"
        "import kempf.warehouse.delta, kempf.warehouse.code_version, kempf.warehouse.history;"
        "print(sorted({'deltalake', 'pyarrow', 'polars', 'numpy'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
