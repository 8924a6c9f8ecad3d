"""Which code made a result: a fingerprint of its source, the packages it rests on, the commit where there is one."""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import ModuleType

from kempf import pipeline, schemas

#: Packages whose version may change a result or how it is stored.
PACKAGES = ("deltalake", "numba", "numpy", "polars", "pyarrow", "scipy")


def fingerprint_of(sources: Mapping[str, bytes]) -> str:
    """Return the fingerprint of source files, 16 hex digits of a SHA-256.

    Parameters
    ----------
    sources : mapping of str to bytes
        Content by relative name with forward slashes; the order does not matter.
    """
    digest = hashlib.sha256()
    for name in sorted(sources):
        # lengths first, so that no two sets of files give the same stream
        digest.update(f"{len(name.encode())} {len(sources[name])} {name}\n".encode())
        digest.update(sources[name])
    return digest.hexdigest()[:16]


@cache
def fingerprint() -> str:
    """Return the fingerprint of the installed `pipeline` and `schemas`: every result is a function of these.

    The simulator is left out: it makes logs, and a log counts by its own bytes.
    """
    return fingerprint_of_packages(pipeline, schemas)


def fingerprint_of_packages(*packages: ModuleType) -> str:
    """Return the fingerprint of some installed packages, the simulator left out.

    Parameters
    ----------
    packages : module
    """
    roots = [_folder(package.__file__) for package in packages]
    return fingerprint_of(
        {
            f"{root.name}/{path.relative_to(root).as_posix()}": path.read_bytes()
            for root in roots
            for path in root.rglob("*.py")
            if path.relative_to(root).parts[0] != "simulate"
        }
    )


@cache
def packages() -> dict[str, str]:
    """Return the versions of Python and of `PACKAGES`; ``absent`` for one that is not installed."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "absent"
    return found


@cache
def git_commit() -> str | None:
    """Return the commit of the source, ``-dirty`` behind it where files differ from it; None outside a checkout."""
    return commit_of(_folder(pipeline.__file__))


def commit_of(package: Path) -> str | None:
    """Return the commit that a package's folder is tracked by, None where it is not (or git is not there)."""
    git = shutil.which("git")
    if git is None:
        return None
    # a package installed into an environment inside some other checkout is not tracked by it
    tracked = ["ls-files", "--error-unmatch", "__init__.py"]
    described = ["describe", "--always", "--dirty", "--abbrev=40", "--exclude", "*"]
    answer = ""
    for arguments in (tracked, described):
        try:
            done = subprocess.run(  # noqa: S603 - fixed arguments, no shell
                [git, "--no-optional-locks", "-C", str(package), *arguments],
                capture_output=True,
                text=True,
                timeout=20,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired):
            return None
        if done.returncode != 0:
            return None
        answer = done.stdout.strip()
    return answer or None


def _folder(init: str | None) -> Path:
    assert init is not None  # a package with an __init__.py has a file
    return Path(init).resolve().parent
