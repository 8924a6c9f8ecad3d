"""Checksums of what the tables of a folder consist of: data files, commits and checkpoints, each sealed once written.

A data file in which a bit has flipped is often read as other numbers, and a table whose last commit is gone as the
table of before. So every commit is copied with its hash into ``_seals/log`` beside the table, and the hash of every
data file into ``_seals/data``; both are compared before anything is read. What is not sealed, because its writer was
killed, is sealed by the next writer. In a bucket there are no seals: the store itself keeps checksums.
"""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal
from urllib.parse import unquote

from kempf.schemas.errors import KempfError
from kempf.warehouse.storage.whole_file import whole_file

if TYPE_CHECKING:
    from deltalake import DeltaTable

#: beside the files of a table; the table format ignores what begins so
FOLDER = "_seals"
#: attribute of a handle: the newest version whose commits were compared
_COMPARED = "kempf_compared"
#: attribute of a handle: the newest version that is sealed
_SEALED = "kempf_sealed"

What = Literal["data file", "commit", "checkpoint", "seal"]


@dataclass(frozen=True)
class Damage:
    """One file of a table that is not what it was when it was written."""

    table: str
    what: What
    #: Below the warehouse.
    path: str
    #: Why, such as ``its bytes are others than were written``.
    why: str

    def error(self) -> KempfError:
        """Return the error of whoever wanted to read it."""
        return KempfError(
            "table_damaged",
            f"The {self.what} {self.path} is damaged: {self.why}.",
            "See with `kempf verify` what else is damaged and lost; `kempf repair` makes again what can be made.",
            {"table": self.table, "path": self.path, "what": self.what},
        )


def folder_of(table: DeltaTable) -> Path | None:
    """Return the folder of a table; None for one in a bucket."""
    uri = table.table_uri
    if not uri.startswith(("file://", "/")):
        return None
    return Path(unquote(uri.removeprefix("file://")) if uri.startswith("file://") else uri)


def seal(table: DeltaTable) -> None:
    """Seal every version of a table up to the open one that is not sealed yet; call it after every commit."""
    folder = folder_of(table)
    if folder is None:
        return
    newest = table.version()
    first = vars(table).get(_SEALED, -1) + 1
    if first == 0:
        first = next((v + 1 for v in range(newest, -1, -1) if _log_seal(folder, v).exists()), 0)
    for version in range(first, newest + 1):
        with suppress(FileNotFoundError):  # cleaned up, or being brought forward: then there is nothing to seal
            _seal_version(folder, version)
    vars(table)[_SEALED] = newest


def unsealed(folder: Path) -> list[int]:
    """Return the versions of a table whose commits are there and not sealed, in order."""
    known = set(sealed_versions(folder))
    names = [path.stem for path in (folder / "_delta_log").glob("*.json")]
    return sorted(int(name) for name in names if name.isdigit() and int(name) not in known)


def seal_every(folder: Path) -> None:
    """Seal every version of a table that is not sealed yet, whatever came after it."""
    for version in unsealed(folder):
        _seal_version(folder, version)


def seal_checkpoint(table: DeltaTable) -> None:
    """Seal the checkpoint of the open version, where it has one."""
    folder = folder_of(table)
    if folder is not None:
        _seal_file(folder, _checkpoint(folder, table.version()))


def _seal_version(folder: Path, version: int) -> None:
    commit = _commit(folder, version).read_bytes()
    for path in added(commit):
        _seal_file(folder, folder / path)
    _seal_file(folder, _checkpoint(folder, version))
    text = commit.decode("utf-8", "surrogateescape")
    content = {"sha256": hashlib.sha256(commit).hexdigest(), "commit": text}
    _write(_log_seal(folder, version), json.dumps(content).encode())


def _seal_file(folder: Path, path: Path) -> None:
    """Seal a data file or a checkpoint, where it is there and has no seal."""
    mark = _file_seal(folder, path.name)
    if not mark.exists() and path.exists():
        whole = _hash(path)
        # twice, so that a bit that flips in the seal is not taken for one in the file
        _write(mark, f"{whole} {whole}".encode())


def _sealed_hash(mark: Path) -> str | None:
    """Return the hash that a seal states; None where it is no whole seal. Raises `FileNotFoundError`."""
    first, _, second = mark.read_text("ascii", "replace").partition(" ")
    return first if first == second and len(first) == 64 else None


def compare_log(table: DeltaTable, name: str) -> None:
    """Do nothing where the commits that a table rests on are those that were written.

    Raises
    ------
    KempfError
        ``table_damaged``.
    """
    folder = folder_of(table)
    if folder is None:
        return
    compared = vars(table).get(_COMPARED)
    if compared == table.version() and not _log_seal(folder, compared + 1).exists():
        return
    for damage in damages_of_log(folder, name, table.version(), compared):
        if damage.what != "seal":  # what it sealed is read as if it never had been
            raise damage.error()
    vars(table)[_COMPARED] = table.version()


