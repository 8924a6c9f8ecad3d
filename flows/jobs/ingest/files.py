"""The files a person hands over: vessel profiles and model specifications in YAML, raw logs as bytes."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path
from typing import Any, BinaryIO

from pydantic import ValidationError

from kempf.pipeline.ingest.foreign_files import BAG_DESCRIPTION
from kempf.pipeline.ingest.log_file import LogFile
from kempf.schemas import profile as profiles
from kempf.schemas import quality, yaml_text
from kempf.schemas.errors import DataRejected, KempfError, NotFound, UsageError
from kempf.schemas.faults import faults_of
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.schemas.quality import FleetLimits

#: Names of a file that says of a folder whose logs are in it and how they are read.
PROFILES = ("profile.yaml", "profile.yml", "profile.json")

#: Largest file that is read whole, bytes: a person writes some thousand, and what takes the parser of YAML a second is
#: refused. A raw log is opened, and its reader says what is too much.
LARGEST_BYTES = 1 << 16


def read_bytes(path: Path, kind: str) -> bytes:
    """Return the bytes of a file.

    Raises
    ------
    KempfError
        What `_opened` raises.
    DataRejected
        ``file_too_large``.
    """
    with _opened(path, kind) as stream:
        return whole(LogFile(stream), str(path), kind)


def whole(file: LogFile, where: str, kind: str) -> bytes:
    """Return the bytes of an open file that a person wrote.

    Raises
    ------
    DataRejected
        ``file_too_large``.
    """
    if file.size > LARGEST_BYTES:
        raise DataRejected(
            "file_too_large",
            f"{where} has {file.size} bytes; a {kind} of more than {LARGEST_BYTES} is not read.",
            "Look whether it is the right file; a long profile may be given as several files.",
            {"path": where, "bytes": file.size},
        )
    return file.whole()


@contextmanager
def opened_log(path: Path) -> Iterator[LogFile]:
    """Open a raw log; its reader takes of it what it needs at a time.

    Raises
    ------
    KempfError
        What `_opened` raises.
    """
    with _opened(path, "raw log") as stream:
        yield LogFile(stream)


@contextmanager
def _opened(path: Path, kind: str) -> Iterator[BinaryIO]:
    """Open a file.

    Raises
    ------
    NotFound
        ``no_such_file``.
    UsageError
        ``path_is_directory``, ``not_a_file``: a folder, a device or a pipe was given where a file is expected.
    KempfError
        ``file_unreadable``: it is there but cannot be opened.
    """
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise IsADirectoryError
        if not stat.S_ISREG(status.st_mode):
            raise UsageError(
                "not_a_file",
                f"{path} is a device, a pipe or a socket; a {kind} is a file.",
                "Write it to a file first and give that.",
                {"path": str(path)},
            )
        stream = path.open("rb")
    except FileNotFoundError as error:
        beside = sorted(p.name for p in path.parent.iterdir()) if path.parent.is_dir() else []
        near = get_close_matches(path.name, beside)
        raise NotFound(
            "no_such_file",
            f"There is no {kind} at {path}.",
            f"Check the path; names in the folder that are like it: {', '.join(near)}." if near else "Check the path.",
            {"path": str(path)},
        ) from error
    except IsADirectoryError as error:
        raise UsageError(
            "path_is_directory",
            f"{path} is a folder; a {kind} is a file.",
            f"Give its files, as in {path}/*.",
            {"path": str(path)},
        ) from error
    except OSError as error:
        raise KempfError(
            "file_unreadable",
            f"Reading the {kind} {path} failed: {error.strerror or error}.",
            "Look at the path and at the file's permissions.",
            {"path": str(path)},
        ) from error
    with stream:
        yield stream


def _yaml_of(data: bytes, kind: str, where: str) -> Any:
    """Return what the bytes of a YAML file say."""
    try:
        return yaml_text.load(data)
    except yaml_text.TooLarge as error:
        raise UsageError(
            "yaml_too_large",
            f"The {kind} {where} is not read: {error}.",
            "Write it without nested aliases.",
            {"path": where},
        ) from error
    except yaml_text.NotYaml as error:
        raise UsageError(
            "not_yaml",
            f"The {kind} {where} is not valid YAML: {error}.",
            "Correct the line it names.",
            {"path": where},
        ) from error


def read_profiles(paths: Sequence[Path]) -> VesselProfile:
    """Read vessel profiles and lay them over each other.

    Raises
    ------
    UsageError
        What `profile_of` raises; two disagree.
    """
    return profiles.merge([(str(p), profile_of(read_bytes(p, "vessel profile"), str(p))) for p in paths])


def logs_in(paths: Sequence[Path]) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
    """Return the files that are meant by some paths: of a folder all in it and below, sorted, but for hidden ones.

    Returns
    -------
    logs, profiles : tuple of Path
        A folder's own ``profile.yaml`` says how its logs are read, and is no log; nor is the ``metadata.yaml`` of a bag
        of ROS 2.

    Raises
    ------
    NotFound
        ``empty_folder``.
    """
    logs: list[Path] = []
    beside: list[Path] = []
    for path in paths:
        # of "" nothing is left but a dot: a variable that was not set does not mean the folder one is in
        if str(path) == "." or not os.path.isdir(path):  # noqa: PTH112 - False, and no error, for a name too long
            logs.append(path)
            continue
        files = sorted(p for p in path.rglob("*") if p.is_file() and not _hidden(p.relative_to(path)))
        own = [p for p in files if p.name in PROFILES]
        beside += own
        described = [p for p in files if p.name == "metadata.yaml" and _describes_bag(p)]
        logs += [p for p in files if p not in own and p not in described]
        if len(files) == len(own) + len(described):
            raise NotFound(
                "empty_folder", f"There is no log in the folder {path}.", "Check the path.", {"path": str(path)}
            )
    return tuple(logs), tuple(beside)


def _describes_bag(path: Path) -> bool:
    """Return whether a file is what rosbag2 writes beside the files of a bag."""
    try:
        with path.open("rb") as stream:
            return stream.read(len(BAG_DESCRIPTION)) == BAG_DESCRIPTION
    except OSError:
        return False  # taken for a log, whose reading says what is wrong


def _hidden(path: Path) -> bool:
    return any(part.startswith(".") for part in path.parts)


def profile_of(data: bytes, where: str) -> VesselProfile:
    """Return the vessel profile that the bytes of a file hold.

    Parameters
    ----------
    where : str
        Name of the file, for the message.

    Raises
    ------
    UsageError
        It is no profile. ``profile_draft``: a ``?`` of a draft is left in it.
    """
    content = _yaml_of(data, "vessel profile", where)
    if _has_guess(content):
        text = data.decode("utf-8", errors="replace")
        lines = [
            str(k) for k, line in enumerate(text.splitlines(), 1) if re.search(r"\?[\"']?\s*([,}#]|$)", _said(line))
        ]
        raise UsageError(
            "profile_draft",
            f"{where} is still a draft: a ? is left in line{'s' if len(lines) > 1 else ''} {', '.join(lines)}.",
            "Correct what these lines say and delete the ?, or take the lines out.",
            {"path": where, "lines": [int(line) for line in lines]},
        )
    return profiles.parse(content, where)


def _said(line: str) -> str:
    """Return a line without its comment."""
    return re.sub(r"(^|\s)#.*", "", line)


def _has_guess(content: Any) -> bool:
    if isinstance(content, dict):
        return any(_has_guess(value) for value in content.values())
    if isinstance(content, list):
        return any(_has_guess(value) for value in content)
    return isinstance(content, str) and content.endswith("?")


def read_quality(path: Path) -> FleetLimits:
    """Read a file that says how many findings on logs and models a vessel may have.

    Raises
    ------
    UsageError
        ``quality_invalid``: every fault is named with its place; ``not_yaml``.
    """
    return quality.parse(_yaml_of(read_bytes(path, "file of limits"), "file of limits", str(path)), str(path))


def read_model(path: Path) -> ModelSpec:
    """Read a model specification.

    Raises
    ------
    UsageError
        ``model_invalid``: every fault is named with its place. ``model_unknown``: it asks for a base
        that is not there.
    """
    content = _yaml_of(read_bytes(path, "model specification"), "model specification", str(path))
    try:
        spec = ModelSpec.model_validate(content)
    except ValidationError as error:
        faults = faults_of(error, "model", content)
        raise UsageError(
            "model_invalid",
            f"{path} is not a valid model specification: {'; '.join(faults)}.",
            f"Its keys are {', '.join(ModelSpec.model_fields)}.",
            {"faults": faults},
        ) from error
    base = ModelSpec().base
    if spec.base != base:
        raise UsageError(
            "model_unknown",
            f"{path} asks for the base {spec.base!r}, which this version cannot identify.",
            f"Use the base {base!r}; what is beyond it goes under effects.",
            {"base": spec.base},
        )
    return spec
