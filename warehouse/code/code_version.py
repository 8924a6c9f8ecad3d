"""Which code made a result: fingerprints of its source, the packages it rests on, the commit where there is one.

A result goes through stages: readings of a log, what is found in them, parameters, diagnoses. Each stage has a
fingerprint of its own, so that a change of one makes anew only what rests on it, and a comment nothing. A better
sentence about an effect makes diagnoses anew, which hold such sentences, and no parameter set.
"""

from __future__ import annotations

import platform
import shutil
import subprocess
from dataclasses import dataclass
from email import message_from_string
from functools import cache
from hashlib import sha256
from importlib.metadata import Distribution, PackageNotFoundError, distributions, version
from pathlib import Path
from types import ModuleType
from typing import Literal

from kempf import pipeline
from kempf.warehouse.code.source_tree import SourceTree

#: Packages whose version may change a result or how it is stored.
PACKAGES = ("deltalake", "numba", "numpy", "polars", "pyarrow", "scipy")

Stage = Literal["ingest", "segment", "estimate", "diagnose"]


@dataclass(frozen=True)
class Entry:
    """Where the code of a stage begins."""

    #: What its jobs call, in ``kempf.pipeline``; all that these import counts with them.
    modules: tuple[str, ...]
    #: Stages whose results its own are made of, and whose code therefore counts, too. The bounds of a segment are named
    #: among the inputs of a parameter set, so that the code that finds segments does not count in it.
    rests_on: tuple[Stage, ...] = ()
    #: Keys of an effect's file that no result of the stage holds.
    left_out: tuple[str, ...] = ()


#: What an effect's file says beside what it computes: what only `kempf effects` shows, and what a diagnosis says, too.
_SHOWN, _SAID = ("equation", "reference", "meaning", "confounded_with"), ("title", "plain", "separated_by")

STAGES: dict[Stage, Entry] = {
    "ingest": Entry(("ingest.read",)),
    "segment": Entry(
        (
            *("channels.instruments", "channels.doctor.examine", "channels.doctor.corrections"),
            *("channels.doctor.refused", "channels.doctor.verdict"),
            *("segment.zigzags.find_zigzags", "segment.find_circles_and_spirals", "segment.spirals.random_manoeuvre"),
            *(
                "segment.zigzags.by_hand",
                "segment.corrections",
                "segment.zigzags.imo",
                "segment.circles.imo_turning",
                "segment.lateral",
            ),
            "estimate.no_log.companions",
        ),
        ("ingest",),
    ),
    "estimate": Entry(
        (
            *("channels.instruments", "estimate.estimators", "estimate.pooled_uncertainty", "estimate.posterior"),
            *("estimate.updated", "predict.free_run"),
            *("estimate.no_log.companions", "estimate.record.cut", "estimate.record.left_out"),
            "estimate.record.loads",
            *(
                "diagnose.screening.staged",
                "diagnose.steps.ladder_step",
                "diagnose.split",
                "diagnose.screening.unsure_instants",
            ),
        ),
        ("ingest",),
        _SHOWN + _SAID,
    ),
    "diagnose": Entry(
        ("diagnose.verdicts.diagnosis", "diagnose.verdicts.diagnosis_json", "diagnose.evidence.evidence"),
        ("segment", "estimate"),
        _SHOWN,
    ),
}
#: Rooms that a result is a function of.
_ROOMS = ("pipeline", "schemas")


@cache
def fingerprint(stage: Stage) -> str:
    """Return the fingerprint of the installed code of a stage, 16 hex digits.

    Parameters
    ----------
    stage : {"ingest", "segment", "estimate", "diagnose"}
    """
    return fingerprint_in(_folder(pipeline.__file__).parent, stage)