def damages_of_log(folder: Path, name: str, version: int, compared: int | None = None) -> Iterator[Damage]:
    """Yield what is damaged of the commits, and of the checkpoint, that a version of a table rests on.

    Parameters
    ----------
    compared : int, optional
        Version up to which the commits were compared before; only later ones are.
    """
    first = _newest_checkpoint(folder, version) if compared is None else compared
    if compared is None and first >= 0:
        damage = damage_of_file(folder, name, _checkpoint(folder, first))
        if damage is not None:
            yield replace(damage, what="checkpoint") if damage.what != "seal" else damage
    for number in range(first + 1, version + 1):
        yield from _damage_of_commit(folder, name, number)
    # a commit that was sealed after the version was looked up is there
    beyond = version + 1
    if _log_seal(folder, beyond).exists() and not _commit(folder, beyond).exists():
        yield Damage(
            name, "commit", f"{name}/_delta_log/{beyond:020d}.json", "it was written and is not there any more"
        )


def _damage_of_commit(folder: Path, name: str, version: int) -> Iterator[Damage]:
    mark, path = _log_seal(folder, version), f"{name}/_delta_log/{version:020d}.json"
    if not mark.exists():
        return
    sealed = copy_of_commit(folder, version)
    if sealed is None:
        yield Damage(name, "seal", f"{name}/{FOLDER}/log/{mark.name}", "its own hash does not fit what it holds")
        return
    try:
        written = _commit(folder, version).read_bytes()
    except FileNotFoundError:
        yield Damage(name, "commit", path, "it was written and is not there any more")
        return
    if written != sealed:
        yield Damage(name, "commit", path, "its bytes are others than were written")


def torn_commits(folder: Path, name: str) -> Iterator[Damage]:
    """Yield the commits of a table that were never sealed and are not whole: their writer was cut off."""
    for version in unsealed(folder):
        path = _commit(folder, version)
        if not _is_whole(path.read_bytes()):
            yield Damage(name, "commit", f"{name}/_delta_log/{path.name}", "it was cut off while it was written")


def _is_whole(commit: bytes) -> bool:
    """Return whether a commit has all its lines, as far as it says itself how many files it adds."""
    try:
        actions = [json.loads(line) for line in commit.splitlines() if line.strip()]
    except ValueError:
        return False
    # what the writer says of itself stands first, so that a commit that was cut off still has it
    info = next((action["commitInfo"] for action in actions if "commitInfo" in action), None)
    if info is None or commit.endswith(b"\n"):
        return False
    if info.get("operation") == "CREATE TABLE":
        return any("metaData" in action for action in actions)
    metrics = info.get("operationMetrics") or {}
    expected = {"add": metrics.get("num_added_files"), "remove": metrics.get("num_removed_files")}
    return all(count is None or sum(kind in a for a in actions) == int(count) for kind, count in expected.items())


