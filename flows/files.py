"""The files a person hands over: vessel profiles and model specifications in YAML, raw logs as bytes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from schemas import profile as profiles
from schemas.errors import KempfError, NotFound, UsageError
from schemas.model_spec import ModelSpec
from schemas.profile import VesselProfile


def read_bytes(path: Path, what: str) -> bytes:
    """Return the bytes of a file.

    Raises
    ------
    NotFound
        ``no_such_file``.
    UsageError
        ``path_is_directory``: a folder was given where a file is expected.
    KempfError
        ``file_unreadable``: it is there but cannot be read.
    """
    try:
        return path.read_bytes()
    except FileNotFoundError as error:
        beside = sorted(p.name for p in path.parent.iterdir())[:5] if path.parent.is_dir() else []
        raise NotFound(
            "no_such_file",
            f"There is no {what} at {path}.",
            f"Check the path; the folder holds {', '.join(beside)}." if beside else "Check the path.",
            {"path": str(path)},
        ) from error
    except IsADirectoryError as error:
        raise UsageError(
            "path_is_directory",
            f"{path} is a folder; a {what} is a file.",
            f"Give its files, as in {path}/*.",
            {"path": str(path)},
        ) from error
    except OSError as error:
        raise KempfError(
            "file_unreadable",
            f"Reading the {what} {path} failed: {error.strerror or error}.",
            "Look at the file's permissions.",
            {"path": str(path)},
        ) from error


def read_yaml(path: Path, what: str) -> Any:
    """Return what a YAML file says.

    Raises
    ------
    UsageError
        ``not_yaml``: it is no YAML; the place is named.
    """
    data = read_bytes(path, what)
    try:
        return yaml.safe_load(data)
    except (yaml.YAMLError, UnicodeDecodeError, ValueError) as error:
        told = " ".join(str(error).split())
        raise UsageError(
            "not_yaml",
            f"The {what} {path} is not valid YAML: {told}.",
            "Mend the line it names.",
            {"path": str(path)},
        ) from error


def read_profiles(paths: Sequence[Path]) -> VesselProfile:
    """Read vessel profiles and lay them over each other.

    Raises
    ------
    UsageError
        One is no profile, or two disagree.
    """
    return profiles.merge([(str(p), profiles.parse(read_yaml(p, "vessel profile"), str(p))) for p in paths])


def read_model(path: Path) -> ModelSpec:
    """Read a model specification.

    Raises
    ------
    UsageError
        ``model_invalid``: every fault is named with its place.
    """
    content = read_yaml(path, "model specification")
    try:
        return ModelSpec.model_validate(content)
    except ValidationError as error:
        faults = [f"{'.'.join(str(p) for p in e['loc']) or 'model'}: {e['msg']}" for e in error.errors()]
        raise UsageError(
            "model_invalid",
            f"{path} is not a valid model specification: {'; '.join(faults)}.",
            f"Its keys are {', '.join(ModelSpec.model_fields)}.",
            {"faults": faults},
        ) from error