def fingerprint_in(folder: Path, stage: Stage) -> str:
    """Return the fingerprint of a stage's code in some folder of source.

    Parameters
    ----------
    folder : Path
        Holds ``pipeline`` and ``schemas``.
    stage : {"ingest", "segment", "estimate", "diagnose"}

    Raises
    ------
    ModuleNotFoundError
        A module that the stage begins with is not there.
    """
    return _joined(modules_in(folder, stage))


def modules_in(folder: Path, stage: Stage) -> dict[str, str]:
    """Return the digests of all that counts in a stage's code in some folder of source, by name.

    Parameters
    ----------
    stage : {"ingest", "segment", "estimate", "diagnose"}

    Raises
    ------
    ModuleNotFoundError
        A module that the stage begins with is not there.
    """
    return SourceTree(folder, _ROOMS).reached(_entries(stage), STAGES[stage].left_out)


def _entries(stage: Stage) -> list[str]:
    own = [f"kempf.pipeline.{module}" for module in STAGES[stage].modules]
    return own + [module for before in STAGES[stage].rests_on for module in _entries(before)]


def fingerprint_of_packages(*packages: ModuleType) -> str:
    """Return the fingerprint of all modules of some installed packages.

    Parameters
    ----------
    packages : module
        Rooms of kempf, beside each other.
    """
    folders = [_folder(package.__file__) for package in packages]
    tree = SourceTree(folders[0].parent, [folder.name for folder in folders])
    return _joined(tree.reached(tree.modules))


def _joined(digests: dict[str, str]) -> str:
    return sha256("\n".join(f"{name} {digests[name]}" for name in sorted(digests)).encode()).hexdigest()[:16]


@cache
def packages() -> dict[str, str]:
    """Return the versions of Python and of `PACKAGES`; ``absent`` for one that is not installed."""
    versions = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "absent"
    return versions


@cache
def machine() -> dict[str, str]:
    """Return what else than code and `PACKAGES` bits may rest on: system, kind of processor, its name, all packages.

    Returns
    -------
    dict
        ``system``, ``machine``, ``processor``, and ``environment``: SHA-256 of the names and versions of everything
        that is installed, 64 hex digits, which one lock file makes the same everywhere.
    """
    installed = sorted({package for distribution in distributions() if (package := _name_and_version(distribution))})
    return {
        "system": platform.system(),
        "machine": platform.machine(),
        "processor": _processor(),
        "environment": sha256("\n".join(installed).encode()).hexdigest(),
    }


def _name_and_version(distribution: Distribution) -> str:
    """Return ``name==version`` of what is installed, empty where it has no name.

    Its properties parse the whole description of the package, twice: a third of a second for all of them.
    """
    # an empty name: the one file that an old egg-info is
    text = distribution.read_text("METADATA") or distribution.read_text("PKG-INFO") or distribution.read_text("") or ""
    head = message_from_string(text.partition("\n\n")[0])
    return f"{head['Name'].lower()}=={head['Version']}" if head["Name"] else ""


def _processor() -> str:
    """Return the name of the processor, as Linux has it; elsewhere what Python knows of it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor()
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.processor())


@cache
def git_commit() -> str | None:
    """Return the commit of the source, ``-dirty`` behind it where files differ from it; None where it is not known.

    Outside a checkout it is what was written into the package when that was built.
    """
    package = _folder(pipeline.__file__)
    return commit_of(package) or built_from(package.parent)


def built_from(folder: Path) -> str | None:
    """Return the commit that the builder of a package wrote into its folder, None where none did."""
    try:
        return (folder / "commit.txt").read_text(encoding="utf-8").strip() or None
    except OSError:
        return None


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
            process = subprocess.run(  # noqa: S603 - fixed arguments, no shell
                [git, "--no-optional-locks", "-C", str(package), *arguments],
                capture_output=True,
                text=True,
                timeout=20,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired):
            return None
        if process.returncode != 0:
            return None
        answer = process.stdout.strip()
    return answer or None


def _folder(init: str | None) -> Path:
    assert init is not None  # a package with an __init__.py has a file
    return Path(init).resolve().parent