def copy_of_commit(folder: Path, version: int) -> bytes | None:
    """Return the sealed copy of a commit; None where there is none, or its own hash does not fit."""
    try:
        content = json.loads(_log_seal(folder, version).read_bytes())
        commit = str(content["commit"]).encode("utf-8", "surrogateescape")
        whole = hashlib.sha256(commit).hexdigest() == content["sha256"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return commit if whole else None


def sealed_versions(folder: Path) -> list[int]:
    """Return the versions of a table that are sealed, in order."""
    names = [path.stem for path in (folder / FOLDER / "log").glob("*.json")]
    return sorted(int(name) for name in names if name.isdigit())


def compare_files(folder: Path, name: str, paths: Iterable[str]) -> None:
    """Do nothing where data files of a table are those that were written; one without a whole seal passes.

    Parameters
    ----------
    paths : iterable of str
        Whole paths.

    Raises
    ------
    KempfError
        ``table_damaged``.
    """
    for path in paths:
        damage = damage_of_file(folder, name, Path(path))
        if damage is not None and damage.what != "seal":
            raise damage.error()


def damage_of_file(folder: Path, name: str, path: Path) -> Damage | None:
    """Return what is damaged of a data file or of its seal, None where nothing is or it is not sealed."""
    shown = f"{name}/{path.relative_to(folder).as_posix()}" if path.is_relative_to(folder) else f"{name}/{path.name}"
    mark = _file_seal(folder, path.name)
    try:
        sealed = _sealed_hash(mark)
        digest = _known_hash(path)
    except FileNotFoundError:
        if path.exists():
            return None
        return Damage(name, "data file", shown, "it is not there any more")
    except OSError as error:
        return Damage(name, "data file", shown, f"it cannot be read: {error.strerror or error}")
    if sealed is None:
        return Damage(name, "seal", f"{name}/{FOLDER}/data/{mark.name}", "it is no whole seal")
    return None if sealed == digest else Damage(name, "data file", shown, "its bytes are others than were written")


#: Hashes by path and what the system says of the file, so that a process computes each once.
_known: dict[tuple[str, int, int, int], str] = {}
_MOST_KNOWN = 200_000
_lock = threading.Lock()


def _known_hash(path: Path) -> str:
    at = path.stat()
    key = (str(path), at.st_ino, at.st_mtime_ns, at.st_size)
    with _lock:
        digest = _known.get(key)
    if digest is None:
        digest = _hash(path)
        with _lock:
            if len(_known) >= _MOST_KNOWN:
                _known.clear()
            _known[key] = digest
    return digest


def _hash(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def added(commit: bytes) -> list[str]:
    """Return the paths of the data files that a commit added, below the table."""
    actions = [json.loads(line) for line in commit.splitlines() if line.strip()]
    return [unquote(action["add"]["path"]) for action in actions if "add" in action]


def _commit(folder: Path, version: int) -> Path:
    return folder / "_delta_log" / f"{version:020d}.json"


def _checkpoint(folder: Path, version: int) -> Path:
    return folder / "_delta_log" / f"{version:020d}.checkpoint.parquet"


def _newest_checkpoint(folder: Path, version: int) -> int:
    """Return the version of the newest checkpoint up to a version; -1 where there is none."""
    names = [path.name.partition(".")[0] for path in (folder / "_delta_log").glob("*.checkpoint.parquet")]
    return max((int(name) for name in names if name.isdigit() and int(name) <= version), default=-1)


def _log_seal(folder: Path, version: int) -> Path:
    return folder / FOLDER / "log" / f"{version:020d}.json"


def _file_seal(folder: Path, path: str) -> Path:
    return folder / FOLDER / "data" / f"{path.rpartition('/')[2]}.sha256"


def _write(path: Path, data: bytes) -> None:
    """Write a seal, all of it or nothing."""
    with whole_file(path) as passing:
        passing.write_bytes(data)


def repair_log(folder: Path, name: str) -> list[str]:
    """Put the commits of a table back from their sealed copies, and take away what was cut off before it counted.

    Returns
    -------
    list of str
        What was done, a sentence each.
    """
    sentences = []
    newest = max(sealed_versions(folder), default=-1)
    for path in sorted((folder / "_delta_log").glob("*.checkpoint.parquet")):
        damage = damage_of_file(folder, name, path)
        if damage is not None and damage.what == "seal":
            sentences += repair_seals(folder, name, [path])
        elif damage is not None:
            # the commits are all kept: the table opens without it
            path.unlink(missing_ok=True)
            (folder / "_delta_log" / "_last_checkpoint").unlink(missing_ok=True)
            _file_seal(folder, path.name).unlink(missing_ok=True)
            sentences.append(f"The checkpoint {name}/_delta_log/{path.name} was taken away; the commits say the same.")
    for version in range(newest + 1):
        for damage in list(_damage_of_commit(folder, name, version)):
            copy = copy_of_commit(folder, version)
            if damage.what == "seal":
                _log_seal(folder, version).unlink()
                with suppress(FileNotFoundError):
                    _seal_version(folder, version)
                sentences.append(f"The seal {damage.path} was made anew.")
            elif copy is not None:
                _commit(folder, version).parent.mkdir(parents=True, exist_ok=True)
                _write(_commit(folder, version), copy)
                sentences.append(f"The commit {damage.path} was put back from its sealed copy.")
    for damage in list(torn_commits(folder, name)):
        path = folder / "_delta_log" / Path(damage.path).name
        path.unlink()
        sentences.append(f"The commit {damage.path} was taken away: {damage.why}, and never counted.")
    return sentences


def repair_seals(folder: Path, name: str, paths: Iterable[Path]) -> list[str]:
    """Seal anew the files of a table whose seals are no whole ones."""
    sentences = []
    for path in paths:
        damage = damage_of_file(folder, name, path)
        if damage is not None and damage.what == "seal":
            _file_seal(folder, path.name).unlink()
            _seal_file(folder, path)
            sentences.append(f"The seal {damage.path} was made anew.")
    return sentences


def forget(folder: Path, path: Path) -> None:
    """Take the seal of a file away that is no longer one of its table."""
    _file_seal(folder, path.name).unlink(missing_ok=True)


def forget_deleted(table: DeltaTable) -> int:
    """Take away the seals of files that a table has no longer, also those an interrupted call left; return how many.

    Commits keep theirs: they say that a commit was there.
    """
    folder = folder_of(table)
    if folder is None:
        return 0
    # seals first: a file is there before its seal is, so that one written meanwhile is not taken for deleted
    marks = sorted((folder / FOLDER / "data").glob("*.sha256"))
    there = {path.name for path in folder.rglob("*.parquet")}
    gone = [mark for mark in marks if mark.name.removesuffix(".sha256") not in there]
    for mark in gone:
        mark.unlink(missing_ok=True)
    return len(gone)
